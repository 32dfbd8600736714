"""Pages answer at once: how they begin, why long ones are one page, and the lengths of sentences."""

import re

import count_words
import pytest

COUNTS = count_words.counts()
PAGES = sorted((count_words.ROOT / "docs").glob("*.md"))


def test_most_sentences_are_short():
    assert count_words.short([length for page in COUNTS.values() for length in page.sentences]) >= 0.95


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_begins_with_what_its_reader_came_for(page):
    """With a sentence, a command, a picture or a table, before the first heading of a part."""
    title, _, text = page.read_text(encoding="utf-8").partition("\n\n")
    assert re.fullmatch("# .+", title)
    assert not text.startswith("#")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_long_page_says_why_it_is_one_page(page):
    text = page.read_text(encoding="utf-8")
    is_long = len(text.split()) > 900
    assert is_long == ("This is one page because " in " ".join(text.split()))


def test_what_counts():
    text = """# Two words

A sentence, [with a link](to/nowhere.md). Another one:

- an item of five words

| head | of three |
|---|---|
| 1 | 2 |

<!-- table -->
What a program writes.
<!-- end -->

```sh
code --flag
```
"""
    words, sentences = count_words.count(text)
    assert words == 19
    assert sentences == [2, 5, 2, 5, 1, 2, 1, 1]
    assert count_words.short([5, 25, 26, 5]) == 0.75
