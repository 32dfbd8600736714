"""Policies that stable-baselines3 has saved, as zips; it must be installed to import this module.

A zip holds pickles, and so does a file of statistics of `VecNormalize`: reading one runs its code.
"""

import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import torch
from stable_baselines3.common.save_util import load_from_pkl, load_from_zip_file
from stable_baselines3.common.vec_env import VecNormalize

from arc_suite import checks, usage
from arc_suite.envs.setup import Setup
from arc_suite.policies.network import Network, StoredNetwork
from arc_suite.policies.tracing import Traced, traced

# Class of a PyTorch module -> function that adds the module's node to a graph, given the inputs and the module.
_NODES = {
    torch.nn.Linear: lambda x, module: x.node("Linear", _array(module.weight.T), _array(module.bias)),
    torch.nn.ReLU: lambda x, module: x.node("Relu"),
    torch.nn.Tanh: lambda x, module: x.node("Tanh"),
}
_TOLERANCE = 1e-4  # of an action, between the graph and PyTorch


class Saved:
    """The deterministic policy of any algorithm of stable-baselines3.

    Attributes:
        joints: number of joints of an action.
    """

    def __init__(self, path: Path, statistics: Path | None = None):
        """Read a zip.

        Args:
            path: path of the zip.
            statistics: file that `VecNormalize.save` wrote; None for a policy of plain observations.

        Raises:
            ValueError: it is no zip of stable-baselines3.
            OSError: it cannot be read.
        """
        self._path = path
        try:
            data, parameters, _ = load_from_zip_file(path, device="cpu")
            observation_space = data["observation_space"]
            action_space = data["action_space"]
            learning_rate = lambda _: 0.0  # noqa: E731
            self._policy = data["policy_class"](observation_space, action_space, learning_rate, **data["policy_kwargs"])
            self._policy.load_state_dict(parameters["policy"])
        except (zipfile.BadZipFile, ValueError, KeyError, TypeError, RuntimeError, AssertionError) as error:
            raise ValueError(f"policy {path}: no policy of stable-baselines3: {checks.quote(error)}") from None
        self._policy.set_training_mode(False)
        self._size = observation_space.shape
        (self.joints,) = action_space.shape
        self._statistics = None if statistics is None else _read_statistics(statistics, self._size)

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
        return self._actions(flat).astype(float)

    def network(self, setup: Setup) -> Network:
        """Return the policy as a graph, which normalizes observations with the statistics.

        Args:
            setup: setup in which it was trained.

        Raises:
            ValueError: a policy that is no multilayer perceptron of known layers, or of another size.
        """
        task = setup.definition
        if self._size != (task.size,):
            raise ValueError(f"policy {self._path}: expected observations ({task.size},), got {self._size}")
        try:
            network = StoredNetwork(traced(self._trace, task.size), setup, task.sizes)
        except (KeyError, AttributeError, TypeError) as error:
            raise ValueError(f"policy {self._path}: expected a perceptron, got {checks.quote(error)}") from None
        samples = np.random.default_rng(0).standard_normal((8, *self._size), np.float32)
        if np.abs(network.actions(samples) - self._actions(samples)).max() > _TOLERANCE:
            raise ValueError(f"policy {self._path}: expected a perceptron, got another network")
        return network

    def _trace(self, x: Traced) -> Traced:
        statistics = self._statistics
        if statistics is not None and statistics.norm_obs:
            limit = np.float32(statistics.clip_obs)
            factor = 1.0 / np.sqrt(statistics.obs_rms.var + statistics.epsilon)
            x = ((x - statistics.obs_rms.mean) * factor).clip(-limit, limit)
        for module in _modules(self._policy):
            x = _NODES[type(module)](x, module)
        return x.node("Tanh") if self._policy.squash_output else x.clip(-1.0, 1.0)

    def _actions(self, observations: np.ndarray) -> np.ndarray:
        usage.add_source(usage.POLICY)
        if self._statistics is not None:
            observations = self._statistics.normalize_obs(observations)
        with torch.no_grad():
            actions = [self._policy.predict(observation, deterministic=True)[0] for observation in observations]
        return np.stack(actions)


def _read_statistics(path: Path, size: tuple[int, ...]) -> VecNormalize:
    try:
        statistics = load_from_pkl(path)
    except OSError:
        raise
    except Exception as error:  # a pickle may raise anything
        raise ValueError(f"{path}: no statistics of VecNormalize: {checks.quote(error)}") from None
    if not isinstance(statistics, VecNormalize):
        raise ValueError(f"{path}: expected statistics of VecNormalize, got {type(statistics).__name__}")
    if statistics.norm_obs and statistics.obs_rms.mean.shape != size:
        raise ValueError(f"{path}: expected statistics of observations {size}, got {statistics.obs_rms.mean.shape}")
    return statistics


def _modules(policy) -> list[torch.nn.Module]:
    """Return the modules from observations to actions before squashing or clipping."""
    if not hasattr(policy, "actor"):
        return [*policy.mlp_extractor.policy_net, policy.action_net]
    if hasattr(policy.actor, "latent_pi"):
        return [*policy.actor.latent_pi, policy.actor.mu]
    return [*policy.actor.mu][:-1]


def _array(parameter) -> np.ndarray:
    return parameter.detach().numpy().astype(np.float32)
