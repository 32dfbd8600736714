"""Writes what Sphinx builds the site from: a folder `sources`, and a folder `extra` that it copies as it is.

Creatures walk on the site where `make web` has built the scripts of pages; elsewhere there are pictures.

Example:
  python tools/make_site.py out/docs
"""

import shutil
from pathlib import Path

from website import players, sources

from arc_suite.cli import program


def main(folder: str | None = None) -> None:
    """Write both folders anew."""
    if folder is None:
        raise ValueError("expected a folder, got none")
    parts = {name: Path(folder) / name for name in ("sources", "extra")}
    for part in parts.values():
        shutil.rmtree(part, ignore_errors=True)
        part.mkdir(parents=True)
    walks = True
    try:
        players.write(parts["extra"])
    except ValueError as error:
        walks = False
        print(f"pictures in place of walking creatures: {error}")
    sources.write(parts["sources"], walks)


if __name__ == "__main__":
    program.run(main)
