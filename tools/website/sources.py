"""The folder that Sphinx reads: the repository's pages at the same places, what they refer to, and generated pages."""

import os
import re
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path

from arc_suite.tasks import TASKS
from website import markdown, players, reference, robots, tasks
from website.returns import ROOT

PAGES = ("CHANGELOG.md", "CONTRIBUTING.md", "docs/*.md", "examples/**/*.md", "studies/**/*.md")

FRONT = (ROOT / "README.md", ROOT / "docs" / "README.md")  # whose texts the front page has

# Measured tables that are no study, by page.
_MEASURED = {
    "demonstrators": "Demonstrators",
    "robots_of_others": "Robots of others",
    "clips": "Clips",
    "performance": "Performance",
    "reliability": "Reliability",
}

_WRITTEN = {name for name in TASKS if (ROOT / "docs" / f"{name}.md").is_file()}  # the others lie under `ground`

# Page -> pages that lie below it, most of them generated, with what their cards say.
BELOW = {
    "docs/robots.md": {f"robots/{robot}": robots.about(robot) for robot in players.films()},
    "docs/bodies.md": {"robots/gallery": "24 generated creatures"},
    "docs/tasks.md": {name: f"`{name}`: {markdown.summary(task)}" for name, task in TASKS.items()},
    "docs/reference.md": {f"reference/{name}": title for name, title in reference.TITLES.items()},
    "studies/README.md": _MEASURED
    | {f"{path.parent.name}/README": path.parent.name for path in ROOT.glob("studies/*/README.md")},
}

_LINK = re.compile(r"(?P<text>!?\[[^\]]*\])\((?P<path>[^):#\s]+)(?P<anchor>#[^)]*)?\)")
_PICTURE = re.compile(r"!\[[^\]]*\]\([^)]*\)")
_SECTION = re.compile(r"^## (?P<title>[^\n]*)\n(?P<text>.*?)(?=^## |\Z)", re.MULTILINE | re.DOTALL)


def write(folder: Path, walks: bool) -> None:
    """Write all sources into a new folder; `walks` says whether there are pages in which creatures walk."""
    paths = {path for pattern in PAGES for path in ROOT.glob(pattern)}
    for path in sorted(paths.difference(FRONT)):
        _copy(path, folder)
    for name, text in generated(walks):
        _write(folder / "docs" / f"{name}.md", text)
        _copy_files(text, (ROOT / "docs" / name).parent, folder)
    _write(folder / "index.md", front_page(walks))
    _copy_files(FRONT[0].read_text(encoding="utf-8"), ROOT, folder)


def _copy(page: Path, folder: Path) -> None:
    """Copy a page with what its links need."""
    text, place = page.read_text(encoding="utf-8"), page.relative_to(ROOT)
    below = BELOW.get(place.as_posix(), {})
    text = resolved(text, page.parent)
    written = tasks.page(page.stem, text) if page.stem in _WRITTEN and page.parent.name == "docs" else text
    parts = [written, *((markdown.cards(below), toctree(below)) if below else ())]
    _write(folder / place, "\n".join(parts))
    _copy_files(text, page.parent, folder)


def _copy_files(text: str, start: Path, folder: Path) -> None:
    """Copy the files of the repository, except pages, to which a page in the folder `start` refers."""
    for link in _LINK.finditer(text):
        target = (start / link["path"]).resolve()
        if target.is_file() and target.suffix != ".md":
            copied = folder / target.relative_to(ROOT)
            copied.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(target, copied)


def resolved(text: str, folder: Path) -> str:
    """Return a page of a folder with links that Sphinx can follow.

    Links to the READMEs of the repository and of docs/ lead to the front page, links to a folder to its README, or
    nowhere where it has none.
    """

    def resolve(link: re.Match) -> str:
        target = (folder / link["path"]).resolve()
        if target in FRONT:
            return f"{link['text']}({os.path.relpath(ROOT / 'index.md', folder)})"
        if not target.is_dir():
            return link[0]
        return f"{link['text']}({link['path']}/README.md)" if (target / "README.md").is_file() else link["text"][1:-1]

    return _LINK.sub(resolve, text)


def generated(walks: bool) -> Iterator[tuple[str, str]]:
    """Yield names of generated pages, as in `BELOW`, and their texts."""
    for robot, name in players.films().items():
        yield (
            f"robots/{robot}",
            robots.page(robot, players.frame(f"../../{name}", f"{robot} walks", "walk") if walks else ""),
        )
    shown = players.frame(f"../../{players.GALLERY}#walk", "Creatures to play with") if walks else ""
    yield "robots/gallery", robots.gallery(shown)
    yield from ((task, tasks.page(task)) for task in TASKS if task not in _WRITTEN)
    yield from ((f"reference/{name}", text) for name, text in reference.pages())


def front_page(walks: bool) -> str:
    """Return the README, and below it the tree of all pages, by the sections of docs/README.md.

    The moving picture of the README becomes a creature to play with.
    """
    readme, index = (path.read_text(encoding="utf-8") for path in FRONT)
    trees = []
    for section in _SECTION.finditer(index):
        links = [(ROOT / "docs" / link["path"]).resolve() for link in _LINK.finditer(section["text"])]
        names = [str(link.relative_to(ROOT).with_suffix("")) for link in links]
        trees.append(toctree(names, section["title"]))
    if walks:
        readme = _PICTURE.sub(players.frame(f"{players.GAME}#walk", "Creatures to play with"), readme, count=1)
    return "\n\n".join([resolved(readme, ROOT), *trees]) + "\n"


def toctree(names: Iterable[str], caption: str = "") -> str:
    """Return the directive that puts pages below the page on which it stands."""
    return "\n".join(["```{toctree}", ":hidden:", *([f":caption: {caption}"] if caption else []), "", *names, "```"])


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
