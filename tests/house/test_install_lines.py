"""Every line that installs something works as it is written, in a clone."""

import configparser
import json
import pathlib
import re
import shlex
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).parents[2]
SETUP = configparser.ConfigParser()
SETUP.read(ROOT / "setup.cfg")
EXTRAS = set(SETUP["options.extras_require"])
NOTEBOOK = ".ipynb"
INDEX = ROOT / "tools" / "package.md"  # shown by a package index alone, which then has the package
PAGES = [ROOT / "README.md", INDEX, *(ROOT / "docs").glob("*.md"), *(ROOT / "examples").rglob("*.md")]
SOURCES = [*PAGES, *(ROOT / "examples").rglob("*.py"), *(ROOT / "examples").rglob(f"*{NOTEBOOK}")]


def text(path):
    """The text of a page or script, or of a notebook's cells."""
    text = path.read_text(encoding="utf-8")
    return (
        "".join(line for cell in json.loads(text)["cells"] for line in cell["source"])
        if path.suffix == NOTEBOOK
        else text
    )


def lines():
    """Each command `pip install`, with the folder that it runs in."""
    for path in SOURCES:
        folder = path.parent if path.suffix == NOTEBOOK else ROOT
        for line in re.findall(r"\bpip install ([^`\n]*)", text(path)):
            if path != INDEX:
                yield folder, shlex.split(line, comments=True)


def test_the_package_comes_from_the_clone_with_extras_that_there_are():
    found = list(lines())
    assert len(found) > 15
    for folder, words in found:
        for word, before in zip(words, ["", *words], strict=False):
            place, _, extras = word.partition("[")
            if before == "-e":
                assert (folder / place).resolve() == ROOT, words
                assert set(extras.rstrip("]").split(",")) <= EXTRAS | {""}, words
            else:
                assert not word.startswith("arc_suite"), words


@pytest.mark.release
@pytest.mark.parametrize("line", sorted({tuple(words) for _, words in lines()}), ids=" ".join)
def test_pip_finds_all_of_it(line):
    folder = next(folder for folder, words in lines() if tuple(words) == line)
    subprocess.run([sys.executable, "-m", "pip", "install", "-q", "--dry-run", *line], cwd=folder, check=True)
