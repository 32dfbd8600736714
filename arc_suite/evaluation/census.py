"""A census of random bodies: their demonstrators walk, and each walk is judged."""

import collections
import functools
import math
import multiprocessing
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from dm_control.rl import control
from tqdm import tqdm

from arc_suite import rotations
from arc_suite.cpg import Demonstrator
from arc_suite.envs.dm import load
from arc_suite.models.sizing import GRAVITY
from arc_suite.robots import generator
from arc_suite.robots.spec import Body

LEAST_FROUDE = 0.02  # of progress; below it a body does not walk
MOST_TOUCHING = 0.01  # share of the time that the torso may touch the ground
MOST_TILT_COSINE = 0.5  # of the torso; tilted by more than 60 degrees a body has fallen


class Trial(NamedTuple):
    """What one walk of a census is to be.

    Attributes:
        seed: of the random body and of its initial pose.
        legs, links: None to draw them too.
        seconds: to walk.
        froude: wanted speed as a share of sqrt(g h); None for the medium one, negative for backwards.
        in_phase: move all legs at once, which no body walks with.
        task: name of the task, which is to be a kind of walk.
        task_kwargs: its settings, as in `arc_suite.load`.
    """

    seed: int
    legs: int | None = None
    links: int | None = None
    seconds: float = 20.0
    froude: float | None = None
    in_phase: bool = False
    task: str = "walk"
    task_kwargs: Mapping[str, Any] = {}

    @property
    def body(self) -> Body:
        """The random body."""
        return generator.random_body(self.seed, self.legs, self.links)


class Outcome(NamedTuple):
    """What became of a walk.

    Attributes:
        trial: what was tried.
        legs, links: of the body.
        froude: mean forward speed as a share of sqrt(g h).
        lengths: progress in body lengths.
        drift: sideways displacement as a share of progress.
        touching: share of the time that the torso touched the ground.
        failures: why it does not count as walking; empty if it does.
    """

    trial: Trial
    legs: int
    links: int
    froude: float
    lengths: float
    drift: float
    touching: float
    failures: tuple[str, ...]


class Course(NamedTuple):
    """The course of the torso in a walk; leading axis: control steps, the start included.

    Attributes:
        positions: (n, 2) m, x and y.
        touching: (n,) whether the torso touches the ground.
        ending: "time" if it lasted as long as it should, or "fall" or "divergence".
    """

    positions: np.ndarray
    touching: np.ndarray
    ending: str


def follow(trial: Trial) -> tuple[control.Environment, Course]:
    """Play the walk of one body.

    Returns:
        The environment as the walk left it, and the walk.
    """
    body = trial.body
    settings = {"time_limit": trial.seconds, "random": trial.seed} | dict(trial.task_kwargs)
    settings |= {"duty_factor": 0.6, "phase_offsets": 0.0} if trial.in_phase else {}
    environment = load(body, trial.task, settings)
    demonstrator = Demonstrator(environment, "medium" if trial.froude is None else trial.froude)
    data = environment.physics.data.ptr
    shapes = [environment.physics.model.name2id(solid.name, "geom") for solid in body.torso.solids]
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
    return environment, Course(np.array(positions), np.array(touching), ending)


def judge(trial: Trial, course: Course) -> Outcome:
    """Return whether a course is a walk, and if not, why: a fall, dragging, slowness or drift."""
    body = trial.body
    forward, sideways = course.positions[-1] - course.positions[0]
    length = 2.0 * body.torso.solids[0].size[0]
    froude = forward / (trial.seconds * math.sqrt(GRAVITY * body.torso.standing_height))
    touching = course.touching.mean()
    failures = {
        course.ending: course.ending != "time",
        "touch": touching >= MOST_TOUCHING,
        "slow": not (forward > length and froude > LEAST_FROUDE),
        "drift": not abs(sideways) < abs(forward),
    }
    return Outcome(
        trial=trial,
        legs=len(body.legs),
        links=len(body.legs[0].joints),
        froude=float(froude),
        lengths=float(forward / length),
        drift=float(abs(sideways) / max(abs(forward), 1e-9)),
        touching=float(touching),
        failures=tuple(name for name, failed in failures.items() if failed),
    )


def attempt(trial: Trial) -> Outcome:
    """Play the walk of one body and judge it."""
    environment, course = follow(trial)
    environment.close()
    return judge(trial, course)


def census(trials: Sequence[Trial], processes: int | None = None, progress: Callable = tqdm) -> Iterator[Outcome]:
    """Play and judge the walks of many bodies.

    Args:
        trials: to run.
        processes: to run them on; None for one per core.
        progress: makes a progress bar as `tqdm` does.

    Yields:
        The outcomes, in the order of the trials.
    """
    progress = functools.partial(progress, total=len(trials), unit="body", desc="walk")
    if processes == 1:
        yield from progress(map(attempt, trials))
        return
    # Spawned, not forked: a fork would share whatever OpenGL or threads the caller has open.
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        yield from progress(pool.imap(attempt, trials))


def table(outcomes: Sequence[Outcome]) -> str:
    """Return as text how many bodies walked, and their median speed, by legs and links."""
    links = sorted({outcome.links for outcome in outcomes})
    lines = ["legs " + "".join(f"{f'{k} link' + 's' * (k > 1):>18}" for k in links) + f"{'all':>18}"]
    for legs in sorted({outcome.legs for outcome in outcomes}):
        row = [o for o in outcomes if o.legs == legs]
        cells = [_cell([o for o in row if o.links == k]) for k in links]
        lines.append(f"{legs:>4} " + "".join(cells) + _cell(row))
    columns = [_cell([o for o in outcomes if o.links == k]) for k in links]
    lines.append(" all " + "".join(columns) + _cell(outcomes))
    return "\n".join(lines)


def _cell(outcomes: Sequence[Outcome]) -> str:
    if not outcomes:
        return f"{'-':>18}"
    walked = sum(not outcome.failures for outcome in outcomes)
    return f"{f'{walked}/{len(outcomes)}':>11}{np.median([outcome.froude for outcome in outcomes]):>7.3f}"


def summary(outcomes: Sequence[Outcome]) -> str:
    """Return a census in a few lines of text."""
    walked = sum(not outcome.failures for outcome in outcomes)
    reasons = collections.Counter(reason for outcome in outcomes for reason in outcome.failures)
    speed, drift = (np.median([getattr(outcome, name) for outcome in outcomes]) for name in ("froude", "drift"))
    return "\n".join(
        [
            f"{walked} of {len(outcomes)} bodies walk ({100.0 * walked / len(outcomes):.1f} %)",
            f"failures: {', '.join(f'{name} {count}' for name, count in reasons.items()) or 'none'}",
            f"median speed {speed:.3f} sqrt(g h), median drift {drift:.3f}",
        ]
    )
