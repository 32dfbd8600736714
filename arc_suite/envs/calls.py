"""Calls of an environment: one thread at a time, actions and live commands that fit, and commands of any thread."""

import functools
import threading
from typing import Any

import numpy as np

from arc_suite import checks
from arc_suite.envs import trees
from arc_suite.tasks import Task
from arc_suite.tasks.parameters import LARGEST

_NOT_REAL = "cOSUMmT"  # kinds of arrays that NumPy would make floats of: complex, objects, text, dates


class KnownAttributes:
    """An object whose public attributes are those that it was made with: others would be accepted, and do nothing.

    It sets `_made` once it is complete. Classes of other packages that inherit may add attributes of their own.
    """

    def __setattr__(self, name: str, value: Any):
        if name[0] != "_" and "_made" in self.__dict__:
            self._check_known(name)
        super().__setattr__(name, value)

    def _check_known(self, name: str) -> None:
        if name not in self.__dict__ and not hasattr(type(self), name) and type(self).__module__ == self._made:
            raise AttributeError(
                f"cannot set {checks.preview(name)}: there is no such attribute; "
                "change_settings of the environment changes settings"
            )


class Lock(type(threading.RLock())):  # type: ignore[misc]  # the class has no name
    """The lock of one environment, as MuJoCo crashes where two threads step one simulation.

    Its pickles and copies are new locks, which nobody holds.
    """

    def __reduce__(self):
        return Lock, ()


def one_thread_at_a_time(method):
    """Make a method of an environment, whose `_lock` is a `Lock`, refuse calls while another thread is in one.

    Raises:
        RuntimeError: another thread's call is at work; nothing has changed.
    """

    @functools.wraps(method)
    def alone(self, *args, **kwargs):
        lock = self._lock
        if not lock.acquire(False):
            raise RuntimeError(
                f"cannot {method.__name__}: another thread is using this environment; make one for each thread"
            )
        try:
            return method(self, *args, **kwargs)
        finally:
            lock.release()

    return alone


class LiveCommands:
    """The latest value of each live command that no step has taken yet; any thread may put one at any time.

    Pickles and copies hold the same values.
    """

    def __init__(self):
        """Start without any."""
        self._lock, self._latest = Lock(), {}  # the latter is replaced, never changed

    def put(self, name: str, value: np.ndarray, mask: np.ndarray | None = None) -> None:
        """Add a checked value, in a batch for the environments of a mask (num_envs,)."""
        with self._lock:
            if mask is not None and name in self._latest:
                before, others = self._latest[name]
                value, mask = np.where(mask[:, None], value, before), mask | others
            self._latest = {**self._latest, name: (value, mask)}

    def peek(self, task: Task, memory) -> Any:
        """Return the memory of an episode of a task as the next step will find it."""
        return _commanded(task, memory, self._latest)

    def consume(self, task: Task, memory) -> Any:
        """Return the memory of an episode of a task after the commands, which are gone then."""
        with self._lock:
            latest, self._latest = self._latest, {}
        return _commanded(task, memory, latest)


def _commanded(task: Task, memory, latest) -> Any:
    for name, (value, mask) in latest.items():
        changed = task.with_command(memory, name, value)
        memory = changed if mask is None else trees.where(mask, changed, memory)
    return memory


def checked_action(action, shape: tuple[int, ...]) -> np.ndarray:
    """Return the action as float64, clipped to [-1, 1].

    Args:
        action: of the shape.
        shape: (..., motors)

    Raises:
        ValueError: another shape, not numbers, or NaN.
    """
    array = _real(action)
    if array is None:
        numbers, kind = " x ".join(map(str, shape)), type(action).__name__
        kind += f" of {action.dtype}" if isinstance(action, np.ndarray) else ""
        raise ValueError(f"action: expected {numbers} numbers, got {kind}")
    if array.shape != shape:
        raise ValueError(f"action: expected shape {shape}, got {array.shape}")
    invalid = np.isnan(array)
    if np.count_nonzero(invalid):
        index = np.argwhere(invalid)[0]
        raise ValueError(f"action[{', '.join(map(str, index))}]: expected a number from -1 to 1, got nan")
    return array.clip(-1.0, 1.0)


def checked_command(task: Task, name: str, value, leading: tuple[int, ...] = ()) -> np.ndarray:
    """Return the value of a live command as floats, (*leading, size); None stands for what the task itself would do.

    Raises:
        ValueError: the task has no such command, or the value has another size or is out of range.
    """
    if not task.commands:
        raise ValueError(f"command {checks.preview(name)}: task {task.name} has no commands")
    size = task.commands[checks.name(name, task.commands, "command")]
    if isinstance(value, str):
        named = task.named_command(name, value)
        if named is None:
            raise ValueError(f"command {name!r}: expected numbers, got {checks.preview(value)}")
        value = named
    numbers = np.full(size, np.nan) if value is None else _real(value)
    if numbers is None or numbers.shape not in ((size,), (*leading, size)) or (abs(numbers) > LARGEST).any():
        raise ValueError(
            f"command {name!r}: expected {size} numbers from {-LARGEST:g} to {LARGEST:g}, got {checks.preview(value)}"
        )
    low, high = task.command_limits.get(name, (-LARGEST, LARGEST))
    if len(outside := np.argwhere((numbers < low) | (numbers > high))):
        *_, place = outside[0]
        raise ValueError(
            f"command {name!r}: expected number {place} between {low[place]:g} and {high[place]:g}, "
            f"got {numbers[tuple(outside[0])]:g}"
        )
    return np.broadcast_to(numbers, (*leading, size)).copy()


def _real(value) -> np.ndarray | None:
    """The value as floats; None where it holds anything but real numbers, or hides some of them."""
    try:
        array = np.asarray(value)
        if array.dtype.kind in _NOT_REAL or (array is not value and isinstance(value, np.ma.MaskedArray)):
            return None
        return array.astype(float, copy=False)
    except (TypeError, ValueError, OverflowError, RecursionError):
        return None
