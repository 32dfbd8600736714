"""Ctrl-C and SIGTERM, which end programs with one line; the standard library alone is imported here.

While a program works, they raise exceptions, so that it can complete or delete its files. Before and after, during
imports and at the exit, nothing is left to be done, and they end the process at once.
"""

import atexit
import contextlib
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from typing import NoReturn

INTERRUPTED = 130  # exit status of a program that Ctrl-C has ended, as shells count it
TERMINATED = 143  # exit status of a program that SIGTERM has ended, as shells count it

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_REPEAT_DELAY = 0.1  # s


class Terminated(KeyboardInterrupt):
    """SIGTERM has come, which clusters send before they take a machine away."""


def exit_at_once(name: str = "arc-suite") -> None:
    """From now on, let Ctrl-C and SIGTERM print one line and end the process at once, with 130 or 143.

    Args:
        name: name of the program, with which the line begins.
    """

    def end(number, _):
        os.write(2, f"{name}: interrupted\n".encode())
        os._exit(_status(number))

    _handle(end)


@contextlib.contextmanager
def interruptible(name: str, statuses: list[int]) -> Iterator[None]:
    """Let Ctrl-C and SIGTERM raise exceptions in the block; `exit_at_once` holds when it ends.

    What calls Python may turn such an exception into another one, so the caller asks whether a signal came. Where the
    exception is lost, as in destructors, it comes again.

    Args:
        name: name of the program.
        statuses: to which each signal that comes appends its exit status.
    """
    previous_hook = sys.unraisablehook

    def interrupt(number, _):
        statuses.append(_status(number))
        raise Terminated if number == signal.SIGTERM else KeyboardInterrupt

    def repeat(unraisable):
        if isinstance(unraisable.exc_value, KeyboardInterrupt):
            threading.Timer(_REPEAT_DELAY, os.kill, (os.getpid(), statuses[-1] - 128)).start()
        else:
            previous_hook(unraisable)

    try:
        sys.unraisablehook = repeat
        _handle(interrupt)
        yield
    finally:
        exit_at_once(name)
        sys.unraisablehook = previous_hook


def leave(status: int) -> NoReturn:
    """End the process without the interpreter's own end, during which threads of XLA that still work would crash."""
    atexit._run_exitfuncs()
    os._exit(status)


def _handle(handler: Callable) -> None:
    """Set the handler of Ctrl-C and SIGTERM, except where the parent process has them ignored."""
    if threading.current_thread() is not threading.main_thread():
        return
    for number in _SIGNALS:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, handler)


def _status(number: int) -> int:
    return TERMINATED if number == signal.SIGTERM else INTERRUPTED
