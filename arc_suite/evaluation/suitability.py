"""How well the presets that suit a task walk a body in it."""

import warnings
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
_GOT_UP = "up"  # metric of tasks in which a body begins on the ground
METRICS = ("goals", "tracking", "speed", "joint_error", _GOT_UP)
_METRIC_TEXTS = {
    "goals": "{:.2f} goals an episode",
    "tracking": "tracking {:.2f} of 1",
    "speed": "{:.2f} m/s",
    "joint_error": "joints off by {:.2f} rad",
}
MAX_SHORTFALL = 0.05  # of a default preset, as a share of what the best preset gains over standing still


class Trial(NamedTuple):
    """Episodes of a policy in a task.

    Attributes:
        task: name of the task.
        preset: name of the demonstrator's preset; `zero` for standing still.
        mean_return: over the episodes.
        metric: name of the task's metric; see `METRICS`.
        value: mean of the metric at the end of the episodes.
        upright: number of episodes without a fall; where bodies begin on the ground, of those in which it got up.
        episodes: number of episodes.
        warnings: texts of what the preset and the task warned of.
    """

    task: str
    preset: str
    mean_return: float
    metric: str
    value: float
    upright: int
    episodes: int
    warnings: tuple[str, ...] = ()

    def describe(self) -> str:
        """Return the metric, and how many episodes ended well."""
        if self.metric == _GOT_UP:
            return f"{self.upright} of {self.episodes} got up"
        return f"{_METRIC_TEXTS[self.metric].format(self.value)}, {self.upright} of {self.episodes} without a fall"


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
    """Return a trial of a preset, or of standing still, `zero`; see `try_presets`. Its warnings are not shown."""
    has_fallen = np.zeros(len(seeds), bool)

    def note_falls(is_playing, is_falling):
        has_fallen[is_falling] = True

    with warnings.catch_warnings(record=True) as caught_warnings:
        results = anchors.play_episodes(setup, preset, seeds, steps, note_falls)
    metrics = results[0].progress
    metric = next((name for name in METRICS if name in metrics), None)
    if metric is None:
        measures = ", ".join(metrics) or "none"
        raise ValueError(f"task {setup.kind.name}: expected one of the metrics {', '.join(METRICS)}, got {measures}")
    is_upright = ~has_fallen
    if metric == _GOT_UP:
        is_upright = np.array([result.progress[metric] > 0.0 for result in results])
    return Trial(
        task=setup.kind.name,
        preset=preset,
        mean_return=float(np.mean([result.total for result in results])),
        metric=metric,
        value=float(np.mean([result.progress[metric] for result in results])),
        upright=int(is_upright.sum()),
        episodes=len(results),
        warnings=tuple(dict.fromkeys(str(warning.message) for warning in caught_warnings)),
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
