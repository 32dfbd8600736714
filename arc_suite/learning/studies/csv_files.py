"""Tables of studies in files of CSV: lines are dictionaries of text by column."""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from arc_suite import files, parsers

_MAX_BYTES = 1 << 28  # of a file


def read(path: Path, columns: Sequence[str] | None = None) -> list[dict[str, str]]:
    """Return the lines of a table; none where there is no file.

    Args:
        path: path of the file.
        columns: names of the columns that the table must have; None for any.

    Raises:
        ValueError: other columns, or a line with more or fewer cells.
        OSError: the file cannot be read.
    """
    if not path.exists():
        return []
    text = files.read_utf8(path, _MAX_BYTES)
    with parsers.guard(f"{path}: no table"):
        reader = csv.DictReader(io.StringIO(text, newline=""))
        lines = list(reader)
        columns_in_file = reader.fieldnames or []
    expected_columns = list(columns or columns_in_file)
    # `DictReader` puts surplus cells under the key None, and fills missing cells with the value None.
    has_uneven_line = any(None in line or None in line.values() for line in lines)
    if columns_in_file != expected_columns or has_uneven_line:
        raise ValueError(f"{path}: expected lines of {', '.join(expected_columns)}")
    return lines


def write(path: Path, columns: Sequence[str], lines: Iterable[Mapping[str, object]]) -> None:
    """Replace a table; a cell that a line lacks stays empty.

    Raises:
        OSError: the file cannot be written.
    """
    files.folder(path.parent)
    with files.writing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, columns, lineterminator="\n")
        table.writeheader()
        table.writerows(lines)
