"""The rows of a vector environment for stable-baselines3, which must be installed to import this module."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from stable_baselines3.common import vec_env

from arc_suite.envs.vector import VectorEnv


class VecEnv(vec_env.VecEnv):
    """Rows of one task as stable-baselines3's vector environment.

    `VecEnv(gymnasium.make_vec("arc_suite/queen-walk-v0", num_envs=16, autoreset_mode="SameStep"))`
    gives the same bits as a `DummyVecEnv` of as many single environments, on all cores.
    """

    def __init__(self, rows: VectorEnv):
        """Take over the rows.

        Args:
            rows: with `autoreset_mode` SameStep, as stable-baselines3 resets at once.

        Raises:
            ValueError: another autoreset mode, or no rows of this suite; one line.
        """
        mode = getattr(rows, "autoreset_mode", None)
        if not isinstance(rows, VectorEnv) or mode is not AutoresetMode.SAME_STEP:
            raise ValueError(
                "stable-baselines3 resets at once: expected rows of this suite made with autoreset_mode='SameStep', "
                f"got {rows!r}{'' if mode is None else f' in the mode {mode.value}'}"
            )
        self.rows = rows
        self._actions = None
        super().__init__(rows.num_envs, rows.single_observation_space, rows.single_action_space)

    def reset(self) -> np.ndarray:
        """Start an episode in every row, from the seeds of the latest `seed` if that was not used yet."""
        observations, _ = self.rows.reset(seed=self._seeds)
        self.reset_infos = [{} for _ in range(self.num_envs)]
        self._reset_seeds()
        self._reset_options()
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        """Take the actions (num_envs, motors) of the next `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Advance every row by one control step; rows whose episode ends start the next one.

        Returns:
            Observations (num_envs, size), rewards (num_envs,) float32, whether episodes ended
            (num_envs,), and an info for each row: that of a single environment's step with
            `TimeLimit.truncated`, and `terminal_observation` where an episode ended.
        """
        observations, rewards, terminated, truncated, info = self.rows.step(self._actions)
        infos = [{"TimeLimit.truncated": cut} for cut in (truncated & ~terminated).tolist()]
        last, final = info.pop("final_obs", None), info.pop("final_info", {})
        _hand_out(info, infos)
        _hand_out(final, infos)
        ended = terminated | truncated
        for row in np.flatnonzero(ended):
            infos[row]["terminal_observation"] = last[row]
        return observations, rewards.astype(np.float32), ended, infos

    def close(self) -> None:
        """Free the simulations."""
        self.rows.close()

    def get_images(self) -> list[np.ndarray | None]:
        """Return a picture of each row; None without a render mode."""
        return list(self.rows.call("render"))

    def get_attr(self, attr_name: str, indices=None) -> list:
        """Return an attribute of rows; see `VectorEnv.call`."""
        values = self.rows.get_attr(attr_name)
        return [values[row] for row in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value, indices=None) -> None:
        """Set an attribute that the rows share.

        Raises:
            ValueError: of some rows alone; one line.
        """
        self._check_all(attr_name, indices)
        self.rows.set_attr(attr_name, value)

    def env_method(self, method_name: str, *method_args, indices=None, **method_kwargs) -> list:
        """Call a method of all rows; see `VectorEnv.call`.

        Raises:
            ValueError: of some rows alone; one line.
        """
        self._check_all(method_name, indices)
        return list(self.rows.call(method_name, *method_args, **method_kwargs))

    def env_is_wrapped(self, wrapper_class, indices=None) -> list[bool]:
        """Return False for every row: nothing is around it."""
        return [False for _ in self._get_indices(indices)]

    def _check_all(self, name: str, indices) -> None:
        if sorted(self._get_indices(indices)) != list(range(self.num_envs)):
            raise ValueError(f"{name}: rows share it; expected all {self.num_envs} rows, got {indices!r}")


def _hand_out(info: Mapping[str, Any], infos: list[dict[str, Any]]) -> None:
    """Add what an info tells of rows to the infos of these rows."""
    for name, values in info.items():
        if not name.startswith("_"):
            mask = info[f"_{name}"]
            for row, value in zip(np.flatnonzero(mask).tolist(), values[mask].tolist(), strict=True):
                infos[row][name] = value
