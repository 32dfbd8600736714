"""Policies that stable-baselines3 has saved, as zips; it must be installed to import this module.

A zip holds pickles: reading one runs its code. The statistics of `VecNormalize` lie in another file, so
that policies of normalised observations need a function of one's own (`--policy module:attribute`).
"""

import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import torch
from stable_baselines3.common.save_util import load_from_zip_file

from arc_suite import checks
from arc_suite.robots.spec import Body


class Saved:
    """The deterministic policy of an algorithm of stable-baselines3, whichever it is."""

    def __init__(self, path: Path, body: Body):
        """Read a zip.

        Raises:
            ValueError: it is none of stable-baselines3, or of another body.
            OSError: it cannot be read.
        """
        self._path = path
        if not path.is_file():
            raise OSError(f"cannot read {path}: no such file")
        try:
            data, parameters, _ = load_from_zip_file(path, device="cpu")
            spaces = data["observation_space"], data["action_space"]
            self._policy = data["policy_class"](*spaces, lambda _: 0.0, **data["policy_kwargs"])
            self._policy.load_state_dict(parameters["policy"])
        except (zipfile.BadZipFile, ValueError, KeyError, TypeError, RuntimeError, AssertionError) as error:
            raise ValueError(f"policy {path}: no policy of stable-baselines3: {checks.quoted(error)}") from None
        self._policy.set_training_mode(False)
        self._size = spaces[0].shape
        if spaces[1].shape != (len(body.joint_names),):
            moved = spaces[1].shape
            raise ValueError(f"policy {path}: moves {moved} joints, and {body.name} has {len(body.joint_names)}")

    def reset(self, indices: Sequence[int], seeds: Sequence[int]) -> None:
        """Start episodes: nothing to do, as the policy remembers nothing."""

    def act(self, observation: Mapping[str, np.ndarray], rewards: np.ndarray) -> np.ndarray:
        """Return the actions of a control step; one prediction for each environment, bit-exact.

        Raises:
            ValueError: observations of another size.
        """
        flat = np.concatenate(list(observation.values()), axis=-1, dtype=np.float32)
        if flat.shape[1:] != self._size:
            raise ValueError(f"policy {self._path}: expected observations {self._size}, got {flat.shape[1:]}")
        with torch.no_grad():
            return np.stack([self._policy.predict(each, deterministic=True)[0] for each in flat]).astype(float)
