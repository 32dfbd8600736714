"""What vector environments have in common: calls of every environment, checks of seeds, masks and indices."""

from collections.abc import Iterable

import gymnasium
import numpy as np
from gymnasium.error import ClosedEnvironmentError

from arc_suite import checks

MAX_ENVS = 1 << 20

# Attributes that have a value for each environment.
_OF_EACH = ("np_random", "np_random_seed", "render", "positions", "resampled")
_OF_ONE = {"observation_space": "single_observation_space", "action_space": "single_action_space"}


class BaseVectorEnv(gymnasium.vector.VectorEnv):
    """A vector environment that answers for each of its environments."""

    def call(self, name: str, *args, **kwargs) -> tuple:
        """Call a method, or read an attribute, of every environment, as Gymnasium's own vector environments do.

        Args:
            name: of an attribute of this environment; what environments share is the value of each of them.
            *args: of the method.
            **kwargs: of the method.

        Returns:
            A value for each environment.

        Raises:
            ValueError: `reset`, `step` or `close`, which are of all environments at once.
            AttributeError: no such attribute.
        """
        if name in ("reset", "step", "close"):
            raise ValueError(f"call {name!r}: environments do it together; call {name} of the environment itself")
        value = getattr(self, _OF_ONE.get(name, name))
        if callable(value):
            value = value(*args, **kwargs)
        return tuple(value) if name in _OF_EACH and value is not None else (value,) * self.num_envs

    def get_attr(self, name: str) -> tuple:
        """Return an attribute of every environment; see `call`."""
        return self.call(name)

    def set_attr(self, name: str, values) -> None:
        """Set an attribute that the environments share.

        Args:
            name: of the attribute.
            values: one for all, or a list or tuple of as many equal ones as there are environments.

        Raises:
            ValueError: another number of values, or different ones.
            AttributeError: there is no such attribute.
        """
        values = list(values) if isinstance(values, list | tuple) else [values]
        if len(values) not in (1, self.num_envs) or any(value != values[0] for value in values):
            raise ValueError(
                f"set_attr {name!r}: environments share it; expected one value for all, got {checks.preview(values)}"
            )
        setattr(self, name, values[0])

    def _check_open(self, call: str) -> None:
        if self.closed:
            raise ClosedEnvironmentError(f"cannot {call}: the environment is closed; make a new one")

    def _seeds(self, seed) -> list[int | None]:
        """Return a seed for each environment."""
        if np.ndim(seed) == 1:
            if len(seed) != self.num_envs:
                raise ValueError(f"seed: expected one for each of {self.num_envs} environments, got {len(seed)}")
            return [None if each is None else checks.seed(each) for each in seed]
        first = checks.integer("seed", checks.seed(seed), 0, checks.MAX_SEED - self.num_envs + 1)
        return [first + index for index in range(self.num_envs)]

    def _reset_mask(self, options) -> np.ndarray:
        """The checked mask of `reset`'s options."""
        for name in checks.mapping("options", options):
            checks.name(name, ["reset_mask"], "option of reset")
        return self._mask((options or {}).get("reset_mask"))

    def _mask(self, mask, name: str = "reset_mask") -> np.ndarray:
        """A checked mask; all environments for None."""
        if mask is None:
            return np.ones(self.num_envs, bool)
        mask = np.asarray(mask)
        if mask.shape != (self.num_envs,) or mask.dtype != bool or not mask.any():
            raise ValueError(
                f"{name}: expected {self.num_envs} booleans, at least one of them true, got {checks.preview(mask)}"
            )
        return mask.copy()

    def _indices(self, indices: Iterable[int] | None) -> list[int]:
        """Checked indices of environments; all for None."""
        every = range(self.num_envs)
        indices = list(every if indices is None else indices)
        for index in indices:
            if index not in every:
                raise ValueError(
                    f"indices: expected integers from 0 to {self.num_envs - 1}, got {checks.preview(index)}"
                )
        return indices
