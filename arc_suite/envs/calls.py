"""Calls of environments: refusal of concurrent calls, checks of actions and commands, live commands of any thread."""

import functools
import threading
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Concatenate, ParamSpec, TypeVar

import numpy as np

from arc_suite import checks
from arc_suite.envs import trees
from arc_suite.tasks import Task
from arc_suite.tasks.parameters import LARGEST

# Kinds of dtypes that NumPy would convert to floats although they are no real numbers: complex, objects, text, dates.
_KINDS_NOT_REAL = "cOSUMmT"

_Environment = TypeVar("_Environment")
_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


class KnownAttributes:
    """An object that refuses new public attributes once it is complete: a misspelled name would have no effect.

    A class sets `_sealed_by` to its module's name at the end of `__init__`. Classes of other modules that inherit from
    it may have new attributes.
    """

    _sealed_by: str

    # Attributes' names in pickles of earlier versions -> their present names.
    _FORMER_NAMES: ClassVar[Mapping[str, str]] = {"_made": "_sealed_by"}

    def __setattr__(self, name: str, value: Any):
        is_public = name[0] != "_"
        is_complete = "_sealed_by" in self.__dict__
        if is_public and is_complete:
            self._check_attribute(name)
        super().__setattr__(name, value)

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in state.items():
            self.__dict__[self._FORMER_NAMES.get(name, name)] = value

    def _check_attribute(self, name: str) -> None:
        """Raise AttributeError for a name that no attribute has."""
        is_known = name in self.__dict__ or hasattr(type(self), name)
        if not is_known and type(self).__module__ == self._sealed_by:
            raise AttributeError(
                f"cannot set {checks.preview(name)}: there is no such attribute; "
                "change_settings of the environment changes settings"
            )


class Lock(type(threading.RLock())):  # type: ignore[misc]  # the class has no name
    """The lock of one environment, as MuJoCo crashes where two threads step one simulation.

    A thread that holds it may take it again, as methods of an environment call one another. Its pickles and copies are
    new locks, which nobody holds.
    """

    def __reduce__(self):
        return Lock, ()


def one_thread_at_a_time(
    method: Callable[Concatenate[_Environment, _Arguments], _Result],
) -> Callable[Concatenate[_Environment, _Arguments], _Result]:
    """Make a method refuse calls while another thread is in such a method of the same environment.

    The environment has a `Lock` as its attribute `_lock`.

    Raises:
        RuntimeError: another thread's call is at work; nothing has changed.
    """

    @functools.wraps(method)
    def call_alone(self, *args: _Arguments.args, **kwargs: _Arguments.kwargs) -> _Result:
        lock = self._lock
        if not lock.acquire(False):
            raise RuntimeError(
                f"cannot {method.__name__}: another thread is using this environment; make one for each thread"
            )
        try:
            return method(self, *args, **kwargs)
        finally:
            lock.release()

    return call_alone


class LiveCommands:
    """Live commands that no step has used yet, the latest value of each; any thread may set one at any time.

    Pickles and copies have the same values.
    """

    def __init__(self):
        """Start without commands."""
        self._lock = Lock()
        # By name of the command: its value, and the mask of its environments or None. The dictionary is replaced as a
        # whole, never changed, so that other threads may read it without the lock.
        self._latest = {}

    def put(self, name: str, value: np.ndarray, mask: np.ndarray | None = None) -> None:
        """Set the value of a command.

        Args:
            name: name of the command.
            value: checked, (size,), or (num_envs, size) with a mask.
            mask: (num_envs,) the environments of a batch that get the value; None for a single environment.
        """
        with self._lock:
            if mask is not None and name in self._latest:
                earlier_value, earlier_mask = self._latest[name]
                value = np.where(mask[:, None], value, earlier_value)
                mask = mask | earlier_mask
            self._latest = {**self._latest, name: (value, mask)}

    def peek(self, task: Task, memory) -> Any:
        """Return the memory of an episode with the commands, as the next step will use it."""
        return _apply_commands(task, memory, self._latest)

    def consume(self, task: Task, memory) -> Any:
        """Return the memory of an episode with the commands, and forget the commands."""
        with self._lock:
            latest = self._latest
            self._latest = {}
        return _apply_commands(task, memory, latest)


def _apply_commands(task: Task, memory, latest) -> Any:
    for name, (value, mask) in latest.items():
        changed_memory = task.with_command(memory, name, value)
        memory = changed_memory if mask is None else trees.where(mask, changed_memory, memory)
    return memory


def checked_action(action, shape: tuple[int, ...]) -> np.ndarray:
    """Return the action as float64, clipped to [-1, 1].

    Args:
        action: action of the shape.
        shape: (..., motors)

    Raises:
        ValueError: another shape, not numbers, NaN or infinity.
    """
    array = _to_floats(action)
    if array is None:
        numbers = " x ".join(map(str, shape))
        kind = type(action).__name__
        if isinstance(action, np.ndarray):
            kind += f" of {action.dtype}"
        raise ValueError(f"action: expected {numbers} numbers, got {kind}")
    if array.shape != shape:
        raise ValueError(f"action: expected shape {shape}, got {array.shape}")
    is_finite = np.isfinite(array)
    if not is_finite.all():
        index = tuple(np.argwhere(~is_finite)[0])
        position = ", ".join(map(str, index))
        raise ValueError(f"action[{position}]: expected a number from -1 to 1, got {array[index]}")
    return array.clip(-1.0, 1.0)


def checked_command(task: Task, name: str, value, leading: tuple[int, ...] = ()) -> np.ndarray:
    """Return the value of a live command as floats, (*leading, size).

    Args:
        task: task of the environment.
        name: one of the task's `commands`.
        value: (size,) or (*leading, size) numbers, the name of a value, or None. None and NaN leave the command to
            the task itself.
        leading: the leading axes of a batch.

    Raises:
        ValueError: the task has no such command, or the value has another size or is out of range.
    """
    if not task.commands:
        raise ValueError(f"command {checks.preview(name)}: task {task.name} has no commands")
    size = task.commands[checks.name(name, task.commands, "command")]
    if isinstance(value, str):
        value = _look_up_value(task, name, value)
    numbers = np.full(size, np.nan) if value is None else _to_floats(value)
    if numbers is None or numbers.shape not in ((size,), (*leading, size)) or (abs(numbers) > LARGEST).any():
        raise ValueError(
            f"command {name!r}: expected {size} numbers from {-LARGEST:g} to {LARGEST:g}, got {checks.preview(value)}"
        )
    if name in task.command_limits:
        _check_limits(name, numbers, *task.command_limits[name])
    return np.broadcast_to(numbers, (*leading, size)).copy()


def _look_up_value(task: Task, name: str, value_name: str) -> np.ndarray:
    """Return the numbers of a command's value that has a name, such as a gait.

    Raises:
        ValueError: the command has no such value, or none with names.
    """
    value = task.named_command(name, value_name)
    if value is None:
        raise ValueError(f"command {name!r}: expected numbers, got {checks.preview(value_name)}")
    return value


def _check_limits(name: str, numbers: np.ndarray, low: np.ndarray, high: np.ndarray) -> None:
    """Raise ValueError for a command (..., size) with a number below `low` or above `high`, (size,) each."""
    outside = np.argwhere((numbers < low) | (numbers > high))
    if len(outside):
        index = outside[0]
        number_index = index[-1]
        raise ValueError(
            f"command {name!r}: expected number {number_index} between {low[number_index]:g} "
            f"and {high[number_index]:g}, got {numbers[tuple(index)]:g}"
        )


def _to_floats(value) -> np.ndarray | None:
    """Return the value as floats; None where it has anything but real numbers, or a masked array hides some."""
    try:
        array = np.asarray(value)
        hides_numbers = array is not value and isinstance(value, np.ma.MaskedArray)
        if array.dtype.kind in _KINDS_NOT_REAL or hides_numbers:
            return None
        return array.astype(float, copy=False)
    except (TypeError, ValueError, OverflowError, RecursionError):
        return None
