"""A vector environment for stable-baselines3, which must be installed to import this module."""

import contextlib
import copy
from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode

from arc_suite import checks, versions
from arc_suite.envs.setup import ATTRIBUTE, Setup
from arc_suite.envs.vector import VectorEnv

with versions.require_extra("arc_suite.envs.sb3 needs stable-baselines3", "sb3"):
    from stable_baselines3.common import vec_env

_METHODS_WITH_MASK = ("change_model", "change_settings", "command")


class VecEnv(vec_env.VecEnv):
    """Environments of one task as stable-baselines3's vector environment.

    `VecEnv(gymnasium.make_vec("arc_suite/queen-walk-v0", num_envs=16, autoreset_mode="SameStep"))`
    gives the same bits as a `DummyVecEnv` of as many single environments, on all cores.

    The observation space has an attribute with robot, task and settings. Agents save their spaces, so the zip file of
    an agent contains them, too.
    """

    def __init__(self, environments: gymnasium.vector.VectorEnv[Any, Any, Any]):
        """Wrap a vector environment.

        Args:
            environments: with `autoreset_mode` SameStep, as stable-baselines3 resets at once.

        Raises:
            ValueError: another autoreset mode, or no vector environment of this suite.
        """
        mode = getattr(environments, "autoreset_mode", None)
        if not isinstance(environments, VectorEnv) or mode is not AutoresetMode.SAME_STEP:
            mode_text = "" if mode is None else f" in the mode {mode.value}"
            raise ValueError(
                "stable-baselines3 resets at once: expected a vector environment of this suite with "
                f"autoreset_mode='SameStep', got {checks.preview(environments)}{mode_text}"
            )
        self.environments = environments
        self._actions: np.ndarray | None = None  # of the next `step_wait`
        observation_space = copy.copy(environments.single_observation_space)
        with contextlib.suppress(ValueError):  # without the attribute if a setting cannot be written to files
            setattr(observation_space, ATTRIBUTE, Setup.of(*environments.arguments).to_dict())
        super().__init__(environments.num_envs, observation_space, environments.single_action_space)

    def reset(self) -> np.ndarray:
        """Start an episode in every environment; after a call of `seed` from its seeds, once.

        Raises:
            ValueError: `set_options` has set options, of which there are none.
        """
        if any(self._options):
            raise ValueError(f"options of reset: expected none, got {checks.quote(self._options)}")
        observations, info = self.environments.reset(seed=self._seeds)
        self.reset_infos = [{} for _ in range(self.num_envs)]
        _distribute(info, self.reset_infos)
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        """Store the actions (num_envs, motors) for the next `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Advance every environment by one control step; those whose episode ends start the next one.

        Returns:
            Observations (num_envs, size), rewards (num_envs,) float32, whether episodes ended
            (num_envs,), and an info for each environment: that of a single environment's step with
            `TimeLimit.truncated`, and with `terminal_observation` if its episode ended.
        """
        observations, rewards, terminated, truncated, info = self.environments.step(self._actions)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        last_observations = info.pop("final_obs", None)
        info_of_ends = info.pop("final_info", {})
        _distribute(info, infos)
        has_ended = terminated | truncated
        for index in np.flatnonzero(has_ended):
            self.reset_infos[index] = infos[index]  # of the episode that begins
            infos[index] = {"terminal_observation": last_observations[index]}
        _distribute(info_of_ends, infos)
        for index, is_cut_off in enumerate((truncated & ~terminated).tolist()):
            infos[index]["TimeLimit.truncated"] = is_cut_off
        return observations, rewards.astype(np.float32), has_ended, infos

    def close(self) -> None:
        """Free the simulations."""
        self.environments.close()

    def get_images(self) -> list[np.ndarray | None]:
        """Return a picture of each environment; None without a render mode."""
        return list(self.environments.call("render"))

    def get_attr(self, attr_name: str, indices=None) -> list:
        """Return an attribute of environments; see `VectorEnv.call`."""
        values = self.environments.get_attr(attr_name)
        return [values[index] for index in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value, indices=None) -> None:
        """Set an attribute that the environments share.

        Raises:
            ValueError: the indices are not those of all environments.
        """
        self._check_all(attr_name, indices)
        self.environments.set_attr(attr_name, value)

    def env_method(self, method_name: str, *method_args: Any, indices=None, **method_kwargs: Any) -> list:
        """Call a method of all environments, see `VectorEnv.call`; a method with a mask also of some.

        Raises:
            ValueError: the indices are not those of all environments, and the method has no mask.
        """
        if indices is not None and method_name in _METHODS_WITH_MASK:
            mask = np.zeros(self.num_envs, bool)
            mask[list(self._get_indices(indices))] = True
            results = self.environments.call(method_name, *method_args, mask=mask, **method_kwargs)
            return [results[0]] * int(mask.sum())  # one for each index; all are the same
        self._check_all(method_name, indices)
        return list(self.environments.call(method_name, *method_args, **method_kwargs))

    def env_is_wrapped(self, wrapper_class, indices=None) -> list[bool]:
        """Return False for every environment: none has a wrapper."""
        return [False for _ in self._get_indices(indices)]

    def _check_all(self, name: str, indices) -> None:
        """Raise ValueError if indices are not those of all environments; `name` says what they share."""
        if sorted(self._get_indices(indices)) != list(range(self.num_envs)):
            raise ValueError(
                f"{name}: environments share it; expected all {self.num_envs}, got {checks.preview(indices)}"
            )


def _distribute(info: Mapping[str, Any], infos: list[dict[str, Any]]) -> None:
    """Add the entries of a vector environment's info to the infos of its environments.

    Args:
        info: arrays by name, and by `_name` the mask (num_envs,) of the environments that have the entry.
        infos: infos of each environment; changed in place.
    """
    for name, values in info.items():
        if name.startswith("_"):
            continue
        mask = info[f"_{name}"]
        selected_values = values[mask] if values.ndim > 1 else values[mask].tolist()
        for index, value in zip(np.flatnonzero(mask).tolist(), selected_values, strict=True):
            infos[index][name] = value
