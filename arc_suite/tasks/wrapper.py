"""A task around another one: a base class that forwards everything that it does not change."""

import dataclasses
from collections.abc import Callable
from typing import Any

from arc_suite.tasks.contract import Observed, Task


def _forwarded(name: str) -> Callable:
    """Return a method that gives the other task its own memory."""

    def method(self, memory, *arguments):
        return getattr(self.task, name)(memory.task, *arguments)

    method.__name__, method.__doc__ = name, getattr(Task, name).__doc__
    return method


@dataclasses.dataclass(frozen=True, eq=False)
class Wrapper(Observed):
    """A task around another one, whose memory has the other's as `task`.

    Attributes and methods that a subclass does not define are the other task's, and so are those of its class that
    the contract does not know. What changes the memory, `start`, `begin`, `before` and `after`, is up to a subclass.

    Attributes:
        task: the other.
    """

    task: Task

    phase, clear_spawn, terms, observe, ended = map(_forwarded, ("phase", "clear_spawn", "terms", "observe", "ended"))
    leg_phases, progress, resampled = map(_forwarded, ("leg_phases", "progress", "resampled"))
    markers, failed_legs, stream_state = map(_forwarded, ("markers", "failed_legs", "stream_state"))
    privileged = _forwarded("privileged")

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name == "task":  # also before a copy or a pickle has its fields
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        return getattr(self.task, name)

    @property
    def unwrapped(self) -> Task:
        """The innermost task."""
        return self.task.unwrapped

    def with_command(self, memory, name: str, value) -> Any:
        """Return the memory with a live command of the other task."""
        return memory._replace(task=self.task.with_command(memory.task, name, value))


Task.register(Wrapper)
