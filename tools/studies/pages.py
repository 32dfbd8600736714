"""Pages of docs that hold a table between the lines <!-- table --> and <!-- end -->."""

import re
from collections.abc import Callable
from pathlib import Path

from arc_suite import files

_MARKS = re.compile(r"(?<=<!-- table -->\n).*?(?=<!-- end -->)", re.DOTALL)


def table_writer(path: Path) -> Callable[[str], None]:
    """Return a function that writes a table into a page, between its lines <!-- table --> and <!-- end -->.

    Raises:
        ValueError: the page has no such lines.
        OSError: it cannot be read.
    """
    with files.reading(path):
        page = path.read_text(encoding="utf-8")
    if not _MARKS.search(page):
        raise ValueError(f"{path}: expected the lines <!-- table --> and <!-- end -->, got none")

    def write(table: str) -> None:
        files.write(path, _MARKS.sub(lambda match: f"\n{table}\n\n", page))

    return write
