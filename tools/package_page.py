"""Writes tools/package.md, the text for package indexes, from README.md: an index has neither its files nor a clone.

Example:
  python tools/package_page.py
"""

import re
from pathlib import Path

from arc_suite.cli import program

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "tools" / "package.md"

_PICTURE = re.compile(r"!\[[^\]]*\]\([^)]*\)\n+")
_FILE = re.compile(r"\[([^\]]*)\]\((?!https:)[^)]*\)")  # a link to a file of the repository
_INSTALL = re.compile(r"(?<=^## Install\n\n).*?(?=^## )", re.MULTILINE | re.DOTALL)
_DOORS = re.compile(r"^## I want to .*?(?=^## )", re.MULTILINE | re.DOTALL)

INSTALL = """\
```sh
pip install 'arc_suite[learn,animate]'
arc-suite doctor
```

`arc-suite doctor` examines the machine, and `arc-suite --help` lists the programs.

"""


def page(readme: str) -> str:
    """Return the README for an index: without pictures and doors, links to files as text, another installation."""
    text = _INSTALL.sub(INSTALL, _DOORS.sub("", _PICTURE.sub("", readme)))
    return "\n".join(["<!-- README.md -->", "", _FILE.sub(r"\1", text), "<!-- end -->", ""])


def main() -> None:
    """Write the page."""
    PAGE.write_text(page((ROOT / "README.md").read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    program.run(main)
