"""Archives of arrays (.npz) that others may have written: read as data, within limits."""

import os
import zipfile
import zlib

import numpy as np

from arc_suite import checks, files

_COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # what NumPy writes
# What NumPy and zipfile raise for damaged files.
_DAMAGES = (ValueError, KeyError, TypeError, EOFError, MemoryError, RuntimeError, zipfile.BadZipFile, zlib.error)


def read(path: str | os.PathLike, most: int, only: str | None = None) -> dict[str, np.ndarray]:
    """Return the arrays of an archive by name.

    Args:
        path: of the file.
        most: bytes that all arrays may have, unpacked.
        only: name of the array to read; None for all.

    Raises:
        OSError: it cannot be read.
        ValueError: it is larger, damaged, or holds a pickle.
    """
    try:
        with files.plain(path).open("rb") as file:
            with zipfile.ZipFile(file) as archive:
                entries = archive.infolist()
            if (size := sum(entry.file_size for entry in entries)) > most:
                raise ValueError(f"expected at most {most} bytes, got {size}")
            if unknown := [entry.filename for entry in entries if entry.compress_type not in _COMPRESSIONS]:
                raise ValueError(f"{unknown[0]}: expected no compression, or deflate")
            with np.load(file, allow_pickle=False) as stored:
                return {name: stored[name] for name in stored.files if only in (None, name)}
    except _DAMAGES as error:
        raise ValueError(checks.quote(error)) from None
