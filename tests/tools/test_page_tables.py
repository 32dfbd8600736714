"""tools/page_tables.py: pages hold the tables of committed studies."""

import page_tables
import pytest
from refusals import refused

from studies import pages


@pytest.mark.parametrize(("page", "name"), page_tables.TABLES)
def test_a_page_holds_its_table(page, name):
    table = page_tables.TABLES[page, name]()
    page_text = (page_tables.DOCS / f"{page}.md").read_text()
    assert f"<!-- {name} -->\n\n{table}\n\n<!-- end -->" in page_text


def test_our_returns_stand_next_to_the_papers():
    table = page_tables.returns_next_to_the_papers()
    assert "| speq_o2o | 2977 (short phases) / 1410 | not run / 2850 | not run / 2310 |" in table
    assert "| 2242 (at 90,000) / 1780 |" in table


def test_a_table_replaces_what_stands_between_the_lines(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# Mine\n\n<!-- table -->\nrows\n<!-- end -->\n\n<!-- more -->\n<!-- end -->\n")
    pages.table_writer(page)("| a |")
    pages.table_writer(page, "more")("| b |")
    tables = "<!-- table -->\n\n| a |\n\n<!-- end -->\n\n<!-- more -->\n\n| b |\n\n<!-- end -->\n"
    assert page.read_text() == f"# Mine\n\n{tables}"


def test_pages_without_the_lines_are_refused(tmp_path):
    page = tmp_path / "page.md"
    with refused(f"cannot read {page}: no such file or directory", OSError):
        pages.table_writer(page)
    page.write_text("text")
    with refused(f"{page}: expected the lines <!-- table --> and <!-- end -->, got none"):
        pages.table_writer(page)
