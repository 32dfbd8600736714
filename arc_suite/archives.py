"""Archives of arrays (.npz) that others may have written: read as data, within limits."""

import os
import zipfile
import zlib

import numpy as np

from arc_suite import checks, files

_VALID_COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # those that NumPy writes
# Errors that NumPy and zipfile raise for damaged files.
_ERRORS_OF_DAMAGE = (
    ValueError,
    KeyError,
    TypeError,
    EOFError,
    MemoryError,
    RuntimeError,
    zipfile.BadZipFile,
    zlib.error,
)


def read(path: str | os.PathLike, max_bytes: int, only: str | None = None) -> dict[str, np.ndarray]:
    """Return the arrays of an archive by name.

    Args:
        path: path of the file.
        max_bytes: the largest valid size of all arrays together, uncompressed.
        only: name of the single array to read; None for all.

    Raises:
        OSError: the file cannot be read.
        ValueError: the file is too large or damaged, or contains a pickle.
    """
    try:
        with files.plain(path).open("rb") as file:
            with zipfile.ZipFile(file) as archive:
                entries = archive.infolist()
            size = sum(entry.file_size for entry in entries)
            if size > max_bytes:
                raise ValueError(f"expected at most {max_bytes} bytes, got {size}")
            for entry in entries:
                if entry.compress_type not in _VALID_COMPRESSIONS:
                    raise ValueError(f"{entry.filename}: expected no compression, or deflate")
            with np.load(file, allow_pickle=False) as arrays:
                names = [name for name in arrays.files if only is None or name == only]
                return {name: arrays[name] for name in names}
    except _ERRORS_OF_DAMAGE as error:
        raise ValueError(checks.quote(error)) from None
