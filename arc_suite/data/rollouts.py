"""Recording of seeded episodes in a vector environment: `play` starts the next seed where an episode has ended."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite.data.episodes import Episode
from arc_suite.envs.vector import VectorEnv
from arc_suite.policies import Policy


class Step(NamedTuple):
    """The outcome of one control step of all environments.

    Attributes:
        playing: number of environments that had an episode in this step.
        finished: episodes that this step ended.
    """

    playing: int
    finished: list[Episode]


def play(environment: VectorEnv, policy: Policy, seeds: Sequence[int], steps: int) -> Iterator[Step]:
    """Play one episode for each seed; an environment whose episode has ended starts the next one.

    An episode depends on its seed and the policy alone, not on the number of environments, threads or its neighbors.
    Actions are rounded to float32 before they are applied, so that the recorded actions are the applied ones.

    Args:
        environment: with at most as many environments as there are seeds.
        policy: made for as many environments.
        seeds: seeds of the episodes, started in this order.
        steps: largest number of control steps of an episode.

    Yields:
        A `Step` for every control step.
    """
    num_envs = environment.num_envs
    recording = _Recording(environment, steps)
    remaining_seeds = iter(seeds)
    playing_seeds = [next(remaining_seeds) for _ in range(num_envs)]  # of each environment; None after the last one
    observations, _ = environment.reset(seed=playing_seeds)
    policy.reset(range(num_envs), playing_seeds)
    for index in range(num_envs):
        recording.begin(index, observations)
    rewards = np.zeros(num_envs)
    is_playing = np.ones(num_envs, bool)
    while is_playing.any():
        actions = policy.act(environment.task.split(observations), rewards).clip(-1.0, 1.0).astype(np.float32)
        observations, rewards, terminated, truncated, info = environment.step(actions)
        terms = {name: info[f"reward_{name}"] for name in environment.task.settings.weights}
        recording.add(actions, observations, rewards, terms)
        ended_indices = np.flatnonzero((terminated | truncated) & is_playing)
        finished_episodes = [
            recording.episode(index, playing_seeds[index], terminated[index], truncated[index])
            for index in ended_indices
        ]
        count = int(is_playing.sum())
        for index in ended_indices:
            playing_seeds[index] = next(remaining_seeds, None)
            is_playing[index] = playing_seeds[index] is not None
        starting_indices = [index for index in ended_indices if is_playing[index]]
        if starting_indices:
            mask = np.zeros(num_envs, bool)
            mask[starting_indices] = True
            observations, _ = environment.reset(seed=playing_seeds, options={"reset_mask": mask})
            policy.reset(starting_indices, [playing_seeds[index] for index in starting_indices])
            for index in starting_indices:
                recording.begin(index, observations)
        if len(starting_indices) < len(ended_indices):
            environment.rest(~is_playing)
        yield Step(count, finished_episodes)


class _Recording:
    """Arrays of the present episodes of all environments, which steps fill."""

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
        """Record a step of all environments; those without an episode overwrite their last step."""
        if self._terms is None:
            self._terms = {name: np.empty_like(self._rewards) for name in terms}
        steps = np.minimum(self._clock, self._last)
        self._actions[self._indices, steps] = actions
        self._rewards[self._indices, steps] = rewards
        for name, term in terms.items():
            self._terms[name][self._indices, steps] = term
        self._clock += 1
        self._observations[self._indices, np.minimum(self._clock, self._last + 1)] = observations

    def episode(self, index: int, seed: int, terminated: bool, truncated: bool) -> Episode:
        """Return a copy of the episode that the latest step has ended in an environment."""
        length = self._clock[index]
        is_last_step = np.arange(1, length + 1) == length
        return Episode(
            seed=seed,
            preset=None,
            observations=self._observations[index, : length + 1].copy(),
            actions=self._actions[index, :length].copy(),
            rewards=self._rewards[index, :length].copy(),
            terminations=is_last_step & terminated,
            truncations=is_last_step & truncated,
            terms={name: term[index, :length].copy() for name, term in self._terms.items()},
        )
