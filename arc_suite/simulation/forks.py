"""Forks: how what was made before one refuses to be used after it, and why that costs nothing.

A forked child has a copy of its parent's memory and none of its threads. What waits for those
threads, MuJoCo's batches and OpenGL's drivers, would hang the child where it is used and even where
it is destroyed. Whoever makes such things remembers `count` and compares it before use.
"""

import ctypes
import os
import weakref

count = 0  # forks between the first process and this one

_threaded = weakref.WeakSet()


class ForkError(RuntimeError):
    """Used in a forked child, but made before the fork."""


def refuse(what: str):
    """Raises the ForkError of something whose remembered `count` is not the present one."""
    raise ForkError(
        f"this {what} was made before a fork and cannot be used in the child process: "
        "make it after the fork, or start processes with multiprocessing's spawn"
    )


def keep(threaded) -> None:
    """Never destroys an object in a forked child, where its destructor would wait for its threads."""
    _threaded.add(threaded)


def immortalise(thing) -> None:
    """Never destroys an object, not even when the interpreter ends."""
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(thing))


def _after_fork() -> None:
    global count
    count += 1
    for thing in _threaded:
        immortalise(thing)


os.register_at_fork(after_in_child=_after_fork)
