"""A robustness survey: the demonstrators of random bodies walk, and each walk is assessed."""

import collections
import functools
import math
import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from dm_control.rl import control
from tqdm import tqdm

from arc_suite import rotations
from arc_suite.cpg import Demonstrator
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import protocol
from arc_suite.evaluation.first_walk import MOST_TILT_COSINE
from arc_suite.models.sizing import GRAVITY
from arc_suite.robots.spec import Body

_LEAST_FROUDE = 0.02  # of progress; below it a body does not walk
_MOST_TOUCHING = 0.01  # share of the time that the torso may touch the ground


class Case(NamedTuple):
    """One walk of a survey.

    Attributes:
        setup: a body in a kind of walk, whose settings have a `time_limit`.
        seed: of the initial pose.
    """

    setup: Setup
    seed: int = 0


class Outcome(NamedTuple):
    """The result of a walk.

    Attributes:
        case: the walk.
        froude: mean forward speed in units of sqrt(g h).
        lengths: forward displacement in body lengths.
        drift: sideways displacement as a share of the forward one.
        touching: share of the time that the torso touched the ground.
        failures: reasons why it does not count as walking; empty if it does.
    """

    case: Case
    froude: float
    lengths: float
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


class Trajectory(NamedTuple):
    """The torso in a walk; leading axis: control steps, the start included.

    Attributes:
        positions: (n, 2) m, x and y.
        touching: (n,) whether the torso touches the ground.
        ending: "time" at the time limit, else "fall" or "divergence".
    """

    positions: np.ndarray
    touching: np.ndarray
    ending: str


def play(case: Case) -> tuple[control.Environment, Trajectory]:
    """Play the walk of one body.

    Returns:
        The environment as the walk left it, and the walk.
    """
    environment = case.setup.load(case.seed)
    demonstrator = Demonstrator(environment, "medium")
    data = environment.physics.data.ptr
    shapes = [environment.physics.model.name2id(solid.name, "geom") for solid in case.setup.body.torso.solids]
    step, ending = environment.reset(), "time"
    positions, touching = [data.qpos[:2].copy()], [False]
    try:
        while not step.last() and ending == "time":
            step = environment.step(demonstrator(step))
            positions.append(data.qpos[:2].copy())
            touching.append(bool(np.isin(data.contact.geom, shapes).any()))
            if step.discount == 0.0 or rotations.upright(data.qpos[3:7]) < MOST_TILT_COSINE:
                ending = "fall"
    except control.PhysicsError:
        ending = "divergence"
    return environment, Trajectory(np.array(positions), np.array(touching), ending)


def assess(case: Case, trajectory: Trajectory) -> Outcome:
    """Return whether a trajectory is a walk, and if not, why; see `failures`."""
    body, seconds = case.setup.body, case.setup.task_kwargs["time_limit"]
    apart, touching = trajectory.positions[-1] - trajectory.positions[0], float(trajectory.touching.mean())
    forward, sideways = apart.tolist()
    found = failures(body, apart, seconds, touching, trajectory.ending)
    drift = abs(sideways) / max(abs(forward), 1e-9)
    return Outcome(case, _froude(body, forward, seconds), forward / _length(body), drift, touching, found)


def failures(body: Body, apart: np.ndarray, seconds: float, touching: float, ending: str = "time") -> tuple[str, ...]:
    """Return why a motion is no walk: a fall, dragging, slowness or drift; empty for a walk.

    Args:
        body: that moved, with its standing height.
        apart: (2,) displacement of the torso, m.
        seconds: duration of a whole walk.
        touching: share of the time that the torso touched the ground.
        ending: see `Trajectory`.
    """
    forward, sideways = apart
    found = {
        ending: ending != "time",
        "touch": touching >= _MOST_TOUCHING,
        "slow": not (forward > _length(body) and _froude(body, forward, seconds) > _LEAST_FROUDE),
        "drift": not abs(sideways) < abs(forward),
    }
    return tuple(name for name, failed in found.items() if failed)


def _froude(body: Body, forward: float, seconds: float) -> float:
    return forward / (seconds * math.sqrt(GRAVITY * body.torso.standing_height))


def _length(body: Body) -> float:
    return 2.0 * body.torso.solids[0].size[0]


def run(case: Case) -> Outcome:
    """Play the walk of one body and assess it."""
    environment, trajectory = play(case)
    environment.close()
    return assess(case, trajectory)


def survey(cases: Sequence[Case], processes: int | None = None, progress: Callable = tqdm) -> Iterator[Outcome]:
    """Run many cases.

    Args:
        cases: to run.
        processes: to run them on, at most one for each; None for one per core.
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
    """Return a table of the bodies that walked and their median speed, by legs and links."""
    links = sorted({outcome.links for outcome in outcomes})
    lines = ["legs " + "".join(f"{f'{k} link' + 's' * (k > 1):>18}" for k in links) + f"{'all':>18}"]
    for legs in (*sorted({outcome.legs for outcome in outcomes}), "all"):
        row = [o for o in outcomes if legs in (o.legs, "all")]
        lines.append(f"{legs:>4} " + "".join(_cell([o for o in row if o.links == k]) for k in links) + _cell(row))
    return "\n".join(lines)


def _cell(outcomes: Sequence[Outcome]) -> str:
    if not outcomes:
        return f"{'-':>18}"
    walked = sum(not outcome.failures for outcome in outcomes)
    return f"{f'{walked}/{len(outcomes)}':>11}{np.median([outcome.froude for outcome in outcomes]):>7.3f}"


def summary(outcomes: Sequence[Outcome]) -> str:
    """Return a survey in a few lines of text."""
    walked = sum(not outcome.failures for outcome in outcomes)
    reasons = collections.Counter(reason for outcome in outcomes for reason in outcome.failures)
    speed, drift = (np.median([getattr(outcome, name) for outcome in outcomes]) for name in ("froude", "drift"))
    return (
        f"{walked} of {len(outcomes)} bodies walk ({100.0 * walked / len(outcomes):.1f} %)\n"
        f"failures: {', '.join(f'{name} {count}' for name, count in reasons.items()) or 'none'}\n"
        f"median speed {speed:.3f} sqrt(g h), median drift {drift:.3f}"
    )
