"""The site that `make docs` has built: its links lead somewhere, and a creature walks on its front page."""

import html.parser
import urllib.parse

import pytest
import tabs
from website import players
from website.returns import ROOT
from website.sources import BELOW

SITE = ROOT / "out" / "docs" / "html"
PAGES = [*ROOT.glob("docs/*.md"), ROOT / "README.md"]


def of_these_pages():
    """Whether the site is there, and not one of earlier pages."""
    index = SITE / "index.html"
    return index.is_file() and index.stat().st_mtime > max(page.stat().st_mtime for page in PAGES)


pytestmark = pytest.mark.skipif(not of_these_pages(), reason="no site of these pages here: make docs")

PLAYERS = (players.GAME, players.GALLERY, *players.film_pages().values())
FIRST_STEPS = ROOT / "docs" / "first_steps.md"


class Page(html.parser.HTMLParser):
    """What a page refers to, and the places in it that others may refer to."""

    def __init__(self, path):
        super().__init__()
        self.links, self.places = set(), set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.links |= {found[name] for name in ("href", "src") if found.get(name)}
        self.places |= {found[name] for name in ("id", "name") if found.get(name)}


@pytest.fixture(scope="module")
def pages():
    """Pages of Sphinx by path; those in which creatures walk are of one piece."""
    return {path: Page(path) for path in sorted(SITE.rglob("*.html")) if path.name not in PLAYERS}


def test_every_link_leads_somewhere(pages):
    missing = []
    for path, page in pages.items():
        for link in page.links:
            parts = urllib.parse.urlsplit(link)
            if parts.scheme or link.startswith("//"):
                continue
            target = (path.parent / urllib.parse.unquote(parts.path)).resolve() if parts.path else path
            there = target.is_file() and (not parts.fragment or target not in pages or target == path)
            anchored = target in pages and parts.fragment in pages[target].places | {""}
            if not (there or anchored):
                missing.append(f"{path.relative_to(SITE)}: {link}")
    assert missing == []


def test_every_page_is_there():
    names = {f"docs/{path.stem}" for path in (ROOT / "docs").glob("*.md")} - {"docs/README"}
    names |= {f"docs/{name}" for page, below in BELOW.items() if page.startswith("docs/") for name in below}
    assert [name for name in sorted(names) if not (SITE / f"{name}.html").is_file()] == []


def test_a_newcomer_needs_two_clicks(pages):
    """The front page leads to the first steps, each of which is a section there."""
    assert any(link.startswith("docs/first_steps.html") for link in pages[SITE / "index.html"].links)
    steps = pages[SITE / "docs" / "first_steps.html"]
    sections = [line for line in FIRST_STEPS.read_text(encoding="utf-8").splitlines() if line.startswith("## ")]
    assert len(sections) >= 5
    assert len([link for link in steps.links if link.startswith("#") and link[1:] in steps.places]) >= len(sections)


# What a newcomer searches, and the page that explains it.
SOUGHT = {
    "randomization": "docs/modifiers.html",
    "friction": "docs/modifiers.html",
    "curriculum": "docs/ground.html",
    "pretrained": "docs/agents.html",
    "license": "index.html",
    "URDF": "docs/imported.html",
}


@pytest.mark.parametrize(("word", "page"), SOUGHT.items())
def test_a_search_finds_the_page_that_explains_it_first(browser, word, page):
    tab = tabs.new(browser)
    tab.goto(f"{(SITE / 'search.html').as_uri()}?q={word}")
    link = tab.wait_for_selector("ul.search li a").get_attribute("href")
    assert link.partition("?")[0].partition("#")[0] == page


@pytest.mark.skipif(not (SITE / "play.html").is_file(), reason="no page to play in: make web, then make docs")
@pytest.mark.parametrize(("width", "height"), [(390, 844), (1440, 900)])
def test_a_creature_walks_on_the_front_page(browser, width, height):
    with tabs.opened(browser, SITE / "index.html", "document.querySelector('iframe')", width, height) as (tab, _):
        (frame,) = (frame for frame in tab.frames if "play.html" in frame.url)
        frame.wait_for_function("window.play")
        where = "play.state.play.simulation.data.qpos[0]"
        start = frame.evaluate(where)
        frame.wait_for_function(f"Math.abs({where} - {start}) > 0.1")
        frame.evaluate("play.pause(false)")
        assert tab.evaluate("document.documentElement.scrollWidth") == width
        assert frame.evaluate("play.inputs.command") == [0.8, 0, 0.2]
        frame.focus("#restart")
        tab.keyboard.down("ArrowUp")
        assert frame.evaluate("play.inputs.command") == [1, 0, 0]
        tab.keyboard.up("ArrowUp")
        assert frame.evaluate("play.inputs.command") == [0, 0, 0]  # it walks on its own until somebody plays
