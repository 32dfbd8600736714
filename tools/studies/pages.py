"""Pages of docs that hold tables, such as between the lines <!-- table --> and <!-- end -->."""

import re
from collections.abc import Callable
from pathlib import Path

from arc_suite import files


def table_writer(path: Path, name: str = "table") -> Callable[[str], None]:
    """Return a function that writes a table into a page, between its lines <!-- NAME --> and <!-- end -->.

    Args:
        path: path of the page.
        name: name of the table in its first line.

    Raises:
        ValueError: the page has no such lines.
        OSError: it cannot be read.
    """
    with files.reading(path):
        page = path.read_text(encoding="utf-8")
    place = re.compile(rf"(?<=<!-- {re.escape(name)} -->\n).*?(?=<!-- end -->)", re.DOTALL)
    if not place.search(page):
        raise ValueError(f"{path}: expected the lines <!-- {name} --> and <!-- end -->, got none")

    def write(table: str) -> None:
        files.write(path, place.sub(lambda match: f"\n{table}\n\n", page, count=1))

    return write
