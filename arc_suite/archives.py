"""Archives that others may have written, of arrays (.npz) or with a member of text: read as data, within limits."""

import hashlib
import math
import os
import zipfile
from typing import IO

import numpy as np

from arc_suite import checks, files, parsers

_MAX_MEMBERS = 1 << 17
_CHUNK = 1 << 20  # bytes
_MAX_NAME = 80  # characters of a member's name in an error
_VALID_COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # those that NumPy writes
_HEADER_READERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}


def read(path: str | os.PathLike[str], max_bytes: int, only: str | None = None) -> dict[str, np.ndarray]:
    """Return the arrays of an archive by name.

    Args:
        path: path of the file.
        max_bytes: the largest valid size of all arrays together, uncompressed.
        only: name of the single array to read; None for all.

    Raises:
        OSError: the file cannot be read.
        ValueError: the file is too large or damaged, or contains a pickle; the message names the array.
    """
    arrays = {}
    with files.plain(path).open("rb") as file, _open(file, max_bytes) as archive:
        for entry in archive.infolist():
            name = entry.filename.removesuffix(".npy")
            if only is None or name == only:
                with parsers.guard(checks.quote(entry.filename)[:_MAX_NAME]):
                    arrays[name] = _read_array(archive, entry)
    return arrays


def read_member(path: str | os.PathLike[str], member: str, max_bytes: int) -> str:
    """Return the text of a member of an archive.

    Args:
        path: path of the file.
        member: name of the member.
        max_bytes: the largest valid size of the member, uncompressed.

    Raises:
        OSError: the file cannot be read.
        ValueError: the file is damaged, has no such member, or the member is too large.
    """
    with files.plain(path).open("rb") as file, _open(file) as archive, parsers.guard(member):
        entry = archive.getinfo(member)
        if entry.file_size > max_bytes:
            raise ValueError(f"expected at most {max_bytes} bytes, got {entry.file_size}")
        return archive.read(entry).decode("utf-8")


def digest(path: str | os.PathLike[str], max_bytes: int) -> str:
    """Return the sha256 of the members of an archive: their names in order, sizes and bytes.

    Times and the compression of members do not count.

    Args:
        path: path of the file.
        max_bytes: the largest valid size of all members together, uncompressed.

    Raises:
        OSError: the file cannot be read.
        ValueError: the file is too large or damaged.
    """
    content_hash = hashlib.sha256()
    with files.plain(path).open("rb") as file, _open(file, max_bytes) as archive:
        for entry in sorted(archive.infolist(), key=lambda entry: entry.filename):
            content_hash.update(f"{entry.filename}\0{entry.file_size}\0".encode())
            with parsers.guard(checks.quote(entry.filename)[:_MAX_NAME]), archive.open(entry) as member:
                while chunk := member.read(_CHUNK):
                    content_hash.update(chunk)
    return content_hash.hexdigest()


def _open(file: IO[bytes], max_bytes: float = math.inf) -> zipfile.ZipFile:
    """Return an archive after a check of the compression and the size of its members."""
    with parsers.guard("no archive"):
        archive = zipfile.ZipFile(file)
    entries = archive.infolist()
    if len(entries) > _MAX_MEMBERS:
        raise ValueError(f"expected at most {_MAX_MEMBERS} members, got {len(entries)}")
    size = sum(entry.file_size for entry in entries)
    if size > max_bytes:
        raise ValueError(f"expected at most {max_bytes} bytes, got {size}")
    if len(archive.NameToInfo) < len(entries):
        raise ValueError("expected each member once")
    for entry in entries:
        if entry.compress_type not in _VALID_COMPRESSIONS:
            raise ValueError(f"{checks.quote(entry.filename)[:_MAX_NAME]}: expected no compression, or deflate")
    return archive


def _read_array(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> np.ndarray:
    """Return the array of a member, whose header is compared with the size of the member before anything is made."""
    with archive.open(entry) as member:
        version = np.lib.format.read_magic(member)
        if version not in _HEADER_READERS:
            raise ValueError(f"expected version 1.0 or 2.0 of arrays, got {version}")
        shape, _, dtype = _HEADER_READERS[version](member)
        if dtype.hasobject:
            raise ValueError("expected numbers or texts, got a pickle")
        # Python's integers do not overflow, whatever the header claims.
        is_valid_shape = all(type(length) is int and length >= 0 for length in shape)
        num_bytes = entry.file_size - member.tell()
        if not is_valid_shape or math.prod(shape) * dtype.itemsize != num_bytes:
            raise ValueError(f"its header claims {dtype} of shape {shape}, and it has {num_bytes} bytes")
    with archive.open(entry) as member:
        return np.lib.format.read_array(member, allow_pickle=False)
