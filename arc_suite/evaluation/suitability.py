"""How well the presets that suit a task walk a body in it."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite.cpg.selection import obedient_presets, suited_presets
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors
from arc_suite.robots.spec import Body
from arc_suite.tasks import TASKS

SEEDS = range(500, 508)  # no demonstrator was tuned on these episodes
# Names of metrics. A trial has the first of them that its task has.
METRICS = ("goals", "tracking", "speed", "joint_error", "up")
MAX_SHORTFALL = 0.05  # of a default preset, as a share of what the best preset gains over standing still


class Trial(NamedTuple):
    """Episodes of a policy in a task.

    Attributes:
        task: name of the task.
        preset: name of the demonstrator's preset; `zero` for standing still.
        mean_return: over the episodes.
        metric: name of the task's metric; see `METRICS`.
        value: mean of the metric at the end of the episodes.
        upright: number of episodes without a fall.
        episodes: number of episodes.
    """

    task: str
    preset: str
    mean_return: float
    metric: str
    value: float
    upright: int
    episodes: int


def try_defaults(body: Body, seeds: Sequence[int], steps: int) -> Iterator[Trial]:
    """Yield a trial of each task of the suite by the preset that suits it best; tasks without one are left out.

    Args:
        body: any body.
        seeds: seeds of the episodes.
        steps: control steps of an episode, at most.

    Raises:
        ValueError: a body that no demonstrator can walk.
    """
    for task in TASKS:
        setup = Setup.of(body, task)
        names = suited_presets(setup.definition)
        if names:
            yield try_preset(setup, names[0], seeds, steps)


def try_presets(body: Body, task: str, seeds: Sequence[int], steps: int) -> list[Trial]:
    """Return trials of all presets of a body that obey the commands of a task, the default first.

    Args:
        body: any body.
        task: name of a task.
        seeds: seeds of the episodes.
        steps: control steps of an episode, at most.

    Raises:
        ValueError: a task that no preset suits, or a body that no demonstrator can walk.
    """
    setup = Setup.of(body, task)
    return [try_preset(setup, name, seeds, steps) for name in obedient_presets(setup.definition)]


def try_preset(setup: Setup, preset: str, seeds: Sequence[int], steps: int) -> Trial:
    """Return a trial of a preset, or of standing still, `zero`; see `try_presets`."""
    has_fallen = np.zeros(len(seeds), bool)

    def note_falls(is_playing, is_falling):
        has_fallen[is_falling] = True

    results = anchors.play_episodes(setup, preset, seeds, steps, note_falls)
    metrics = results[0].progress
    metric = next(name for name in METRICS if name in metrics)
    return Trial(
        task=setup.kind.name,
        preset=preset,
        mean_return=float(np.mean([result.total for result in results])),
        metric=metric,
        value=float(np.mean([result.progress[metric] for result in results])),
        upright=int((~has_fallen).sum()),
        episodes=len(results),
    )


def shortfall(trials: Sequence[Trial], standing: Trial) -> float:
    """Return how much less the first of several trials gains than the best, as a share of what the best gains.

    Args:
        trials: trials of presets, the default first.
        standing: trial of standing still; gains are those over its return.
    """
    gains = [trial.mean_return - standing.mean_return for trial in trials]
    best = max(gains)
    return (best - gains[0]) / best if best > 0.0 else 0.0


def stand_still(body: Body, task: str, seeds: Sequence[int], steps: int) -> Trial:
    """Return a trial of standing still."""
    return try_preset(Setup.of(body, task), anchors.ZERO, seeds, steps)
