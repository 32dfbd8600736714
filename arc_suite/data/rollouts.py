"""Plays seeded episodes in the rows of a vector environment."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite.data.episodes import Episode
from arc_suite.envs.vector import VectorEnv
from arc_suite.policies import Policy


class Step(NamedTuple):
    """The outcome of one control step of all rows.

    Attributes:
        playing: number of rows that played.
        finished: episodes that ended.
    """

    playing: int
    finished: list[Episode]


def play(environment: VectorEnv, policy: Policy, seeds: Sequence[int], steps: int) -> Iterator[Step]:
    """Play one episode for each seed; a row whose episode ends starts the next one at once.

    An episode depends on its seed and the policy alone, not on rows, threads or its neighbours.
    Actions are rounded to float32 before they are applied, so that the recorded actions are the applied ones.

    Args:
        environment: with at most as many rows as there are seeds.
        policy: made for as many rows.
        seeds: of the episodes, started in this order.
        steps: the most that an episode can have.

    Yields:
        A `Step` for every control step.
    """
    rows = environment.num_envs
    recording = _Recording(environment, steps)
    waiting = iter(seeds)
    seated = [next(waiting) for _ in range(rows)]  # the seed that each row plays, None if it is done
    observations, _ = environment.reset(seed=seated)
    policy.begin(range(rows), seated)
    for row in range(rows):
        recording.begin(row, observations)
    rewards = np.zeros(rows)
    playing = np.ones(rows, bool)
    while playing.any():
        actions = policy.act(environment.task.split(observations), rewards).clip(-1.0, 1.0).astype(np.float32)
        observations, rewards, terminated, truncated, info = environment.step(actions)
        terms = {name: info[f"reward_{name}"] for name in environment.task.settings.weights}
        recording.add(actions, observations, rewards, terms)
        ended = np.flatnonzero((terminated | truncated) & playing)
        finished = [recording.episode(row, seated[row], terminated[row], truncated[row]) for row in ended]
        count = int(playing.sum())
        for row in ended:
            seated[row] = next(waiting, None)
            playing[row] = seated[row] is not None
        starting = [row for row in ended if playing[row]]
        if starting:
            mask = np.zeros(rows, bool)
            mask[starting] = True
            observations, _ = environment.reset(seed=seated, options={"reset_mask": mask})
            policy.begin(starting, [seated[row] for row in starting])
            for row in starting:
                recording.begin(row, observations)
        if len(starting) < len(ended):
            environment.rest(~playing)
        yield Step(count, finished)


class _Recording:
    """Arrays of what happens in the rows: allocated once, filled from step to step."""

    def __init__(self, environment: VectorEnv, steps: int):
        rows = environment.num_envs
        self._rows = np.arange(rows)
        self._clock = np.zeros(rows, int)
        self._last = steps - 1
        self._observations = np.empty((rows, steps + 1, *environment.single_observation_space.shape), np.float32)
        self._actions = np.empty((rows, steps, *environment.single_action_space.shape), np.float32)
        self._rewards = np.empty((rows, steps))
        self._terms = None

    def begin(self, row: int, observations) -> None:
        """Start an episode in a row."""
        self._clock[row] = 0
        self._observations[row, 0] = observations[row]

    def add(self, actions, observations, rewards, terms) -> None:
        """Take down a step of all rows; rows that are done write over their last one."""
        if self._terms is None:
            self._terms = {name: np.empty_like(self._rewards) for name in terms}
        at = self._rows, np.minimum(self._clock, self._last)
        self._actions[at] = actions
        self._rewards[at] = rewards
        for name, term in terms.items():
            self._terms[name][at] = term
        self._clock += 1
        self._observations[self._rows, np.minimum(self._clock, self._last + 1)] = observations

    def episode(self, row: int, seed: int, terminated: bool, truncated: bool) -> Episode:
        """Return a copy of the episode that has just ended in a row."""
        length = self._clock[row]
        ends = np.arange(1, length + 1) == length
        return Episode(
            seed,
            None,
            self._observations[row, : length + 1].copy(),
            self._actions[row, :length].copy(),
            self._rewards[row, :length].copy(),
            ends & terminated,
            ends & truncated,
            {name: term[row, :length].copy() for name, term in self._terms.items()},
        )
