"""Plays seeded episodes in a vector environment."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite.data.episodes import Episode
from arc_suite.envs.vector import VectorEnv
from arc_suite.policies import Policy


class Step(NamedTuple):
    """The outcome of one control step of all environments.

    Attributes:
        playing: number of environments that played.
        finished: episodes that ended.
    """

    playing: int
    finished: list[Episode]


def play(environment: VectorEnv, policy: Policy, seeds: Sequence[int], steps: int) -> Iterator[Step]:
    """Play one episode for each seed; an environment whose episode ends starts the next one at once.

    An episode depends on its seed and the policy alone, not on the number of environments, threads or its neighbors.
    Actions are rounded to float32 before they are applied, so that the recorded actions are the applied ones.

    Args:
        environment: with at most as many environments as there are seeds.
        policy: made for as many environments.
        seeds: of the episodes, started in this order.
        steps: the most that an episode can have.

    Yields:
        A `Step` for every control step.
    """
    num_envs = environment.num_envs
    recording = _Recording(environment, steps)
    waiting = iter(seeds)
    seated = [next(waiting) for _ in range(num_envs)]  # the seed that each environment plays, None if it is done
    observations, _ = environment.reset(seed=seated)
    policy.reset(range(num_envs), seated)
    for index in range(num_envs):
        recording.begin(index, observations)
    rewards = np.zeros(num_envs)
    playing = np.ones(num_envs, bool)
    while playing.any():
        actions = policy.act(environment.task.split(observations), rewards).clip(-1.0, 1.0).astype(np.float32)
        observations, rewards, terminated, truncated, info = environment.step(actions)
        terms = {name: info[f"reward_{name}"] for name in environment.task.settings.weights}
        recording.add(actions, observations, rewards, terms)
        ended = np.flatnonzero((terminated | truncated) & playing)
        finished = [recording.episode(index, seated[index], terminated[index], truncated[index]) for index in ended]
        count = int(playing.sum())
        for index in ended:
            seated[index] = next(waiting, None)
            playing[index] = seated[index] is not None
        starting = [index for index in ended if playing[index]]
        if starting:
            mask = np.zeros(num_envs, bool)
            mask[starting] = True
            observations, _ = environment.reset(seed=seated, options={"reset_mask": mask})
            policy.reset(starting, [seated[index] for index in starting])
            for index in starting:
                recording.begin(index, observations)
        if len(starting) < len(ended):
            environment.rest(~playing)
        yield Step(count, finished)


class _Recording:
    """Arrays of what happens in the environments: allocated once, filled from step to step."""

    def __init__(self, environment: VectorEnv, steps: int):
        num_envs = environment.num_envs
        self._indices = np.arange(num_envs)
        self._clock = np.zeros(num_envs, int)
        self._last = steps - 1
        self._observations = np.empty((num_envs, steps + 1, *environment.single_observation_space.shape), np.float32)
        self._actions = np.empty((num_envs, steps, *environment.single_action_space.shape), np.float32)
        self._rewards = np.empty((num_envs, steps))
        self._terms = None

    def begin(self, index: int, observations) -> None:
        """Start an episode in an environment."""
        self._clock[index] = 0
        self._observations[index, 0] = observations[index]

    def add(self, actions, observations, rewards, terms) -> None:
        """Take down a step of all environments; those that are done write over their last one."""
        if self._terms is None:
            self._terms = {name: np.empty_like(self._rewards) for name in terms}
        at = self._indices, np.minimum(self._clock, self._last)
        self._actions[at] = actions
        self._rewards[at] = rewards
        for name, term in terms.items():
            self._terms[name][at] = term
        self._clock += 1
        self._observations[self._indices, np.minimum(self._clock, self._last + 1)] = observations

    def episode(self, index: int, seed: int, terminated: bool, truncated: bool) -> Episode:
        """Return a copy of the episode that has just ended in an environment."""
        length = self._clock[index]
        ends = np.arange(1, length + 1) == length
        return Episode(
            seed,
            None,
            self._observations[index, : length + 1].copy(),
            self._actions[index, :length].copy(),
            self._rewards[index, :length].copy(),
            ends & terminated,
            ends & truncated,
            {name: term[index, :length].copy() for name, term in self._terms.items()},
        )
