"""The loop that plays an episode in one environment: every return, track, recording, film and live view takes it.

Loops over batches are others: `evaluation.episodes_in_batch` stops environments that have ended, `data.rollouts` starts
their next seeds, and learners never stop.
"""

from collections.abc import Callable, Iterator

import numpy as np


def play_episode(
    environment, act: Callable[..., np.ndarray], seed: int | None = None, max_steps: int | None = None
) -> Iterator:
    """Play one episode, a control step whenever the next one is asked for.

    Meanwhile the environment stands still: who watches may read it, set commands or apply forces.

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
