"""Journals: what a search has found so far, in a file of JSON lines that survives being broken off."""

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from arc_suite import checks, files


class Journal:
    """A file whose first line holds what determines a search, and each further line a generation.

    Attributes:
        generations: those in the file, NamedTuples.
    """

    def __init__(self, path: str | os.PathLike, settings: Mapping[str, Any], generation: Callable[..., Any]):
        """Open the file, or starts one.

        Args:
            path: of the file, in a folder that is there.
            settings: what determines the search; plain values.
            generation: makes a generation from the fields of a line.

        Raises:
            ValueError: the file belongs to another search, or is no journal, or another process
                writes to it.
            OSError: the file cannot be read or written.
        """
        path, header = Path(path), _line(settings)
        try:
            self._file = path.open("a+b")
        except OSError as error:
            raise OSError(f"cannot write {path}: {error.strerror.lower()}") from None
        if not files.lock(self._file):
            raise ValueError(f"{path}: another process goes on with this search")
        text = path.read_bytes()
        # What has no end was being written when the search was broken off.
        if not header.startswith(text):
            text = text[: text.rfind(b"\n") + 1] or text
        elif text != header:
            text = b""
        self.generations = _generations(path, text, header, generation) if text else []
        self._file.truncate(len(text))
        if not text:
            self._write(header)

    def append(self, generation: Any) -> None:
        """Add a generation, which is in the file from then on."""
        self._write(_line(generation._asdict()))
        self.generations.append(generation)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _write(self, line: bytes) -> None:
        self._file.write(line)
        self._file.flush()


def _line(value: Mapping[str, Any]) -> bytes:
    return json.dumps(value).encode() + b"\n"


def _generations(path: Path, text: bytes, header: bytes, generation: Callable[..., Any]) -> list[Any]:
    """Return the generations of a journal's text, if its header is that one."""
    advice = "delete it or write to another folder"
    try:
        found, *lines = map(json.loads, text.splitlines())
        wanted = json.loads(header)
        differing = [name for name in wanted if found[name] != wanted[name]]
        generations = [generation(**line) for line in lines]
    except (ValueError, LookupError, TypeError, RecursionError):
        raise ValueError(f"{path}: no journal of a search; {advice}") from None
    for name in differing:
        there, asked = checks.quote(found[name]), checks.quote(wanted[name])
        raise ValueError(f"{path}: of a search with {name} {there}, not {asked}; {advice}")
    return generations
