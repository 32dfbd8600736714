"""A task around another one: a base class that forwards everything that it does not change."""

import dataclasses
import functools
import inspect
from collections.abc import Callable
from typing import Any

from arc_suite.tasks.contract import Observed, Task

_CHANGING = ("begin", "before", "after", "with_command")  # methods that return a memory, and so are up to a subclass


def _forwarding(name: str) -> Callable:
    """Return a method that gives the other task its own memory."""

    def method(self, memory, *arguments):
        return getattr(self.task, name)(memory.task, *arguments)

    method.__name__, method.__doc__ = name, getattr(Task, name).__doc__
    return method


@functools.cache
def _takes_memory(function: Callable) -> bool:
    """Return whether the first argument of a method is a memory."""
    return list(inspect.signature(function).parameters)[1:2] == ["memory"]


@dataclasses.dataclass(frozen=True, eq=False)
class Wrapper(Observed):
    """A task around another one, whose memory has the other's as `task`.

    Attributes and methods that a subclass does not define are the other task's, and so are those of its class that
    the contract does not know. Methods whose first argument is `memory` are given the other's own. What changes the
    memory, `start`, `begin`, `before` and `after`, is up to a subclass.

    Attributes:
        task: the other.
    """

    task: Task

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name == "task":  # also before a copy or a pickle has its fields
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        value = getattr(self.task, name)
        if inspect.ismethod(value) and _takes_memory(value.__func__):
            return lambda memory, *arguments: value(memory.task, *arguments)
        return value

    @property
    def unwrapped(self) -> Task:
        """The innermost task."""
        return self.task.unwrapped

    def with_command(self, memory, name: str, value) -> Any:
        """Return the memory with a live command of the other task."""
        return memory._replace(task=self.task.with_command(memory.task, name, value))


# Methods of the contract, which steps call, are looked up once.
for _name, _member in vars(Task).items():
    if inspect.isfunction(_member) and _takes_memory(_member) and _name not in _CHANGING:
        setattr(Wrapper, _name, _forwarding(_name))

Task.register(Wrapper)
