"""Lines of code are counted without docstrings, comments and blank lines."""

import count_lines

TEXT = '''"""A module."""

# A comment.
A = """a

string"""


def function(x):
    """Return x.

    Twice.
    """
    return (  # a comment behind code
        x
    )
'''


def test_docstrings_comments_and_blank_lines_do_not_count():
    assert sorted(count_lines.code_lines(TEXT)) == [4, 6, 9, 14, 15, 16]
    assert list(count_lines.functions(TEXT)) == [("function", 4)]


def test_long_functions_do_not_grow_in_number():
    assert len(count_lines.long_functions(count_lines.ROOT / "arc_suite")) <= 14


def test_parts_make_up_the_package():
    counts = count_lines.counts(count_lines.ROOT)
    assert sum(counts[part] for part in ("core", *count_lines.OUTSIDE_CORE)) == counts["package"]
