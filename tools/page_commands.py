"""What a reader of README and docs types: blocks by section, and commands, as they are written or shortened."""

import pathlib
import re
from collections.abc import Iterator
from typing import NamedTuple

ROOT = pathlib.Path(__file__).parents[1]

_SECTION = re.compile(r"(?:\A# |^## )(?P<name>[^\n]*)\n(?P<text>.*?)(?=^## |\Z)", re.MULTILINE | re.DOTALL)
_BLOCK = re.compile(r"^```(?P<kind>sh|python)\n(?P<text>.*?)^```", re.MULTILINE | re.DOTALL)
_SAVE_REQUEST = re.compile(r"[Ss]ave this as\s+`(?P<file>[^`]+)`[^`]*\Z")
_COMMAND = re.compile(r"(?:^|`)((?:python (?:tools/|-m arc_suite)|arc-suite )[^`\n]*(?:\n[^`\n]+(?=`))?)", re.MULTILINE)
_COMMENT = re.compile(r"\s+#.*")

# Programs whose work fewer episodes, bodies or minutes shorten: what a check adds to a command of a page.
SHORTER = {
    "train": "--minutes=2",
    "evaluate": "--episodes=1",
    "collect": "--episodes=1",
    "style": "--episodes=1",
    "transfer": "--families=varied",
}


class Block(NamedTuple):
    """A block of a section.

    Attributes:
        kind: sh or python.
        text: commands, or a script.
        file: file that the text goes into, instead of being run; None for a block that is run.
    """

    kind: str
    text: str
    file: str | None = None

    @property
    def commands(self) -> list[str]:
        """The commands of a block of sh, each in one line, without comments."""
        lines = self.text.replace("\\\n", " ").splitlines() if self.kind == "sh" else []
        return [" ".join(_COMMENT.sub("", line).split()) for line in lines if line.strip()]


def page(name: str) -> str:
    """Return the text of README, or of a page of docs."""
    folder = ROOT if name == "README" else ROOT / "docs"
    return (folder / f"{name}.md").read_text(encoding="utf-8")


def sections(text: str) -> dict[str, str]:
    """Return the texts of a page's sections by heading, in its order."""
    return {section["name"]: section["text"] for section in _SECTION.finditer(text)}


def blocks(text: str) -> Iterator[Block]:
    """Yield the blocks of a text, in its order."""
    for block in _BLOCK.finditer(text):
        request = _SAVE_REQUEST.search(text, 0, block.start())
        file = None if request is None else request["file"]
        yield Block(block["kind"], block["text"], file)


def commands(text: str) -> list[str]:
    """Return the programs that a text runs, in blocks and in sentences, each in one line."""
    return [" ".join(command.split()) for command in _COMMAND.findall(text.replace("\\\n", " "))]


def shorten(command: str) -> str:
    """Return a command that does less of the same."""
    words = command.split()
    program = words[1] if len(words) > 1 else ""
    return f"{command} {SHORTER.get(program, '')}".strip()
