"""Names of the files that programs write."""

import os
from collections.abc import Iterable
from pathlib import Path

from absl import flags

from arc_suite import checks

_MESH = "arc-suite animate writes a .glb, which Blender turns into others"
_PICTURES = "arc-suite render writes pictures, films and pages"
_PROGRAM_OF_EXTENSION = {
    ".blend": _MESH,
    ".fbx": _MESH,
    ".gif": _PICTURES,
    ".glb": "arc-suite animate writes .glb",
    ".html": "arc-suite render and arc-suite play write pages",
    ".mp4": _PICTURES,
    ".obj": _MESH,
    ".onnx": "arc-suite export writes .onnx",
    ".png": _PICTURES,
    ".stl": _MESH,
    ".urdf": "the suite writes bodies as MJCF",
    ".webp": _PICTURES,
    ".xml": "arc-suite build_model writes .xml",
}
_EXTENSIONS = (*_PROGRAM_OF_EXTENSION, ".csv", ".json", ".npz")  # of files that programs write


def check_extension(path: str | os.PathLike[str], valid: Iterable[str]) -> str:
    """Return the extension of a file that a program writes, in lower case.

    Args:
        path: path of the file.
        valid: extensions that the program writes, each with its dot.

    Raises:
        ValueError: the file has another extension, or none. The message names the program that writes it, if any does.
    """
    try:
        return checks.extension(path, valid)
    except ValueError as error:
        raise ValueError(f"{error}{_name_program(path)}") from None


def check_folders(*names: str) -> None:
    """Check that flags that name folders have no file's extension.

    Args:
        names: names of the flags.

    Raises:
        ValueError: a value ends in an extension of a file that a program writes, and is no folder.
    """
    for name in names:
        path = Path(flags.FLAGS[name].value or "")
        if path.suffix.lower() in _EXTENSIONS and not path.is_dir():
            raise ValueError(f"--{name}={path}: expected a folder, got the name of a file{_name_program(path)}")


def check_json(path: str | None) -> None:
    """Check the path of a file that takes JSON: none, one that ends in `.json`, or one without an extension.

    Raises:
        ValueError: another extension.
    """
    if path is not None and Path(path).suffix:
        check_extension(path, [".json"])


def _name_program(path: str | os.PathLike[str]) -> str:
    """Return the part of an error that names the program that writes files like this one; "" without one."""
    program = _PROGRAM_OF_EXTENSION.get(Path(path).suffix.lower())
    return f"; {program}" if program else ""
