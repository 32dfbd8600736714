"""The protocol of policies, which act for a batch of environments; one environment is a batch of one."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Protocol, TypeAlias

import dm_env
import numpy as np
from numpy.typing import ArrayLike

from arc_suite import checks
from arc_suite.envs.calls import checked_action
from arc_suite.envs.timestep import TimeStep

# A policy as a plain function, from a `TimeStep` with named blocks to an action (joints,).
PolicyFunction: TypeAlias = Callable[[TimeStep], ArrayLike]


class Policy(Protocol):
    """A policy for a batch of environments, each in its own episode.

    The actions of an episode depend on its seed, observations and rewards alone.
    """

    def reset(self, indices: Sequence[int], seeds: Sequence[int]) -> None:
        """Start episodes in some environments.

        Args:
            indices: indices of the environments.
            seeds: seed of the episode of each.
        """

    def act(self, observation: Mapping[str, np.ndarray], rewards: np.ndarray) -> np.ndarray:
        """Return the actions of a control step.

        Args:
            observation: blocks by name, each (num_envs, size).
            rewards: (num_envs,) rewards of the step before; ignored in the first step of an episode.

        Returns:
            (num_envs, joints), to be clipped to [-1, 1].
        """


class Script:
    """An open-loop policy: its actions do not depend on observations."""

    def __init__(self, script: Callable[[int], Iterable[np.ndarray]], num_envs: int, joints: int):
        """Set the script.

        Args:
            script: function of a seed that returns the actions (joints,) of its episode. After the last one actions
                are 0.
            num_envs: number of environments.
            joints: number of joints of an action.
        """
        self._script = script
        no_actions: Iterator = iter(())  # before the first episode
        self._scripts = [no_actions] * num_envs
        self._zero = np.zeros(joints)

    def reset(self, indices: Sequence[int], seeds: Sequence[int]) -> None:
        """Start the episodes of seeds in some environments."""
        for index, seed in zip(indices, seeds, strict=True):
            self._scripts[index] = iter(self._script(seed))

    def act(self, observation: Mapping[str, np.ndarray], rewards: np.ndarray) -> np.ndarray:
        """Return the next actions (num_envs, joints)."""
        return np.stack([next(script, self._zero) for script in self._scripts])


class Sum:
    """The sum of the actions of two policies."""

    def __init__(self, first: Policy, second: Policy):
        """Set the policies."""
        self._policies = (first, second)

    def reset(self, indices: Sequence[int], seeds: Sequence[int]) -> None:
        """Start the episodes of seeds in some environments."""
        for policy in self._policies:
            policy.reset(indices, seeds)

    def act(self, observation: Mapping[str, np.ndarray], rewards: np.ndarray) -> np.ndarray:
        """Return the sum of the actions (num_envs, joints)."""
        first, second = self._policies
        return first.act(observation, rewards) + second.act(observation, rewards)


class Mixture:
    """Several policies that take turns from seed to seed."""

    def __init__(self, policies: Sequence[Policy], num_envs: int):
        """Set the policies; policy i acts in episodes whose seed modulo the number of policies is i."""
        self._policies = policies
        self._policy_indices = np.zeros(num_envs, int)

    def reset(self, indices: Sequence[int], seeds: Sequence[int]) -> None:
        """Start the episodes of seeds in some environments."""
        self._policy_indices[indices] = np.asarray(seeds) % len(self._policies)
        for policy in self._policies:
            policy.reset(indices, seeds)

    def act(self, observation: Mapping[str, np.ndarray], rewards: np.ndarray) -> np.ndarray:
        """Return the actions (num_envs, joints)."""
        actions = np.stack([policy.act(observation, rewards) for policy in self._policies])
        environments = np.arange(len(self._policy_indices))
        return actions[self._policy_indices, environments]  # of (policies, num_envs, joints)


class Individuals:
    """A policy that acts by plain functions from a dm_env `TimeStep` to an action, a new one in every episode.

    A function gets the observations that an environment of `arc_suite.load` has: blocks by name.
    """

    def __init__(self, make: Callable[[], PolicyFunction], num_envs: int, joints: int, name: str = "policy"):
        """Set the function that makes the functions of episodes.

        Args:
            make: function without arguments that returns a function of a `TimeStep`.
            num_envs: number of environments.
            joints: number of joints of an action.
            name: name of the policy, with which errors begin.
        """
        self._make = make
        self._name = name
        self._joints = joints
        self._functions: list[PolicyFunction | None] = [None] * num_envs  # None before the first episode
        self._seeds = [0] * num_envs
        self._steps = [0] * num_envs  # control steps since the starts of the episodes

    def reset(self, indices: Sequence[int], seeds: Sequence[int]) -> None:
        """Start the episodes of seeds in some environments."""
        for index, seed in zip(indices, seeds, strict=True):
            self._functions[index] = self._make()
            self._seeds[index] = seed
            self._steps[index] = 0

    def act(self, observation: Mapping[str, np.ndarray], rewards: np.ndarray) -> np.ndarray:
        """Return the actions (num_envs, joints).

        Raises:
            ValueError: an action of another shape, not of numbers, or with NaN.
        """
        actions = np.zeros((len(self._functions), self._joints))
        for index, function in enumerate(self._functions):
            if function is None:
                continue
            blocks = {name: block[index].astype(float) for name, block in observation.items()}
            if self._steps[index] == 0:
                timestep = dm_env.restart(blocks)
            else:
                timestep = dm_env.transition(float(rewards[index]), blocks)
            try:
                actions[index] = checked_action(function(timestep), (self._joints,))
            except ValueError as error:
                where = f"episode of seed {self._seeds[index]}, step {self._steps[index]}"
                raise ValueError(f"{self._name}: {where}: {error}") from None
            self._steps[index] += 1
        return actions


def alone(policy: Policy, seed: int = 0) -> Callable[[TimeStep], np.ndarray]:
    """Return a policy for one environment: a function from a `TimeStep` with named blocks to an action (joints,).

    The first `TimeStep` of an episode begins it.

    Args:
        policy: policy of a batch of one environment.
        seed: seed of all its episodes.

    Raises:
        ValueError: `seed` is no integer that `checks.seed` accepts.
    """
    seed = checks.seed(seed)

    def act(timestep: TimeStep) -> np.ndarray:
        if timestep.first():
            policy.reset([0], [seed])
        blocks = {name: block[None] for name, block in timestep.observation.items()}
        return policy.act(blocks, np.array([timestep.reward or 0.0]))[0]

    return act
