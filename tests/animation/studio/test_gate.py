"""The gate of the studio, by real requests and websockets: what foreign pages and hostile visitors get."""

import socket
import threading
import time
import urllib.error
import urllib.request

import pytest

from arc_suite.animation.studio.session import Session
from arc_suite.animation.studio.sketch import Sketch

viser = pytest.importorskip("viser", reason="no viser here: make check-studio")
import msgspec  # noqa: E402
from websockets.exceptions import InvalidStatus  # noqa: E402
from websockets.sync.client import connect  # noqa: E402

from arc_suite.animation.studio import gate  # noqa: E402
from arc_suite.animation.studio import page as pages  # noqa: E402

_PATIENCE = 60.0  # s


# With its first camera, viser takes a browser for a visitor.
CAMERA = {
    "type": "ViewerCameraMessage",
    **{"wxyz": (1.0, 0.0, 0.0, 0.0), "position": (1.0, 1.0, 1.0), "look_at": (0.0, 0.0, 0.0)},
    **{"up_direction": (0.0, 0.0, 1.0), "fov": 1.0, "near": 0.1, "far": 100.0, "image_height": 9, "image_width": 9},
}


def until(condition):
    end = time.monotonic() + _PATIENCE
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def update(widget, **updates):
    return {"type": "GuiUpdateMessage", "uuid": widget._impl.uuid, "updates": updates}


class Studio:
    """A session with its page, without a browser."""

    def __init__(self):
        self.session = Session(Sketch(source="tick", task="steer"))
        self.server = gate.Server("127.0.0.1", 8280, verbose=False)
        self.page = pages.Page(self.server, self.session)
        self.thread = threading.Thread(target=self.session.run, args=(self.page.show,))
        self.thread.start()
        self.host = f"127.0.0.1:{self.server.get_port()}"

    def connect(self, query=None, name=None, **headers):
        """Open a websocket as a browser does, under a name that the browser's user sees as the server's."""
        query = f"/?token={self.server.token}" if query is None else query
        versions = [f"viser-v{viser.__version__}"]
        there = socket.create_connection(("127.0.0.1", self.server.get_port()))
        address = f"ws://{name or self.host}{query}"
        return connect(address, sock=there, subprotocols=versions, additional_headers=headers, max_size=None)

    def send(self, *sent):
        """Send messages of a visitor, and wait until they are handled: messages are in their order."""
        marker = self.page._widgets["by_hand"]
        after = not marker.value
        with self.connect(Origin=f"http://{self.host}") as opened:
            opened.send(msgspec.msgpack.encode(CAMERA))
            until(self.server.get_clients)
            for message in (*sent, update(marker, value=after)):
                opened.send(msgspec.msgpack.encode(message))
            until(lambda: marker.value == after)
        until(lambda: not self.server.get_clients())

    def update(self, widget, **updates):
        """Send a visitor's update of a widget."""
        self.send(update(widget, **updates))

    def close(self):
        self.session.close()
        self.thread.join()
        self.server.stop()


@pytest.fixture(scope="module")
def studio():
    made = Studio()
    yield made
    made.close()


def status(studio, path, **headers):
    request = urllib.request.Request(f"http://{studio.host}{path}", headers=headers)
    try:
        with urllib.request.urlopen(request) as answer:
            return answer.status, answer.headers.get("Set-Cookie")
    except urllib.error.HTTPError as error:
        assert error.read() == b"refused: open the address that the studio has printed\n"
        return error.code, None


def test_the_printed_address_opens_the_page_and_leaves_a_cookie(studio):
    code, cookie = status(studio, f"/?token={studio.server.token}")
    assert code == 200
    name_and_token, *flags = cookie.split("; ")
    assert name_and_token.endswith(f"={studio.server.token}")
    assert flags == ["Path=/", "HttpOnly", "SameSite=Strict"]
    assert status(studio, "/", Cookie=name_and_token)[0] == 200
    with studio.connect("/", Cookie=name_and_token, Origin=f"http://{studio.host}") as opened:
        assert opened.recv()


@pytest.mark.parametrize("path", ["/", "/?token=", "/?token=x", "/?tokens=", "/index.html"])
def test_without_the_token_nothing_is_served(studio, path):
    assert status(studio, path)[0] == 403
    with pytest.raises(InvalidStatus, match="403"):
        studio.connect(path)


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://example.com"},
        {"Origin": "null"},
        {"Origin": "http://127.0.0.1:1"},
        {"Origin": "http://[bad"},
        {"name": "example.com"},  # which was made to point here
        {"name": "example.com", "Origin": "http://example.com"},
        {"Cookie": "a=b; [c]=d", "Origin": "https://example.com"},
        {"Host": "localhost"},  # a second one
    ],
)
def test_foreign_origins_and_hosts_are_refused_even_with_the_token(studio, headers):
    with pytest.raises(InvalidStatus, match="403"):
        studio.connect(**headers)


def test_what_a_widget_offers_is_taken(studio):
    widgets = studio.page._widgets
    studio.update(widgets["task"], value="walk")
    assert widgets["task"].value == "walk"
    studio.update(widgets["speed"], value=2)
    assert widgets["speed"].value == 2.0


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(("policy", value) for value in ("file.py:make", "os:system", ["cpg"])),
        *(("task", "antigravity:walk"), ("source", "antigravity:queen"), ("ground", "antigravity:flat")),
        *(("speed", value) for value in (2.0001, float("nan"), True, "1")),
        *(("seed", -1), ("seed", 2**32), ("kicks", 10**400)),
        *(("settings", value) for value in (" " * (gate.MAX_TEXT_LENGTH + 1), 5)),
    ],
)
def test_no_other_value_is_taken(studio, name, value):
    widget = studio.page._widgets[name]
    widget = getattr(widget, "buttons", widget)  # of pictures
    before = widget.value
    try:
        studio.update(widget, value=value)
    except OverflowError:  # the wire has no such integer
        return
    assert widget.value == before and type(widget.value) is type(before)


def test_a_message_changes_nothing_of_a_widget_but_its_value(studio):
    widget = studio.page._widgets["policy"]
    calls = list(widget._impl.update_cb)
    studio.update(widget, update_cb=[])
    studio.update(widget, value="zero", update_cb=[])
    studio.update(widget, options=["file.py:make"])
    assert widget._impl.update_cb == calls and "file.py:make" not in widget.options


def test_settings_of_a_visitor_import_nothing(studio):
    studio.update(studio.page._widgets["settings"], value='{"arena": "antigravity:flat"}')
    until(lambda: "files import nothing; import 'antigravity' first" in studio.session.error)
    studio.update(studio.page._widgets["settings"], value="{}")


def test_presses_are_taken_in_their_order_also_when_they_follow_each_other_at_once(studio, monkeypatch):
    (buttons,) = (
        handle
        for handle in studio.server.gui._gui_input_handle_from_uuid.values()
        if isinstance(handle, viser.GuiButtonGroupHandle) and "Undo" in handle.options
    )
    taken = []
    for name in buttons.options:
        monkeypatch.setattr(studio.page._editor, name.lower(), lambda name=name: taken.append(name))
    sent = [buttons.options[index % 5 % 3] for index in range(60)]
    studio.send(*(update(buttons, value=name) for name in sent))
    until(lambda: len(taken) == len(sent))
    assert taken == sent


def test_an_upload_that_is_too_large_is_not_begun(studio):
    (upload,) = (
        handle
        for handle in studio.server.gui._gui_input_handle_from_uuid.values()
        if isinstance(handle, viser.GuiUploadButtonHandle)
    )
    start = {"type": "FileTransferStartUpload", "source_component_uuid": upload._impl.uuid}
    start |= {"filename": "a.json", "mime_type": "application/json"}
    sizes = ((1 << 40, 1), (10, 1 << 20), (-1, -1))
    for size, parts in sizes:
        studio.send(start | {"transfer_uuid": f"{size}", "size_bytes": size, "part_count": parts})
    assert studio.server.gui._current_file_upload_states == {}


def test_every_widget_of_the_page_has_a_rule(studio):
    handles = studio.server.gui._gui_input_handle_from_uuid.values()
    without = {type(handle) for handle in handles if not isinstance(handle, tuple(gate._IS_VALID_VALUE))}
    assert without == {viser.GuiUploadButtonHandle}  # whose files come by other messages
