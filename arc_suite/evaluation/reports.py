"""What a policy is worth in a setup: `evaluate` plays the episodes, and a report holds and prints what they say."""

import functools
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from tqdm import tqdm

from arc_suite import checks, policies
from arc_suite.cpg import suited_preset
from arc_suite.envs.dm import Environment
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors, protocol, provenance, statistics
from arc_suite.evaluation.protocol import CURVE_EPISODES, EPISODES, EpisodeResult
from arc_suite.evaluation.statistics import Summary
from arc_suite.policies import Policy
from arc_suite.robots.spec import Body

_WIDTHS = (18, 9, 7, 26, 9, 12)  # of the columns that every task has
_HEADS = ("return", "zero", "score", "IQM [95 % interval]", "steps", "paper's cpg")
_bar = functools.partial(tqdm, unit="episode", leave=False)
LABEL = 12  # least width of the first column


class Player(NamedTuple):
    """A policy at the start of its episodes.

    Attributes:
        setup: that it plays in.
        policy: made for one environment.
        environment: of the setup.
        preset: of the demonstrator; None for another policy.
    """

    setup: Setup
    policy: Policy
    environment: Environment
    preset: str | None


class Report(NamedTuple):
    """What a policy is worth in a setup. As text it is the table of `arc-suite evaluate`.

    Attributes:
        setup: that it has played in.
        preset: of the demonstrator; None for another policy.
        returns: over the episodes.
        zero: mean return of standing still.
        score: 0 for standing still, 1 for the best demonstrator; None outside the places of the benchmark.
        length: control steps.
        progress: the task's metrics by name.
        expert: what the paper's demonstrator earns; None for other setups than the paper's.
        episodes: all of them, in the order of their seeds.
    """

    setup: Setup
    preset: str | None
    returns: Summary
    zero: float
    score: float | None
    length: Summary
    progress: Mapping[str, Summary]
    expert: float | None
    episodes: Sequence[EpisodeResult]

    @property
    def of_the_paper(self) -> bool:
        """Whether the paper's demonstrator has played, so that the table ends with the paper's return."""
        return self.expert is not None and self.preset == "medium"

    @property
    def label(self) -> str:
        """The body, and the preset if there is one."""
        return label(self.setup, self.preset)

    def heading(self, width: int = LABEL) -> str:
        """Return the heading of the table; the first column has a width."""
        shown = _HEADS if self.of_the_paper else _HEADS[:-1]
        return _line("robot".ljust(width), {name: name for name in self.progress}, shown)

    def line(self, width: int = LABEL) -> str:
        """Return the row of the table; the first column has a width."""
        low, high = self.returns.interval
        cells = [
            f"{self.returns.mean:.1f} +- {self.returns.deviation:.1f}",
            f"{self.zero:.1f}",
            "-" if self.score is None else f"{self.score:z.2f}",
            f"{self.returns.iqm:.1f} [{low:.1f}, {high:.1f}]",
            f"{self.length.mean:.1f}",
        ]
        own = {name: f"{summary.mean:.3f}" for name, summary in self.progress.items()}
        return _line(self.label.ljust(width), own, cells + ([f"{self.expert:.0f}"] if self.of_the_paper else []))

    def __str__(self) -> str:
        width = max(LABEL, len(self.label))
        return f"{self.heading(width)}\n{self.line(width)}"

    def to_json(self) -> dict[str, Any]:
        """Return what `arc-suite evaluate --json` holds of a robot."""
        return {
            "provenance": provenance.of_setup(self.setup),
            "preset": self.preset,
            "zero_return": self.zero,
            "expert_return": self.expert,
            "return": self.returns,
            "score": self.score,
            "length": self.length,
            **self.progress,
            "episodes": self.episodes,
        }


def evaluate(
    policy: str | os.PathLike | Policy | Callable = "cpg",
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
        task: its name; None for that of a trained policy with its settings, which `task_kwargs` change, or walk.
        task_kwargs: see `arc_suite.load`.
        preset: of the demonstrator; None for the one that suits task and body.
        episodes: how many.
        seed: of the first episode; the others count on from it.
        progress: wraps the seeds.

    Raises:
        ValueError: no robot, an unknown name, a value out of range, or a policy that has learned from these episodes.
        OSError: a file that cannot be read.
    """
    seeds = range(checks.seed(seed), checks.seed(seed + checks.integer("episodes", episodes, 1) - 1) + 1)
    own = policies.setup_of(policy)
    own = own and own.judging()
    if robot is None and (own is None or own.several):
        raise ValueError("robot: expected a body, as the policy brings none")
    settings = dict(task_kwargs or {})
    if own is not None and task is None:
        task, settings = own.task, own.task_kwargs | settings
    setup = Setup.of(own.body if robot is None else robot, task or "walk", settings)
    provenance.training_seeds(policy, seeds)
    return report(player(policy, setup, preset), seeds, progress)


def player(policy: str | os.PathLike | Policy | Callable, setup: Setup, preset: str | None = None) -> Player:
    """Open the environment of a setup and make a policy for it; for the arguments see `evaluate`.

    Raises:
        ValueError: as `evaluate`.
        OSError: as `evaluate`.
    """
    environment = setup.load()
    if policy == "cpg" and preset is None:
        preset = suited_preset(environment.task.definition)
    made = policies.acting(policy, environment.task.definition, preset)
    return Player(setup, made, environment, preset if policy == "cpg" else None)


def report(played: Player, seeds: Sequence[int], progress: Callable[[Iterable[int]], Iterable[int]] = iter) -> Report:
    """Play an episode for each seed and return what they say.

    Args:
        played: the policy.
        seeds: of the episodes.
        progress: wraps the seeds.

    Raises:
        ValueError: episodes that need not end.
    """
    setup, policy, environment, preset = played
    found = protocol.episodes(environment, policy, progress(seeds))
    known = anchors.known(setup)
    returns = statistics.summary([episode.total for episode in found])
    return Report(
        setup=setup,
        preset=preset,
        returns=returns,
        zero=float(anchors.played(setup, anchors.ZERO, seeds[:CURVE_EPISODES]).mean()),
        score=None if known is None else float(anchors.of_returns(known).score(returns.mean)),
        length=statistics.summary([episode.length for episode in found]),
        progress={name: statistics.summary([each.progress[name] for each in found]) for name in found[0].progress},
        expert=protocol.expert_return(setup),
        episodes=found,
    )


def label(setup: Setup, preset: str | None) -> str:
    """Return how a table names a body, and the preset if there is one."""
    return setup.body.name if preset is None else f"{setup.body.name}, {preset}"


def _line(first: str, metrics: Mapping[str, str], cells: Iterable[str]) -> str:
    """Return a line of the table: the first cell, the task's own metrics by name, and cells that every task has."""
    own = [f"{cell:>{max(len(name), 6)}}" for name, cell in metrics.items()]
    return " ".join([first, *own, *(f"{cell:>{width}}" for cell, width in zip(cells, _WIDTHS, strict=False))])
