"""Handlers of what visitors do, in its order."""

from collections.abc import Callable, Coroutine
from typing import Any


def in_order(handle: Callable[[Any], object]) -> Callable[[Any], Coroutine[Any, Any, None]]:
    """Return an asynchronous handler of viser's events, for a handler that is quick.

    Viser runs asynchronous handlers one after the other. It runs others in threads, in any order, so that of two quick
    presses both may find the value of the second.

    Args:
        handle: takes the event of viser.
    """

    async def handle_event(event: Any) -> None:
        handle(event)

    return handle_event
