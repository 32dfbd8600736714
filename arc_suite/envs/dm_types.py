"""Classes of dm_env and dm_control with types, for type checkers alone: at run time their originals take their place.

For mypy the originals have no types, and anything that inherits from one seems to have every attribute. Pyright reads
their source.
"""

import enum
from collections.abc import Mapping
from typing import Any, NamedTuple

import dm_env
import numpy as np

MYPY = False  # mypy takes it for True
if MYPY:

    class StepType(enum.IntEnum):
        """Whether an episode begins, goes on or ends."""

        FIRST = 0
        MID = 1
        LAST = 2

        def first(self) -> bool: ...
        def mid(self) -> bool: ...
        def last(self) -> bool: ...

    class TimeStep(NamedTuple):
        """What a step and a reset return; see below."""

        step_type: StepType
        reward: float
        discount: float
        observation: Mapping[str, np.ndarray]

        def first(self) -> bool: ...
        def mid(self) -> bool: ...
        def last(self) -> bool: ...

    class Array:
        """The shape and the dtype of an array."""

        def __init__(self, shape: tuple[int, ...], dtype: Any, name: str | None = None) -> None: ...
        @property
        def shape(self) -> tuple[int, ...]: ...
        @property
        def dtype(self) -> np.dtype[Any]: ...
        @property
        def name(self) -> str | None: ...
        def validate(self, value: Any) -> np.ndarray: ...
        def generate_value(self) -> np.ndarray: ...
        def replace(self, **changes: Any) -> "Array": ...

    class BoundedArray(Array):
        """The shape, the dtype and the bounds of an array."""

        def __init__(
            self, shape: tuple[int, ...], dtype: Any, minimum: Any, maximum: Any, name: str | None = None
        ) -> None: ...
        @property
        def minimum(self) -> np.ndarray: ...
        @property
        def maximum(self) -> np.ndarray: ...

    class PhysicsError(RuntimeError):
        """The physics has diverged."""

    class Task:
        """The base of a task's run."""

    class Environment:
        """The base of an environment."""

        _physics: Any
        _task: Any
        _step_count: int
        _reset_next_step: bool

        def __init__(self, physics: Any, task: Any, time_limit: float, n_sub_steps: int, legacy_step: bool) -> None: ...
        def reset(self) -> TimeStep: ...
        def step(self, action: Any) -> TimeStep: ...

else:
    from dm_control.rl import control
    from dm_env import StepType, specs

    class Environment(control.Environment): ...

    class Task(control.Task): ...

    class PhysicsError(control.PhysicsError): ...

    class Array(specs.Array): ...

    class BoundedArray(specs.BoundedArray, Array): ...

    class TimeStep(dm_env.TimeStep):
        """What a step and a reset return.

        Attributes:
            step_type: whether the episode begins, goes on or ends.
            reward: reward of the step. At the start of an episode it is None, which the type leaves out: programs that
                sum rewards read none there.
            discount: 0 where the episode terminates, else 1; None at the start, as the reward.
            observation: blocks (size,) by name; with `flat_observation` the block `observations` alone.
        """

        step_type: StepType
        reward: float
        discount: float
        observation: Mapping[str, np.ndarray]

        def first(self) -> bool: ...
        def mid(self) -> bool: ...
        def last(self) -> bool: ...
