"""Counts the words that are written by hand in README.md and docs/, and how long sentences are.

Code and what programs write between `<!-- name -->` and `<!-- end -->` (or `<!-- end of name -->`) do not count.

Example:
  python tools/count_words.py
"""

import re
from pathlib import Path
from typing import NamedTuple

from arc_suite.cli import program

ROOT = Path(__file__).resolve().parents[1]
LONG = 25  # words of a sentence, at most

_WRITTEN = re.compile(r"^<!-- (?!end)[^\n]* -->$.*?^<!-- end[^\n]* -->$", re.MULTILINE | re.DOTALL)
_CODE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
_TARGET = re.compile(r"\]\([^)]*\)")
_WORD = re.compile(r"\w")
# Where a sentence ends: behind a stop, and at the ends of paragraphs, items, headings and cells of tables.
_END = re.compile(r"(?<=[.!?])[*)\"]*\s+|\n\s*\n|\n\s*(?:[-*]|\d+\.)\s|\n#+\s|\n(?=\|)|\|")


class Count(NamedTuple):
    """What a text has.

    Attributes:
        words: by hand.
        sentences: number of words of each.
    """

    words: int
    sentences: list[int]


def count(text: str) -> Count:
    """Count a page of Markdown."""
    plain = _TARGET.sub("]", _CODE.sub("\n\n", _WRITTEN.sub("\n\n", text)))
    lengths = [len(_words(sentence)) for sentence in _END.split(f"\n{plain}")]
    return Count(len(_words(plain)), [length for length in lengths if length])


def _words(text: str) -> list[str]:
    return [word for word in text.split() if _WORD.search(word)]


def counts() -> dict[str, Count]:
    """Return the counts of all pages by their paths."""
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    return {page.relative_to(ROOT).as_posix(): count(page.read_text(encoding="utf-8")) for page in pages}


def short(sentences: list[int]) -> float:
    """Return the share of sentences that have at most `LONG` words."""
    return 1.0 - sum(length > LONG for length in sentences) / max(len(sentences), 1)


def main() -> None:
    """Print a line for each page, and the sums."""
    counts_of_pages = counts()
    for name, page in counts_of_pages.items():
        print(f"{name:32}{page.words:7}{short(page.sentences):8.1%}")
    sentences = [length for page in counts_of_pages.values() for length in page.sentences]
    words = sum(page.words for page in counts_of_pages.values())
    print(f"{'all':32}{words:7}{short(sentences):8.1%}")


if __name__ == "__main__":
    program.run(main)
