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


def test_parts_make_up_the_package(tmp_path):
    for index, folder in enumerate(("tasks", *count_lines.OUTSIDE_CORE)):
        (tmp_path / "arc_suite" / folder).mkdir(parents=True)
        (tmp_path / "arc_suite" / folder / "lines.py").write_text("1\n" * 10**index)
    (tmp_path / "arc_suite" / "alone.py").write_text("1\n1\n")
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "test_lines.py").write_text(TEXT)
    counts = {"package": 11113, "core": 3, "importing": 10, "bodies": 100, "learning": 1000, "animation": 10000}
    assert count_lines.counts(tmp_path) == counts | {"tests": 6}
