"""The walks of a survey: they are played in several processes, assessed and counted."""

import collections
import functools
import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from dm_control.rl import control
from tqdm import tqdm

from arc_suite import rotations
from arc_suite.cpg import Demonstrator, suited_preset
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import protocol, walking

NEAR_TARGET = 0.9  # of the target speed: bodies that reach it are counted, too


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


class Trajectory(NamedTuple):
    """The torso in a walk that lasted n control steps.

    Attributes:
        steps: of the whole walk.
        places: (n + 1, 3) x and y, m, and yaw, rad.
        targets: (n, 2) target displacements, m.
        touching: (n + 1,) whether the torso touches the ground.
        ending: "time" at the time limit, else "fall" or "divergence".
    """

    steps: float
    places: np.ndarray
    targets: np.ndarray
    touching: np.ndarray
    ending: str


def play(case: Case) -> tuple[control.Environment, Trajectory]:
    """Play the walk of one body by the demonstrator that suits the task.

    Returns:
        The environment as the walk left it, and the walk.

    Raises:
        ValueError: a task without a target velocity or command.
    """
    environment = case.setup.load(case.seed)
    task, data = environment.task.definition, environment.physics.data.ptr
    demonstrator = Demonstrator(environment, suited_preset(task))
    shapes = [environment.physics.model.name2id(solid.name, "geom") for solid in case.setup.body.torso.solids]
    step, ending = environment.reset(), "time"
    places, targets, touching = [_place(data)], [], [False]
    try:
        while not step.last() and ending == "time":
            targets.append(walking.target(task, step.observation, places[-1]))
            step = environment.step(demonstrator(step))
            places.append(_place(data))
            touching.append(bool(np.isin(data.contact.geom, shapes).any()))
            if step.discount == 0.0 or rotations.upright(data.qpos[3:7]) < walking.MOST_TILT_COSINE:
                ending = "fall"
    except control.PhysicsError:
        ending = "divergence"
        places.append(places[-1])
    return environment, Trajectory(task.step_limit, *map(np.array, (places, targets, touching)), ending)


def _place(data) -> np.ndarray:
    return np.array((*data.qpos[:2], rotations.yaw(data.qpos[3:7])))


def assess(case: Case, trajectory: Trajectory) -> Outcome:
    """Return whether a trajectory is a walk, and if not, why; see `walking.failures`."""
    moved, touching = np.diff(trajectory.places[:, :2], axis=0), float(trajectory.touching.mean())
    speed, drift = walking.shares(trajectory.targets, moved, trajectory.steps)
    return Outcome(case, speed, abs(drift), touching, walking.failures(speed, touching, trajectory.ending))


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
    """Return a table of the bodies that walked and their median speed as a share of the target, by legs and links."""
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
    return f"{f'{walked}/{len(outcomes)}':>11}{np.median([outcome.speed for outcome in outcomes]):>7.2f}"


def summary(outcomes: Sequence[Outcome]) -> str:
    """Return a survey in a few lines of text."""
    walked = sum(not outcome.failures for outcome in outcomes)
    reasons = collections.Counter(reason for outcome in outcomes for reason in outcome.failures)
    fast = np.mean([outcome.speed >= NEAR_TARGET for outcome in outcomes])
    speed, drift = (np.median([getattr(outcome, name) for outcome in outcomes]) for name in ("speed", "drift"))
    return (
        f"{walked} of {len(outcomes)} bodies walk ({100.0 * walked / len(outcomes):.1f} %)\n"
        f"failures: {', '.join(f'{name} {count}' for name, count in reasons.items()) or 'none'}\n"
        f"{100.0 * fast:.1f} % reach {NEAR_TARGET} of the target speed; "
        f"median speed {speed:.2f} of it, median drift {drift:.2f}"
    )
