"""Journals: what a search has found so far, in a file of JSON lines that survives interruptions."""

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from arc_suite import checks, files, parsers

_MAX_BYTES = 1 << 30  # of a file


class Journal:
    """A file whose first line contains the settings of a search, and each further line a generation.

    Attributes:
        generations: those in the file, NamedTuples.
    """

    def __init__(self, path: str | os.PathLike[str], settings: Mapping[str, Any], generation: Callable[..., Any]):
        """Open the file, or start one.

        Args:
            path: path of the file, in a folder that exists.
            settings: what determines the search; plain values.
            generation: NamedTuple class of a generation, or another function of the fields of a line.

        Raises:
            ValueError: the file belongs to another search, or is no journal, or another process
                writes to it.
            OSError: the file cannot be read or written.
        """
        path = Path(path)
        header = _to_line(settings)
        if path.exists() and not path.is_file():
            raise OSError(f"cannot write {path}: expected a file")
        try:
            self._file = path.open("a+b")
        except OSError as error:
            raise OSError(f"cannot write {path}: {error.strerror.lower()}") from None
        if not files.lock(self._file):
            raise ValueError(f"{path}: another process goes on with this search")

        text = _complete_lines(files.read_bytes(path, _MAX_BYTES), header)
        if len(text) > _MAX_BYTES:
            raise ValueError(f"{path}: expected at most {_MAX_BYTES} bytes")
        self.generations = _read_generations(path, text, header, generation) if text else []
        self._file.truncate(len(text))
        if not text:
            self._write(header)

    def append(self, generation: Any) -> None:
        """Add a generation, and write it to the file at once."""
        self._write(_to_line(generation._asdict()))
        self.generations.append(generation)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _write(self, line: bytes) -> None:
        with files.naming(self._file.name):
            self._file.write(line)
            self._file.flush()


def _to_line(fields: Mapping[str, Any]) -> bytes:
    return json.dumps(fields).encode() + b"\n"


def _complete_lines(text: bytes, header: bytes) -> bytes:
    """Return a journal's text without a last line that an interruption has cut off."""
    header_is_cut_off = header.startswith(text) and text != header
    if header_is_cut_off:
        return b""
    end_of_last_line = text.rfind(b"\n") + 1
    if end_of_last_line == 0:
        return text  # one line that is not the header: no journal, which `_read_generations` says
    return text[:end_of_last_line]


def _read_generations(path: Path, text: bytes, header: bytes, generation: Callable[..., Any]) -> list[Any]:
    """Return the generations in a journal's text.

    Raises:
        ValueError: the text is no journal, or has another header.
    """
    advice = "delete it or write to another folder"
    with parsers.guard(f"{path}: no journal of a search", cure=f"; {advice}"):
        first_line, *lines = text.splitlines()
        stored_settings = json.loads(first_line)
        settings = json.loads(header)
        different_names = [name for name in settings if stored_settings[name] != settings[name]]
        generations = [generation(**json.loads(line)) for line in lines]
    if different_names:
        name = different_names[0]
        stored_value = checks.quote(stored_settings[name])
        value = checks.quote(settings[name])
        raise ValueError(f"{path}: of a search with {name} {stored_value}, not {value}; {advice}")
    return generations
