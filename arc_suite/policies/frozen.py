"""Frozen folders of code: a copy that nobody changes while it runs, and a hash of what it holds.

A module acts by files next to it, such as weights. So its content is that of the folder in which it lies.
"""

import contextlib
import hashlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from arc_suite import files

MAX_FILES = 10_000  # of a folder
MAX_BYTES = 1 << 30  # of all its files

_BYTECODE = "__pycache__"  # folders that Python writes when the code runs
_CHUNK = 1 << 20  # bytes


class Frozen(NamedTuple):
    """A copy of a folder.

    Attributes:
        path: path of the copy.
        sha256: hash of the names, sizes and bytes of its files.
    """

    path: Path
    sha256: str


@contextlib.contextmanager
def freeze(folder: Path) -> Iterator[Frozen]:
    """Copy a folder into a temporary one, which is deleted at the end, and hash what is copied.

    The hash is that of the relative names in order, with sizes and bytes. Folders of bytecode are left out.

    Raises:
        ValueError: a link or another thing that is neither file nor folder, too many files, or too many bytes.
        OSError: a file cannot be read, or the disk is full.
    """
    with tempfile.TemporaryDirectory(prefix="arc_suite-") as temporary:
        copy = Path(temporary).resolve()
        content_hash = hashlib.sha256()
        remaining_bytes = MAX_BYTES
        for path in _list_files(folder):
            name = path.relative_to(folder)
            target = copy / name
            target.parent.mkdir(parents=True, exist_ok=True)
            with files.reading(path):
                size, digest = _copy_file(path, target, remaining_bytes)
            remaining_bytes -= size
            if remaining_bytes < 0:
                raise ValueError(f"{folder}: expected at most {MAX_BYTES} bytes next to a module")
            # A name cannot hold the byte 0, so that no two folders have one text.
            content_hash.update(f"{name.as_posix()}\0{size}\0{digest}\0".encode("utf-8", "surrogateescape"))
        yield Frozen(copy, content_hash.hexdigest())


def _list_files(folder: Path) -> list[Path]:
    """Return the paths of all files in a folder and its folders, in the order of their relative names."""
    paths = []
    folders = [folder]
    while folders:
        with files.reading(folders[-1]), os.scandir(folders.pop()) as entries:
            for entry in entries:
                if entry.is_symlink() or not (entry.is_file() or entry.is_dir()):
                    raise ValueError(
                        f"{entry.path}: expected a file or a folder next to a module, got a link or the like"
                    )
                if entry.is_file():
                    paths.append(Path(entry.path))
                elif entry.name != _BYTECODE:
                    folders.append(Path(entry.path))
        if len(paths) + len(folders) > MAX_FILES:
            raise ValueError(f"{folder}: expected at most {MAX_FILES} files next to a module")
    return sorted(paths, key=lambda path: path.relative_to(folder).as_posix())


def _copy_file(path: Path, target: Path, max_bytes: int) -> tuple[int, str]:
    """Copy a file, at most one chunk more than `max_bytes`, and return the size and the hash of the copy."""
    size = 0
    content_hash = hashlib.sha256()
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0))
    with open(descriptor, "rb") as source, target.open("wb") as copy:
        while size <= max_bytes and (chunk := source.read(_CHUNK)):
            size += len(chunk)
            content_hash.update(chunk)
            copy.write(chunk)
    return size, content_hash.hexdigest()
