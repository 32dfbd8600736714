"""What a search has found so far, in a file of JSON lines that survives being broken off."""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from arc_suite.tuning.search import Generation


class Journal:
    """A file whose first line holds what determines a search, and each further line a generation.

    Attributes:
        generations: those in the file.
    """

    def __init__(self, path: str | os.PathLike, settings: Mapping[str, Any]):
        """Opens the file, or starts one.

        Args:
            path: of the file, in a folder that is there.
            settings: what determines the search; plain values.

        Raises:
            ValueError: the file belongs to another search, or is no journal; one line.
            OSError: the file cannot be read or written.
        """
        settings, path = json.loads(json.dumps(settings)), Path(path)
        header, *lines = path.read_bytes().splitlines(keepends=True) if path.exists() else [b""]
        if header:
            _check(path, header, settings)
        # A last line without its end was being written when the search was broken off.
        complete = [line for line in lines if line.endswith(b"\n")]
        try:
            self.generations = [Generation(**json.loads(line)) for line in complete]
        except (ValueError, TypeError):
            raise ValueError(f"{path}: no journal of a search; delete it or write to another folder") from None
        self._file = path.open("ab")
        self._file.truncate(len(header) + sum(map(len, complete)))
        if not header:
            self._write(settings)

    def append(self, generation: Generation) -> None:
        """Adds a generation, which is in the file from then on."""
        self._write(generation._asdict())
        self.generations.append(generation)

    def close(self) -> None:
        """Closes the file."""
        self._file.close()

    def _write(self, value) -> None:
        self._file.write(json.dumps(value).encode() + b"\n")
        self._file.flush()


def _check(path: Path, header: bytes, settings: Mapping[str, Any]) -> None:
    try:
        found = json.loads(header)
        differing = next((name for name in settings if found[name] != settings[name]), None)
    except (ValueError, LookupError, TypeError):
        raise ValueError(f"{path}: no journal of a search; delete it or write to another folder") from None
    if differing is not None:
        raise ValueError(
            f"{path}: of a search with {differing} {found[differing]}, not {settings[differing]}; "
            "delete it or write to another folder"
        )
