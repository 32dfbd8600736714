"""Pages stay short: words, with all tables and code and without, and the lengths of sentences."""

import count_words

COUNTS = count_words.counts()


def test_all_pages_together():
    texts = [page.read_text(encoding="utf-8") for page in (count_words.ROOT / "docs").rglob("*.md")]
    assert sum(len(text.split()) for text in texts) <= 27_000
    assert count_words.short([length for page in COUNTS.values() for length in page.sentences]) >= 0.95


def test_each_page():
    assert {name: page.words for name, page in COUNTS.items() if page.words > 900} == {}


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
