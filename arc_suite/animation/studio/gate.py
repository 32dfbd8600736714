"""Who may open the page, and what a visitor may send: a token, this machine's own names, and values that widgets offer.

A browser sends requests to this machine for every page that it shows, so a foreign page could speak to the studio.
"""

import asyncio
import contextlib
import http
import secrets
from collections.abc import Callable
from http.cookies import CookieError, SimpleCookie
from typing import Any, cast
from urllib.parse import parse_qs, urlsplit

import viser
from viser import _messages as messages
from websockets.asyncio import server as websockets
from websockets.http11 import Request, Response

from arc_suite.robots.spec_files import MAX_IMPORTED

LONGEST_TEXT = 10_000  # characters of a text field
_MOST_PARTS = 16  # of an upload; a browser sends half a megabyte in each

_COOKIE = "arc_suite_studio"  # with a part of the token: cookies of all ports of a machine are sent to each
_EVERYWHERE = ("0.0.0.0", "::", "")  # a host that listens on all addresses, whatever their names


class Server(viser.ViserServer):
    """A server that admits visitors with a token, and takes no value that its widgets do not offer.

    Attributes:
        token: without which a visitor is refused.
    """

    def __init__(self, host: str, port: int, **options):
        """Listen; see `viser.ViserServer`."""
        self.token = secrets.token_urlsafe(16)
        serve = websockets.serve

        def guarded(*args, process_request, **kwargs):
            return serve(*args, process_request=_admitting(process_request, host, self.token), **kwargs)

        # viser has no hook for requests; its server starts in this call, and looks the function up then.
        websockets.serve = guarded  # type: ignore[assignment,misc]
        try:
            super().__init__(host=host, port=port, **options)
        finally:
            websockets.serve = serve  # type: ignore[misc]
        connection, gui = self._websock_server, self.gui
        connection.get_message_buffer().message_event = _LoopEvent()
        for kind, handler, taken in (
            (messages.GuiUpdateMessage, gui._handle_gui_updates, self._offers),
            (messages.FileTransferStartUpload, gui._handle_file_transfer_start, _fits),
            (messages.FileTransferPart, gui._handle_file_transfer_part, lambda part: len(part.content) <= MAX_IMPORTED),
        ):
            connection.unregister_handler(kind, handler)
            connection.register_handler(kind, _checking(handler, taken))

    def request_share_url(self, verbose: bool = True) -> None:
        """Do nothing: the page stays on this machine, whatever a visitor requests."""

    def _offers(self, message: messages.GuiUpdateMessage) -> bool:
        """Return whether a widget offers the value of a message, which changes nothing else of it."""
        handle = self.gui._gui_input_handle_from_uuid.get(message.uuid)
        return list(message.updates) == ["value"] and offers(handle, message.updates["value"])


class _LoopEvent(asyncio.Event):
    """An event that other threads do not set: in the midst of a loop's turn that breaks, and ends the walk.

    Viser sets it at once in the thread that sends, and has the loop set it soon after, which suffices.
    """

    def set(self) -> None:
        """Set the event, if this is the thread of a loop."""
        with contextlib.suppress(RuntimeError):
            asyncio.get_running_loop()
            super().set()


def offers(handle: Any, value: Any) -> bool:
    """Return whether a widget offers a value: an option of its list, a number that it spans, a text of bounded length.

    Args:
        handle: of viser.
        value: of any type, as a visitor sends it.
    """
    for kind, holds in _OFFERS.items():
        if isinstance(handle, kind):
            return holds(handle, value)
    return False


def _fits(upload: messages.FileTransferStartUpload) -> bool:
    return 0 <= upload.size_bytes <= MAX_IMPORTED and 0 <= upload.part_count <= _MOST_PARTS


def _spans(handle, value) -> bool:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and handle.min <= value <= handle.max


_OFFERS: dict[type, Callable[[Any, Any], bool]] = {
    viser.GuiDropdownHandle: lambda handle, value: isinstance(value, str) and value in handle.options,
    viser.GuiSliderHandle: _spans,
    viser.GuiNumberHandle: _spans,
    viser.GuiTextHandle: lambda handle, value: isinstance(value, str) and len(value) <= LONGEST_TEXT,
    viser.GuiCheckboxHandle: lambda handle, value: isinstance(value, bool),
    viser.GuiButtonGroupHandle: lambda handle, value: isinstance(value, str) and value in handle.options,
    viser.GuiButtonHandle: lambda handle, value: isinstance(value, bool),
}


def _checking(handler: Callable, taken: Callable[[Any], bool]) -> Callable:
    """Return a handler of messages that passes on those that are taken."""

    async def checked(client_id, message):
        if taken(message) and (answer := handler(client_id, message)) is not None:
            await answer

    return checked


def _admitting(process_request: Callable, host: str, token: str) -> Callable:
    """Return viser's answer to a request, for requests that are admitted."""

    def answered(connection: websockets.ServerConnection, request: Request) -> Response | None:
        if not admits(request, host, token):
            line = "refused: open the address that the studio has printed\n"
            return connection.respond(http.HTTPStatus.FORBIDDEN, line)
        response = cast("Response | None", process_request(connection, request))
        if response is not None:
            response.headers["Set-Cookie"] = f"{_COOKIE}-{token[:8]}={token}; Path=/; HttpOnly; SameSite=Strict"
        return response

    return answered


def admits(request: Request, host: str, token: str) -> bool:
    """Return whether a request comes from a page of this server, under a name of it, with the token.

    Args:
        request: of a browser.
        host: that the server listens on.
        token: that the address or the cookie must hold.
    """
    names = (host, "localhost", "127.0.0.1", "::1")
    try:
        own, origin = request.headers.get("Host", ""), request.headers.get("Origin")
        named = host in _EVERYWHERE or urlsplit(f"//{own}").hostname in names
        at_home = origin is None or urlsplit(origin).netloc == own
        given = parse_qs(urlsplit(request.path).query).get("token", [])
        given += [cookie.value for cookie in SimpleCookie(request.headers.get("Cookie", "")).values()]
    except (ValueError, LookupError, CookieError):  # an address or a cookie that is none, or a header twice
        return False
    return named and at_home and any(secrets.compare_digest(each.encode(), token.encode()) for each in given)
