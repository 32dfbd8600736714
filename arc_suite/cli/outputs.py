"""Names of the files that programs write."""

import os
from collections.abc import Iterable
from pathlib import Path

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
        program = _PROGRAM_OF_EXTENSION.get(Path(path).suffix.lower())
        if program is None:
            raise
        raise ValueError(f"{error}; {program}") from None
