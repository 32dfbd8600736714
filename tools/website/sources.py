"""The folder that Sphinx reads: the repository's pages and the files that they show, and generated pages."""

import os
import re
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path

from arc_suite.tasks import TASKS
from website import markdown, players, reference, robots, tasks
from website.returns import ROOT

# The repository's pages, as patterns of paths.
PAGES = ("CHANGELOG.md", "CONTRIBUTING.md", "docs/*.md", "examples/**/*.md", "studies/**/*.md", "web/*.md")

README = ROOT / "README.md"
DOCS_README = ROOT / "docs" / "README.md"
FRONT = (README, DOCS_README)  # pages whose texts the front page contains

# Texts of the cards of pages in studies/ that are no report of a study, by page.
_MEASURED_TABLES = {
    "catalog": "Our studies",
    "any_body": "One policy for any body",
    "gpu": "Worlds on a GPU",
    "motions": "Motions",
    "demonstrators": "Demonstrators",
    "robots_of_others": "Robots of others",
    "clips": "Clips",
    "performance": "Performance",
    "reliability": "Reliability",
    "newcomers": "Newcomers",
}

# Tasks with a page in docs/; docs/ground.md is about the other tasks.
_TASKS_WITH_PAGE = {name for name in TASKS if (ROOT / "docs" / f"{name}.md").is_file()}

# For a page, the pages below it in the tree of pages, with the texts of their cards. Most of them are generated.
BELOW = {
    "docs/robots.md": {f"robots/{robot}": robots.description(robot) for robot in players.film_pages()},
    "docs/bodies.md": {"robots/gallery": "24 generated creatures"},
    "docs/tasks.md": {name: f"`{name}`: {markdown.summary(task)}" for name, task in TASKS.items()},
    "docs/reference.md": {f"reference/{name}": title for name, title in reference.TITLES.items()},
    "studies/README.md": _MEASURED_TABLES
    | {f"{path.parent.name}/README": path.parent.name for path in ROOT.glob("studies/*/README.md")},
}

_LINK = re.compile(r"(?P<text>!?\[[^\]]*\])\((?P<path>[^):#\s]+)(?P<anchor>#[^)]*)?\)")
_PICTURE = re.compile(r"!\[[^\]]*\]\([^)]*\)")
_SECTION = re.compile(r"^## (?P<title>[^\n]*)\n(?P<text>.*?)(?=^## |\Z)", re.MULTILINE | re.DOTALL)


def write(folder: Path, walks: bool) -> None:
    """Write all sources into a new folder.

    Args:
        folder: folder to write into.
        walks: whether the site has pages in which creatures walk.
    """
    paths = {path for pattern in PAGES for path in ROOT.glob(pattern)}
    for path in sorted(paths.difference(FRONT)):
        _copy(path, folder)
    for name, text in generate_pages(walks):
        _write(folder / "docs" / f"{name}.md", text)
        _copy_files(text, (ROOT / "docs" / name).parent, folder)
    _write(folder / "index.md", front_page(walks))
    _copy_files(README.read_text(encoding="utf-8"), ROOT, folder)


def _copy(page: Path, folder: Path) -> None:
    """Copy a page of the repository, with the files to which it refers.

    Pages of tasks get the tables of the code, and pages with others below them get cards that lead to these.
    """
    relative_page = page.relative_to(ROOT)
    text = resolve_links(page.read_text(encoding="utf-8"), page.parent)
    is_task_page = page.parent.name == "docs" and page.stem in _TASKS_WITH_PAGE
    parts = [tasks.page(page.stem, text) if is_task_page else text]
    pages_below = BELOW.get(relative_page.as_posix())
    if pages_below:
        parts += [markdown.cards(pages_below), toctree(pages_below)]
    _write(folder / relative_page, "\n".join(parts))
    _copy_files(text, page.parent, folder)


def _copy_files(text: str, start: Path, folder: Path) -> None:
    """Copy the files of the repository, except pages, to which a page in the folder `start` refers."""
    for link in _LINK.finditer(text):
        target = (start / link["path"]).resolve()
        if target.is_file() and target.suffix != ".md":
            copy = folder / target.relative_to(ROOT)
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(target, copy)


def resolve_links(text: str, folder: Path) -> str:
    """Return a page of a folder with links that Sphinx can follow.

    Links to the READMEs of the repository and of docs/ become links to the front page. A link to another folder becomes
    one to its README, or plain text if it has none.
    """

    def resolve(link: re.Match) -> str:
        target = (folder / link["path"]).resolve()
        if target in FRONT:
            return f"{link['text']}({os.path.relpath(ROOT / 'index.md', folder)})"
        if not target.is_dir():
            return link[0]
        if (target / "README.md").is_file():
            return f"{link['text']}({link['path']}/README.md)"
        return link["text"].removeprefix("[").removesuffix("]")

    return _LINK.sub(resolve, text)


def generate_pages(walks: bool) -> Iterator[tuple[str, str]]:
    """Yield the name, as in `BELOW`, and the text of each generated page; for the argument see `write`."""
    for robot, film_page in players.film_pages().items():
        player = players.frame(f"../../{film_page}", f"{robot} walks", "walk") if walks else ""
        yield f"robots/{robot}", robots.page(robot, player)
    gallery_frame = players.frame(f"../../{players.GALLERY}#walk", "Creatures to play with") if walks else ""
    yield "robots/gallery", robots.gallery(gallery_frame)
    for task in TASKS:
        if task not in _TASKS_WITH_PAGE:
            yield task, tasks.page(task)
    for name, text in reference.pages():
        yield f"reference/{name}", text


def front_page(walks: bool) -> str:
    """Return the README, and below it the tree of all pages, by the sections of docs/README.md.

    If the site has pages in which creatures walk, one replaces the moving picture of the README.
    """
    readme = README.read_text(encoding="utf-8")
    index = DOCS_README.read_text(encoding="utf-8")
    trees = []
    for section in _SECTION.finditer(index):
        links = [(ROOT / "docs" / link["path"]).resolve() for link in _LINK.finditer(section["text"])]
        names = [str(link.relative_to(ROOT).with_suffix("")) for link in links]
        trees.append(toctree(names, section["title"]))
    if walks:
        readme = _PICTURE.sub(players.frame(f"{players.GAME}#walk", "Creatures to play with"), readme, count=1)
    return "\n\n".join([resolve_links(readme, ROOT), *trees]) + "\n"


def toctree(names: Iterable[str], caption: str = "") -> str:
    """Return the directive that puts pages below the page with this directive in the tree of pages."""
    caption_lines = [f":caption: {caption}"] if caption else []
    return "\n".join(["```{toctree}", ":hidden:", *caption_lines, "", *names, "```"])


def _write(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
