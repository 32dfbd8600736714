"""The loop that plays an episode in one environment: every return, track, recording, film and live view uses it.

Batches have other loops: `evaluation.episodes_in_batch` stops environments whose episode has ended, `data.rollouts`
starts the next seed in them, and learners never stop.
"""

from collections.abc import Callable, Iterator

import numpy as np


def play_episode(
    environment, act: Callable[..., np.ndarray], seed: int | None = None, max_steps: int | None = None
) -> Iterator:
    """Play one episode; the generator advances by a control step whenever its next item is asked for.

    Between items the environment stands still: the caller may read it, set commands or apply forces.

    Args:
        environment: environment of `arc_suite.load`.
        act: maps a `TimeStep` to an action.
        seed: seed of the episode's start; None for the environment's next episode.
        max_steps: control steps after which to stop; None plays to the end.

    Yields:
        The `TimeStep` of the reset and of every control step.
    """
    timestep = environment.reset(seed)
    yield timestep
    steps = 0
    while not timestep.last() and steps != max_steps:
        timestep = environment.step(act(timestep))
        steps += 1
        yield timestep
