"""Pages refer to files and headings that exist, and the index lists every page, that of tasks those of each."""

import pathlib
import re

ROOT = pathlib.Path(__file__).parents[2]
PAGES = [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("examples/*.md"), *ROOT.glob("studies/**/*.md")]
LINK = re.compile(r"\]\(([^):#]*)(?:#([^)]*))?\)")
NAMED = re.compile(r"\b(?:docs|examples|tools|tests)/[a-z_\d/]+\.(?:md|json|py|sh)\b")


def anchors(page):
    """Return the anchors of a page's headings, as GitHub makes them."""
    text = re.sub(r"```.*?```", "", page.read_text(), flags=re.DOTALL)
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def missing_links(page):
    text = page.read_text()
    missing = [name for name in NAMED.findall(text) if not (ROOT / name).exists()]
    for link, anchor in LINK.findall(text):
        target = page.parent / link if link else page
        if not target.exists() or (anchor and anchor not in anchors(target)):
            missing.append(f"{link}#{anchor}")
    return missing


def test_links_of_pages():
    found = {str(page.relative_to(ROOT)): missing_links(page) for page in PAGES}
    assert {page: missing for page, missing in found.items() if missing} == {}


def test_the_index_lists_every_page():
    index, tasks = ROOT / "docs" / "README.md", ROOT / "docs" / "tasks.md"
    links = [*LINK.findall(index.read_text()), *LINK.findall(tasks.read_text())]
    assert set(ROOT.glob("docs/*.md")) - {index} <= {(index.parent / link).resolve() for link, _ in links if link}


def test_pages_that_the_code_names():
    for path in [*ROOT.glob("arc_suite/**/*.py"), *ROOT.glob("tools/**/*.py")]:
        for name in re.findall(r"\bdocs/\w+\.md\b", path.read_text()):
            assert (ROOT / name).exists(), f"{path.relative_to(ROOT)}: {name}"
