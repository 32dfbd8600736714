"""Files that visitors open: one that makes no creature changes nothing, and the visitor reads its name and why."""

from types import SimpleNamespace

import pytest

from arc_suite.animation.studio.session import Session
from arc_suite.animation.studio.sketch import FILE, Sketch
from arc_suite.bodies import generator
from arc_suite.robots.spec_files import body_to_json

viser = pytest.importorskip("viser", reason="no viser here: make check-studio")
from arc_suite.animation.studio import page as pages  # noqa: E402


@pytest.fixture(scope="module")
def page():
    server = viser.ViserServer(port=8195, verbose=False)
    yield pages.Page(server, Session(Sketch(legs=4, links=2)))
    server.stop()


def opened(page, content, name="wrong.json"):
    """What the visitor reads who opens a file."""
    told = []
    client = SimpleNamespace(add_notification=lambda title, body, color: told.append(body))
    value = SimpleNamespace(name=name, content=content)
    page._open_upload(SimpleNamespace(target=SimpleNamespace(value=value), client=client))
    return told


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b'{"legs": 8}', "name: missing; a Body needs it"),
        (b"\x89PNG\r\n", "expected a body in JSON"),
        (b'{"sketch": {"legs": 500}, "command": {}}', "legs: expected an integer from 4 to 12, got 500"),
        (b'{"sketch": {"source": "file", "file": "{}"}, "command": {}}', "name: missing; a Body needs it"),
        (b'{"sketch": {"settings": "{"}, "command": {}}', "settings: expected a JSON object"),
        (b'{"sketch": {"policy": "file.py:make"}, "command": {}}', "unknown policy 'file.py:make'"),
    ],
    ids=["a spec", "a picture", "a design", "a design of a spec", "a design with settings", "a design with a policy"],
)
def test_a_file_that_makes_no_creature_changes_nothing(page, content, reason):
    before = page._editor.state
    (told,) = opened(page, content)
    assert told.startswith(f"wrong.json: {reason}") and "\n" not in told
    assert page._editor.state == before and not page._session.error


def test_a_spec_is_opened(page):
    assert opened(page, body_to_json(generator.generate(6, 2)).encode()) == []
    assert page._editor.state.sketch.source == FILE


def test_a_file_of_another_kind_is_named_by_its_extension(page):
    reason = "brute.png: expected a body, .json, .xml or .urdf; a .png holds a picture or a film"
    assert opened(page, b"\x89PNG\r\n", "brute.png") == [reason]
