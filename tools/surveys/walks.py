"""The walks of a survey: they are played in several processes, assessed and counted."""

import collections
import functools
import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from dm_control.rl import control
from tqdm import tqdm

from arc_suite.cpg import Demonstrator, suited_preset
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import protocol, walking
from arc_suite.simulation.episode_loop import play_episode

NEAR_TARGET = 0.9  # of the target speed: bodies that reach it are counted, too


class Case(NamedTuple):
    """One walk of a survey.

    Attributes:
        setup: a body in a kind of walk, whose settings have a `time_limit`.
        seed: seed of the initial pose.
    """

    setup: Setup
    seed: int = 0


class Outcome(NamedTuple):
    """The result of a walk.

    Attributes:
        case: the walk.
        speed: as a share of the target speed; see `walking.shares`.
        drift: displacement to the side of the target's direction, as a share of the target path.
        touching: share of the time that the torso touched the ground.
        failures: reasons why it does not count as walking; empty if it does.
    """

    case: Case
    speed: float
    drift: float
    touching: float
    failures: tuple[str, ...]

    @property
    def legs(self) -> int:
        """Number of legs."""
        return len(self.case.setup.body.legs)

    @property
    def links(self) -> int:
        """Number of links of a leg."""
        return len(self.case.setup.body.legs[0].joints)


def play(case: Case) -> tuple[control.Environment, walking.Verdict]:
    """Play the walk of one body by the demonstrator that suits the task.

    Returns:
        The environment after the walk, and the verdict on the walk.

    Raises:
        ValueError: a task without a target velocity or command.
    """
    environment = case.setup.load(case.seed)
    task = environment.task.definition
    demonstrator = Demonstrator(environment, suited_preset(task))
    watcher = walking.WalkWatcher(environment)
    try:
        for timestep in play_episode(environment, demonstrator):
            watcher(timestep)
            if watcher.ending != walking.TIME:
                break
    except control.PhysicsError:
        watcher.note_divergence()
    return environment, watcher.verdict(task.step_limit)


def run(case: Case) -> Outcome:
    """Play the walk of one body and assess it."""
    environment, verdict = play(case)
    environment.close()
    return Outcome(case, verdict.speed, abs(verdict.drift), verdict.touching, verdict.failures)


def survey(cases: Sequence[Case], processes: int | None = None, progress: Callable = tqdm) -> Iterator[Outcome]:
    """Run many cases.

    Args:
        cases: cases to run.
        processes: processes to run them on, at most one for each; None for one per core.
        progress: makes a progress bar as `tqdm` does.

    Yields:
        The outcomes, in the order of the cases.

    Raises:
        ValueError: a walk that need not end, or a setting that does not fit.
    """
    for case in cases:
        protocol.check_ends(case.setup.task_kwargs["time_limit"])
    progress = functools.partial(progress, total=len(cases), unit="body", desc="walk")
    if processes == 1:
        yield from progress(map(run, cases))
        return
    # Spawned, not forked: a fork would share whatever OpenGL or threads the caller has open.
    with multiprocessing.get_context("spawn").Pool(processes and min(processes, len(cases))) as pool:
        yield from progress(pool.imap(run, cases))


def table(outcomes: Sequence[Outcome]) -> str:
    """Return a table of the bodies that walked and their median speed as a share of the target, by legs and links."""
    links = sorted({outcome.links for outcome in outcomes})
    heads = [f"{count} link" if count == 1 else f"{count} links" for count in links]
    lines = ["legs " + "".join(f"{head:>18}" for head in (*heads, "all"))]
    for legs in sorted({outcome.legs for outcome in outcomes}):
        lines.append(_line(str(legs), [outcome for outcome in outcomes if outcome.legs == legs], links))
    lines.append(_line("all", outcomes, links))
    return "\n".join(lines)


def _line(head: str, outcomes: Sequence[Outcome], links: Sequence[int]) -> str:
    """Return a line of the table: a cell for each number of links, and one for all."""
    cells = [_cell([outcome for outcome in outcomes if outcome.links == count]) for count in links]
    return f"{head:>4} " + "".join([*cells, _cell(outcomes)])


def _cell(outcomes: Sequence[Outcome]) -> str:
    if not outcomes:
        return f"{'-':>18}"
    share = f"{_count_walking(outcomes)}/{len(outcomes)}"
    median_speed = np.median([outcome.speed for outcome in outcomes])
    return f"{share:>11}{median_speed:>7.2f}"


def _count_walking(outcomes: Sequence[Outcome]) -> int:
    return sum(not outcome.failures for outcome in outcomes)


def summary(outcomes: Sequence[Outcome]) -> str:
    """Return a survey in a few lines of text."""
    walking = _count_walking(outcomes)
    reasons = collections.Counter(reason for outcome in outcomes for reason in outcome.failures)
    reasons_text = ", ".join(f"{name} {count}" for name, count in reasons.items()) or "none"
    share_near_target = np.mean([outcome.speed >= NEAR_TARGET for outcome in outcomes])
    speed = np.median([outcome.speed for outcome in outcomes])
    drift = np.median([outcome.drift for outcome in outcomes])
    return (
        f"{walking} of {len(outcomes)} bodies walk ({100.0 * walking / len(outcomes):.1f} %)\n"
        f"failures: {reasons_text}\n"
        f"{100.0 * share_near_target:.1f} % reach {NEAR_TARGET} of the target speed; "
        f"median speed {speed:.2f} of it, median drift {drift:.2f}"
    )
