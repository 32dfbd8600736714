"""The gate of the studio: who may open the page, and what a visitor may send.

A visitor needs a token and a name of this machine, and may send values that the widgets offer. A browser sends requests
to this machine for any page that it shows, so without the gate a foreign page could control the studio.
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

MAX_TEXT_LENGTH = 10_000  # characters of a text field
_MAX_UPLOAD_PARTS = 16  # a browser sends half a megabyte in each

_COOKIE_NAME = "arc_suite_studio"  # before a part of the token: all ports of a machine share their cookies
_TOKEN_PART_LENGTH = 8  # characters of the token in the name of the cookie
_ALL_ADDRESSES = ("0.0.0.0", "::", "")  # hosts that listen on all addresses; requests may name any of them


class Server(viser.ViserServer):
    """A server that admits visitors with a token, and accepts no value that its widgets do not offer.

    Attributes:
        token: without which a visitor is refused.
    """

    def __init__(self, host: str, port: int, **options):
        """Listen; see `viser.ViserServer`."""
        self.token = secrets.token_urlsafe(16)
        serve = websockets.serve

        def serve_with_gate(*args, process_request, **kwargs):
            return serve(*args, process_request=_admit_and_process(process_request, host, self.token), **kwargs)

        # Viser has no hook for requests, but its server looks this function up while it starts, in this call.
        websockets.serve = serve_with_gate  # type: ignore[assignment,misc]
        try:
            super().__init__(host=host, port=port, **options)
        finally:
            websockets.serve = serve  # type: ignore[misc]
        self._websock_server.get_message_buffer().message_event = _LoopEvent()
        self._check_messages(messages.GuiUpdateMessage, self.gui._handle_gui_updates, self._is_offered)
        self._check_messages(
            messages.FileTransferStartUpload, self.gui._handle_file_transfer_start, _is_upload_of_right_size
        )
        self._check_messages(messages.FileTransferPart, self.gui._handle_file_transfer_part, _is_part_of_right_size)

    def request_share_url(self, verbose: bool = True) -> None:
        """Do nothing: the page stays on this machine, whatever a visitor requests."""

    def _check_messages(self, message_type: type, handler: Callable, is_acceptable: Callable[[Any], bool]) -> None:
        """Pass messages of a type on to viser's handler only if they are acceptable."""
        self._websock_server.unregister_handler(message_type, handler)
        self._websock_server.register_handler(message_type, _handle_if(is_acceptable, handler))

    def _is_offered(self, message: messages.GuiUpdateMessage) -> bool:
        """Return whether a message changes just the value of a widget, to one that the widget offers."""
        handle = self.gui._gui_input_handle_from_uuid.get(message.uuid)
        return list(message.updates) == ["value"] and offers(handle, message.updates["value"])


class _LoopEvent(asyncio.Event):
    """An event that only the thread of an event loop sets.

    Viser sets its event in the thread that sends a message, and asks the loop to set it soon after. The second call
    suffices. The first call, while the loop runs, would break the loop and end the walk.
    """

    def set(self) -> None:
        """Set the event, if this is the thread of a loop."""
        with contextlib.suppress(RuntimeError):
            asyncio.get_running_loop()
            super().set()


def offers(handle: Any, value: Any) -> bool:
    """Return whether a widget offers a value: an option of a list, a number in a range, or a text of bounded length.

    Args:
        handle: handle of viser.
        value: value of any type, as a visitor sends it.
    """
    for handle_type, is_valid in _IS_VALID_VALUE.items():
        if isinstance(handle, handle_type):
            return is_valid(handle, value)
    return False


def _is_option(handle, value) -> bool:
    return isinstance(value, str) and value in handle.options


def _is_number_in_range(handle, value) -> bool:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and handle.min <= value <= handle.max


def _is_text(handle, value) -> bool:
    return isinstance(value, str) and len(value) <= MAX_TEXT_LENGTH


def _is_boolean(handle, value) -> bool:
    return isinstance(value, bool)


_IS_VALID_VALUE: dict[type, Callable[[Any, Any], bool]] = {
    viser.GuiDropdownHandle: _is_option,
    viser.GuiSliderHandle: _is_number_in_range,
    viser.GuiNumberHandle: _is_number_in_range,
    viser.GuiTextHandle: _is_text,
    viser.GuiCheckboxHandle: _is_boolean,
    viser.GuiButtonGroupHandle: _is_option,
    viser.GuiButtonHandle: _is_boolean,
}


def _is_upload_of_right_size(upload: messages.FileTransferStartUpload) -> bool:
    return 0 <= upload.size_bytes <= MAX_IMPORTED and 0 <= upload.part_count <= _MAX_UPLOAD_PARTS


def _is_part_of_right_size(part: messages.FileTransferPart) -> bool:
    return len(part.content) <= MAX_IMPORTED


def _handle_if(is_acceptable: Callable[[Any], bool], handler: Callable) -> Callable:
    """Return a handler of messages that passes acceptable ones on to another handler, and drops the rest."""

    async def handle_if_acceptable(client_id, message):
        if not is_acceptable(message):
            return
        result = handler(client_id, message)
        if result is not None:  # the handler is asynchronous
            await result

    return handle_if_acceptable


def _admit_and_process(process_request: Callable, host: str, token: str) -> Callable:
    """Return a function that passes admitted requests on to viser's `process_request`, and refuses the rest."""

    def refuse_or_process(connection: websockets.ServerConnection, request: Request) -> Response | None:
        if not admits(request, host, token):
            refusal = "refused: open the address that the studio has printed\n"
            return connection.respond(http.HTTPStatus.FORBIDDEN, refusal)
        response = cast("Response | None", process_request(connection, request))
        if response is not None:
            cookie = f"{_COOKIE_NAME}-{token[:_TOKEN_PART_LENGTH]}={token}"
            response.headers["Set-Cookie"] = f"{cookie}; Path=/; HttpOnly; SameSite=Strict"
        return response

    return refuse_or_process


def admits(request: Request, host: str, token: str) -> bool:
    """Return whether a request comes from a page of this server, under a name of this machine, with the token.

    Args:
        request: request of a browser.
        host: host that the server listens on.
        token: token that the address or the cookie must hold.
    """
    host_names = (host, "localhost", "127.0.0.1", "::1")
    try:
        requested_host = request.headers.get("Host", "")
        names_this_machine = host in _ALL_ADDRESSES or urlsplit(f"//{requested_host}").hostname in host_names
        origin = request.headers.get("Origin")  # the page that sends the request; None for an address that is typed
        comes_from_own_page = origin is None or urlsplit(origin).netloc == requested_host
        tokens = parse_qs(urlsplit(request.path).query).get("token", [])
        cookies = SimpleCookie(request.headers.get("Cookie", ""))
        tokens += [cookie.value for cookie in cookies.values()]
    except (ValueError, LookupError, CookieError):  # a malformed address or cookie, or a header that comes twice
        return False
    has_token = any(secrets.compare_digest(candidate.encode(), token.encode()) for candidate in tokens)
    return names_this_machine and comes_from_own_page and has_token
