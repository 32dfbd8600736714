"""Tables of studies in files of CSV: lines are dictionaries of text by column."""

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from arc_suite import files


def read(path: Path, columns: Sequence[str] | None = None) -> list[dict[str, str]]:
    """Return the lines of a table; none where there is no file.

    Args:
        path: of the file.
        columns: that the table must have; None for any.

    Raises:
        ValueError: other columns, or a line with more or fewer cells.
        OSError: the file cannot be read.
    """
    if not path.exists():
        return []
    with files.reading(path), path.open(newline="", encoding="utf-8") as file:
        reader = csv.DictReader(file)
        lines, found = list(reader), reader.fieldnames or []
    if found != list(columns or found) or any(None in line or None in line.values() for line in lines):
        raise ValueError(f"{path}: expected lines of {', '.join(columns or found)}")
    return lines


def write(path: Path, columns: Sequence[str], lines: Iterable[Mapping[str, object]]) -> None:
    """Write a table as a whole; a cell that a line lacks stays empty.

    Raises:
        OSError: the file cannot be written.
    """
    files.folder(path.parent)
    with files.writing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, columns, lineterminator="\n")
        table.writeheader()
        table.writerows(lines)
