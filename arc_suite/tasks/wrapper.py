"""A task that wraps another one: a base class that forwards everything that a subclass does not define."""

import dataclasses
import functools
import inspect
from collections.abc import Callable
from typing import Any

from arc_suite.tasks.contract import Observed, Task

# Methods that return a memory, which the subclass has to compose.
_RETURN_MEMORY = ("begin", "before", "after", "with_command")


def _make_forwarding_method(name: str) -> Callable:
    """Return a method that calls the method of the wrapped task with its memory."""

    def method(self, memory, *arguments):
        return getattr(self.task, name)(memory.task, *arguments)

    method.__name__ = name
    method.__doc__ = getattr(Task, name).__doc__
    return method


@functools.cache
def _takes_memory(function: Callable) -> bool:
    """Return whether the first argument of a method is a memory."""
    _, *parameters = inspect.signature(function).parameters  # without `self`
    return parameters[:1] == ["memory"]


@dataclasses.dataclass(frozen=True, eq=False)
class Wrapper(Observed):
    """A task that wraps another one. Its memory holds that of the wrapped task as `task`.

    Attributes and methods that a subclass does not define are those of the wrapped task, also those that the contract
    does not know. Methods whose first argument is `memory` are called with the memory of the wrapped task. A subclass
    defines `start`, `begin`, `before` and `after`, which return the memory.

    Attributes:
        task: the wrapped task.
    """

    task: Task

    def __getattr__(self, name: str) -> Any:
        # `copy` and `pickle` ask for attributes before the field `task` is set.
        if name.startswith("_") or name == "task":
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
        """Return the memory with a live command of the wrapped task."""
        return memory._replace(task=self.task.with_command(memory.task, name, value))


# Methods of the contract are defined once, as `__getattr__` would take time in each step.
for _name, _member in vars(Task).items():
    if inspect.isfunction(_member) and _takes_memory(_member) and _name not in _RETURN_MEMORY:
        setattr(Wrapper, _name, _make_forwarding_method(_name))

Task.register(Wrapper)  # type: ignore[type-abstract]
