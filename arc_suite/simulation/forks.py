"""Forks of the process: objects that wait for threads are refused in the child.

A forked child has a copy of its parent's memory and none of its threads. Objects that wait for those
threads, MuJoCo's batches and OpenGL's drivers, would hang the child in use and even in destruction.
Their owner remembers `count` and compares it before use.
"""

import ctypes
import os
import weakref

count = 0  # forks between the first process and this one

_threaded = weakref.WeakSet()


class ForkError(RuntimeError):
    """An object from before a fork was used in the child process."""


def at_fork(**handlers) -> None:
    """Register handlers as `os.register_at_fork` does; Windows has no forks."""
    if hasattr(os, "register_at_fork"):
        os.register_at_fork(**handlers)


def refuse(what: str):
    """Raise the ForkError of something whose remembered `count` is not the present one."""
    raise ForkError(
        f"this {what} was made before a fork and cannot be used in the child process: "
        "make it after the fork, or start processes with multiprocessing's spawn"
    )


def keep(threaded) -> None:
    """Keep an object in forked children, where its destructor would wait for its threads."""
    _threaded.add(threaded)


def _after_fork() -> None:
    global count
    count += 1
    for thing in _threaded:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(thing))  # not even the interpreter's end destroys it


at_fork(after_in_child=_after_fork)
