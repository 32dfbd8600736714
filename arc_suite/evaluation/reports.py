"""Evaluation of a policy in a setup: `evaluate` plays the episodes, and a report holds and prints their results."""

import functools
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from tqdm import tqdm

from arc_suite import checks, policies
from arc_suite.cpg import suited_preset
from arc_suite.envs.dm import Environment
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors, protocol, provenance, statistics, task_results
from arc_suite.evaluation.protocol import CURVE_EPISODES, EPISODES, EpisodeResult
from arc_suite.evaluation.statistics import Summary
from arc_suite.policies import Policy, PolicyFunction
from arc_suite.robots.spec import Body

# Columns that every task has, with their widths; the last one only for the paper's demonstrator.
_WIDTHS = (18, 9, 7, 26, 9, 12)
_HEADS = ("return +- std", "zero", "score", "IQM [95 % interval]", "steps", "paper's cpg")
MIN_LABEL_WIDTH = 12  # of the first column
_MIN_EPISODES = 10  # of a printed interval: that of five episodes holds the expected value in 90 % of all cases
# Shares of the target's distance, or of the command, that a policy achieves: the first that a task has counts.
_ACHIEVEMENTS = ("distance", "tracking")
_LEAST_ACHIEVEMENT = 0.5  # below it, a score of at least _HIGH_SCORE has a caution
_HIGH_SCORE = 0.5
_bar = functools.partial(tqdm, unit="episode", leave=False)


class Player(NamedTuple):
    """A policy with an environment in which it is evaluated.

    Attributes:
        setup: setup of the environment.
        policy: made for one environment.
        environment: environment of the setup.
        preset: preset of the demonstrator; None for another policy.
    """

    setup: Setup
    policy: Policy
    environment: Environment
    preset: str | None


class Report(NamedTuple):
    """Results of a policy in a setup. As text it is the table of `arc-suite evaluate`.

    Attributes:
        setup: setup of the episodes.
        preset: preset of the demonstrator; None for another policy.
        returns: over the episodes.
        zero: mean return of standing still.
        score: 0 for standing still, 1 for the best demonstrator; None where `flaw` says why there is none.
        length: control steps.
        progress: the task's metrics by name.
        paper_return: return of the paper's demonstrator; None for other setups than the paper's.
        episodes: all episodes, in the order of their seeds.
        scale: returns that have the scores 0 and 1.
    """

    setup: Setup
    preset: str | None
    returns: Summary
    zero: float
    score: float | None
    length: Summary
    progress: Mapping[str, Summary]
    paper_return: float | None
    episodes: Sequence[EpisodeResult]
    scale: anchors.Anchors

    @property
    def flaw(self) -> str:
        """Why returns have no scores; "" where they have: see `anchors.Anchors.flaw`."""
        return self.scale.flaw

    @property
    def caution(self) -> str:
        """Why a high score does not mean that the policy does the task; "" for another one."""
        metric = next((name for name in _ACHIEVEMENTS if name in self.progress), None)
        if metric is None or self.score is None or self.score < _HIGH_SCORE:
            return ""
        achievement = self.progress[metric].mean
        if achievement >= _LEAST_ACHIEVEMENT:
            return ""
        scores = f"score {self.score:.2f} with {metric} {achievement:.2f}"
        meaning = "score 1 is the return of the best demonstrator"
        if self.preset == self.scale.preset:
            return f"{scores}: {meaning}, which is this one"
        cure = f"see --policy cpg --preset {self.scale.preset}"
        return f"{scores}: {meaning}, {self.scale.preset}, whose {metric} may be as low: {cure}"

    @property
    def of_the_paper(self) -> bool:
        """Whether the paper's demonstrator was evaluated; then the table ends with the return in the paper."""
        return self.paper_return is not None and self.preset == "medium"

    @property
    def label(self) -> str:
        """The body, and the preset if there is one."""
        return label(self.setup, self.preset)

    def heading(self, width: int = MIN_LABEL_WIDTH) -> str:
        """Return the heading of the table, given the width of the first column."""
        heads = _HEADS if self.of_the_paper else _HEADS[:-1]
        return _line("robot".ljust(width), {name: name for name in self.progress}, heads)

    def line(self, width: int = MIN_LABEL_WIDTH) -> str:
        """Return the row of the table, given the width of the first column."""
        low, high = self.returns.interval
        interval = f"[{low:.1f}, {high:.1f}]" if self.returns.episodes >= _MIN_EPISODES else "[-]"
        cells = [
            f"{self.returns.mean:.1f} +- {self.returns.deviation:.1f}",
            f"{self.zero:.1f}",
            "-" if self.score is None else f"{self.score:z.2f}",
            f"{self.returns.iqm:.1f} {interval}",
            f"{self.length.mean:.1f}",
        ]
        if self.of_the_paper:
            cells.append(f"{self.paper_return:.0f}")
        metrics = {name: f"{summary.mean:.3f}" for name, summary in self.progress.items()}
        return _line(self.label.ljust(width), metrics, cells)

    def __str__(self) -> str:
        width = max(MIN_LABEL_WIDTH, len(self.label))
        return f"{self.heading(width)}\n{self.line(width)}"

    def to_json(self) -> dict[str, Any]:
        """Return the entry of a robot in the file of `arc-suite evaluate --json`."""
        values = {
            "provenance": provenance.of_setup(self.setup),
            "preset": self.preset,
            "zero_return": self.zero,
            "paper_return": self.paper_return,
            "return": self.returns,
            "score": self.score,
            "no_score": self.flaw,
            "anchors": {field: getattr(self.scale, field) for field in ("zero", "demonstrator", "preset")},
            "length": self.length,
        }
        # No metric takes the place of another value.
        return {**values, **self.progress, **values, "episodes": self.episodes}


def evaluate(
    policy: str | os.PathLike[str] | Policy | PolicyFunction = "cpg",
    robot: str | Body | None = None,
    task: str | None = None,
    *,
    task_kwargs: Mapping[str, Any] | None = None,
    preset: str | None = None,
    episodes: int = EPISODES,
    seed: int = 0,
    progress: Callable[[Iterable[int]], Iterable[int]] = _bar,
) -> Report:
    """Evaluate a policy over seeded episodes, as `arc-suite evaluate` does.

    Args:
        policy: a name or a path, see `policies.policy`; a policy for one environment, such as
            `arc_suite.learning.train` returns; or a function of a `TimeStep` with named blocks.
        robot: a body; None for that of a trained policy.
        task: its name; None for that of a trained policy, the first of several, with its settings, which
            `task_kwargs` change, or walk.
        task_kwargs: see `arc_suite.load`.
        preset: preset of the demonstrator; None for the one that suits task and body.
        episodes: number of episodes.
        seed: seed of the first episode; the others count on from it.
        progress: wraps the seeds.

    Raises:
        ValueError: no robot, an unknown name, a value out of range, or a policy that was trained in these episodes.
        OSError: a file that cannot be read.
    """
    seeds = range(checks.seed(seed), checks.seed(seed + checks.integer("episodes", episodes, 1) - 1) + 1)
    setup_of_policy = policies.setup_of(policy)
    if setup_of_policy is not None:
        setup_of_policy = setup_of_policy.judging()
    if robot is None:
        if setup_of_policy is None:
            policies.refuse_other_words(policy, policies.POLICIES)
            raise ValueError("robot: expected a body, as the policy brings none")
        if setup_of_policy.several:
            raise ValueError(f"robot: expected a body, as the policy learned on several: {setup_of_policy}")
        robot = setup_of_policy.body
    settings = dict(task_kwargs or {})
    if task is None and setup_of_policy is not None:
        task = setup_of_policy.tasks[0]
        settings = setup_of_policy.task_kwargs | settings
    setup = Setup.of(robot, task or "walk", settings)
    provenance.training_seeds(policy, seeds)
    return report(player(policy, setup, preset), seeds, progress)


def player(policy: str | os.PathLike[str] | Policy | PolicyFunction, setup: Setup, preset: str | None = None) -> Player:
    """Open the environment of a setup and make a policy for it; for the arguments see `evaluate`.

    Raises:
        ValueError: as `evaluate`.
        OSError: as `evaluate`.
    """
    policies.check_preset(policy, preset)
    task_results.check_results_of_others(setup)
    environment = setup.load()
    if policy == "cpg" and preset is None:
        preset = suited_preset(environment.task.definition)
    acting_policy = policies.acting(policy, environment.task.definition, preset)
    return Player(setup, acting_policy, environment, preset if policy == "cpg" else None)


def report(
    evaluated: Player, seeds: Sequence[int], progress: Callable[[Iterable[int]], Iterable[int]] = iter
) -> Report:
    """Play an episode for each seed, and return their results.

    Args:
        evaluated: the policy and its environment.
        seeds: seeds of the episodes.
        progress: wraps the seeds.

    Raises:
        ValueError: episodes that need not end.
    """
    setup, policy, environment, preset = evaluated
    episodes = protocol.episodes(environment, policy, progress(seeds))
    returns = statistics.summary([episode.total for episode in episodes])
    first_seeds = seeds[:CURVE_EPISODES]
    anchor_returns = anchors.committed_returns(setup)
    if anchor_returns is None:
        scale = anchors.of_returns(anchors.measure_returns(setup, len(first_seeds), first_seeds[0]))
        zero = scale.zero
    else:
        scale = anchors.of_returns(anchor_returns, seeds)
        zero = float(anchors.play_returns(setup, anchors.ZERO, first_seeds).mean())
    score = float(scale.score(returns.mean))
    metrics = episodes[0].progress
    return Report(
        setup=setup,
        preset=preset,
        returns=returns,
        zero=zero,
        score=score if math.isfinite(score) else None,
        length=statistics.summary([episode.length for episode in episodes]),
        progress={name: statistics.summary([episode.progress[name] for episode in episodes]) for name in metrics},
        paper_return=protocol.paper_return(setup),
        episodes=episodes,
        scale=scale,
    )


def label(setup: Setup, preset: str | None) -> str:
    """Return the label of a row: the body, and the preset if there is one."""
    return setup.name if preset is None else f"{setup.name}, {preset}"


def _line(first: str, metrics: Mapping[str, str], cells: Iterable[str]) -> str:
    """Return a line of the table: the first cell, metrics of the task by name, and cells that every task has."""
    metric_cells = [f"{cell:>{max(len(name), 6)}}" for name, cell in metrics.items()]
    common_cells = [f"{cell:>{width}}" for cell, width in zip(cells, _WIDTHS, strict=False)]
    return " ".join([first, *metric_cells, *common_cells])
