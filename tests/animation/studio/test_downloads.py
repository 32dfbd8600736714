"""Files of the studio go to the visitor who asks for them, and to nobody if the visitor has left meanwhile."""

import types

import pytest

from arc_suite.animation.clips.swaying import CHARACTERS
from arc_suite.animation.studio.session import Session
from arc_suite.animation.studio.sketch import Sketch

viser = pytest.importorskip("viser", reason="no viser here: make check-studio")
from arc_suite.animation.studio import downloads, saving  # noqa: E402
from arc_suite.animation.studio.editor import Editor  # noqa: E402


class Visitor:
    """A client of the page, which notes what it gets."""

    client_id = 7

    def __init__(self):
        self.notes = []
        self.files = []

    def add_notification(self, title, body, **options):
        self.notes.append(title)
        return types.SimpleNamespace(remove=lambda: self.notes.append("removed"))

    def send_file_download(self, name, content, **options):
        self.files.append(content)


def refuse(*arguments, **options):
    raise ValueError("no file")


@pytest.mark.parametrize("stays", [True, False])
def test_a_file_is_for_a_visitor_who_is_here(stays, monkeypatch):
    server = viser.ViserServer(host="127.0.0.1", port=8190, verbose=False)
    session = Session(Sketch(legs=4, links=2))
    try:
        monkeypatch.setattr(server, "get_clients", lambda: {7: visitor} if stays else {})
        page_part = downloads.Downloads(server, session, Editor(session), lambda: None)
        visitor = Visitor()
        event = types.SimpleNamespace(client=visitor)
        page_part._save(saving.FILES[0]._replace(make=lambda *_, **__: b"content"), event)
        page_part._save(saving.FILES[0]._replace(make=refuse), event)
    finally:
        session.close()
        server.stop()
    assert visitor.files == ([b"content"] if stays else [])
    assert visitor.notes.count("removed") == 2
    assert any(note.startswith("No ") for note in visitor.notes) == stays


def test_clips_take_a_character_in_place_of_the_slider(monkeypatch):
    server = viser.ViserServer(host="127.0.0.1", port=8191, verbose=False)
    session = Session(Sketch(legs=4, links=2))
    weights = []
    monkeypatch.setattr(saving.clips, "clips", lambda *given, weight: weights.append(weight) or [])
    try:
        page_part = downloads.Downloads(server, session, Editor(session), lambda: None)
        (file,) = (file for file in saving.FILES if file.takes_weight)
        page_part._weight.value = 0.5
        for name in ("usual", "heavy", "nervous", "old"):
            page_part._character.value = name
            page_part._choose_character(types.SimpleNamespace(target=page_part._character))
            assert page_part._weight.disabled == (name != "usual")
            page_part._save(file, types.SimpleNamespace(client=Visitor()))
    finally:
        session.close()
        server.stop()
    assert page_part._character.options == ("usual", *CHARACTERS)
    assert weights == [0.5, *CHARACTERS]
