"""What vector environments have in common: calls of every environment, checks of seeds, masks and indices."""

from collections.abc import Iterable, Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ClosedEnvironmentError

from arc_suite import checks

MAX_ENVS = 1 << 20

# Attributes whose values, or whose methods' results, have an entry for each environment.
_PER_ENVIRONMENT = ("np_random", "np_random_seed", "render", "positions", "resampled")
# Attributes of a single environment -> the attribute of the vector environment with the same value.
_SINGLE_ATTRIBUTES = {"observation_space": "single_observation_space", "action_space": "single_action_space"}


class BaseVectorEnv(gymnasium.vector.VectorEnv[Any, np.ndarray, np.ndarray]):
    """A vector environment with the attributes and methods of each of its environments."""

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple:
        """Call a method, or read an attribute, of every environment, as Gymnasium's own vector environments do.

        Args:
            name: name of an attribute or method of this environment. A value that the environments share is returned
                for each of them.
            *args: arguments of the method.
            **kwargs: keyword arguments of the method.

        Returns:
            A value for each environment.

        Raises:
            ValueError: `reset`, `step` or `close`, which act on all environments at once.
            AttributeError: there is no such attribute.
        """
        if name in ("reset", "step", "close"):
            raise ValueError(f"call {name!r}: environments do it together; call {name} of the environment itself")
        value = getattr(self, _SINGLE_ATTRIBUTES.get(name, name))
        if callable(value):
            value = value(*args, **kwargs)
        if name in _PER_ENVIRONMENT and value is not None:
            return tuple(value)
        return (value,) * self.num_envs

    def get_attr(self, name: str) -> tuple:
        """Return an attribute of every environment; see `call`."""
        return self.call(name)

    def set_attr(self, name: str, values) -> None:
        """Set an attribute that the environments share.

        Args:
            name: name of the attribute.
            values: one for all, or a list or tuple of equal values, one for each environment.

        Raises:
            ValueError: another number of values, or different ones.
            AttributeError: there is no such attribute.
        """
        values = list(values) if isinstance(values, list | tuple) else [values]
        if len(values) not in (1, self.num_envs) or not all(_are_equal(value, values[0]) for value in values):
            raise ValueError(
                f"set_attr {name!r}: environments share it; expected one value for all, got {checks.preview(values)}"
            )
        setattr(self, name, values[0])

    def _check_open(self, action: str) -> None:
        """Raise ClosedEnvironmentError after `close`, and ForkError in a child process that was forked later.

        Args:
            action: says in the error what was called.
        """
        if self.closed:
            raise ClosedEnvironmentError(f"cannot {action}: the environment is closed; make a new one")
        self._check_process()

    def _check_process(self) -> None:
        """Raise ForkError in a child process that was forked after the environments were made."""
        raise NotImplementedError

    def _checked_seeds(self, seed) -> list[int | None]:
        """Return a seed for each environment, given the seed of the first one or a list of all."""
        if np.ndim(seed) == 1:
            if len(seed) != self.num_envs:
                raise ValueError(f"seed: expected one for each of {self.num_envs} environments, got {len(seed)}")
            return [None if single_seed is None else checks.seed(single_seed) for single_seed in seed]
        first = checks.integer("seed", checks.seed(seed), 0, checks.MAX_SEED - self.num_envs + 1)
        return [first + index for index in range(self.num_envs)]

    def _checked_reset_mask(self, options) -> np.ndarray:
        """Return the mask (num_envs,) in the options of `reset`; all environments if there is none."""
        for name in checks.mapping("options", options):
            checks.name(name, ["reset_mask"], "option of reset")
        return self._checked_mask((options or {}).get("reset_mask"))

    def _checked_mask(self, mask, name: str = "reset_mask") -> np.ndarray:
        """Return a mask (num_envs,), in new memory; all environments for None. Errors begin with its name."""
        if mask is None:
            return np.ones(self.num_envs, bool)
        mask = np.asarray(mask)
        if mask.shape != (self.num_envs,) or mask.dtype != bool or not mask.any():
            raise ValueError(
                f"{name}: expected {self.num_envs} booleans, at least one of them true, got {checks.preview(mask)}"
            )
        return mask.copy()

    def _checked_indices(self, indices: Iterable[int] | None) -> list[int]:
        """Return indices of environments; those of all for None."""
        all_indices = range(self.num_envs)
        if indices is None:
            return list(all_indices)
        indices = list(indices)
        for index in indices:
            if index not in all_indices:
                raise ValueError(
                    f"indices: expected integers from 0 to {self.num_envs - 1}, got {checks.preview(index)}"
                )
        return indices


def _are_equal(value: Any, other: Any) -> bool:
    """Return whether two values, which may be arrays, are equal as a whole."""
    if isinstance(value, np.ndarray) or isinstance(other, np.ndarray):
        return np.array_equal(value, other)
    return value == other


def checked_task_kwargs(task_kwargs: Any) -> Mapping[str, Any]:
    """Return the settings of a vector environment, which all of its environments have at first.

    Raises:
        ValueError: no mapping.
    """
    is_one_for_each = isinstance(task_kwargs, list | tuple) and all(isinstance(item, Mapping) for item in task_kwargs)
    if is_one_for_each:
        cure = "change_settings with a mask sets those of some"
        raise ValueError(
            f"task_kwargs: expected one mapping for all environments, got {checks.preview(task_kwargs)}; {cure}"
        )
    return checks.mapping("task_kwargs", task_kwargs)
