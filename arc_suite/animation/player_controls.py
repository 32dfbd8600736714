"""What a person chooses from where pose and gait are by command: poses within a body's room, gaits by name."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from arc_suite.models import posture
from arc_suite.robots import gaits
from arc_suite.robots.spec import Body
from arc_suite.tasks import Task, clock

OWN_GAIT = "own"  # the gait that a task prescribes
TEMPO_RANGE = (0.6, 1.4)  # of a gait, multiples of the prescribed frequency


def is_directed(task: Task) -> bool:
    """Return whether pose and gait of a task are by command."""
    return task.commands.get("pose") == len(posture.POSE_NAMES) and "gait" in task.commands


def pose_room(body: Body) -> np.ndarray:
    """Return how far each number of a pose can go, (6, 2) in whole hundredths, with feet that may slide."""
    return np.trunc((100.0 * posture.measure_room(body, planted=False)).round(4)) / 100.0


def gaits_by_name(task: Task) -> dict[str, list[float]]:
    """Return offsets, cycles, and duty factor of the gaits that fit a body, by name; first its own."""
    body, own = task.scene.body, task.parameters
    made = {name: gaits.gait(body, name) for name in gaits.fitting_gaits(body)}
    return {
        OWN_GAIT: [*np.divide(own.phase_offsets, clock.TWO_PI), own.duty_factor],
        **{name: [*gait.offsets, gait.duty_factor] for name, gait in made.items()},
    }


def commands(
    task: Task,
    desired: Sequence[float] | np.ndarray | None,
    pose: Sequence[float] | np.ndarray | None,
    gait: str | None,
    tempo: float = 1.0,
) -> dict[str, Any]:
    """Return what a person sets of a task's commands, by name; None leaves it to the task.

    Args:
        task: whose other commands are left out.
        desired: (3,) velocity, or None.
        pose: (6,), reduced to the body's room, or None.
        gait: its name, or None; a gait that does not fit is replaced by the body's own.
        tempo: multiple of the prescribed frequency of a gait.
    """
    asked: dict[str, Any] = {"command": desired} if task.commands.get("command") == 3 else {}
    if is_directed(task):
        numbers = gaits_by_name(task)
        own = [*numbers.get(gait, numbers[OWN_GAIT]), tempo * task.parameters.gait_frequency] if gait else None
        asked |= {"pose": None if pose is None else _within(pose_room(task.scene.body), np.asarray(pose)), "gait": own}
    return asked


def _within(bounds: np.ndarray, pose: np.ndarray) -> np.ndarray:
    """A pose (6,) reduced to bounds (6, 2); not all numbers go to their bounds at once."""
    pose = pose.clip(*bounds.T)
    most = abs(np.where(pose < 0.0, bounds[:, 0], bounds[:, 1]))
    return pose / max(1.0, (abs(pose) / np.maximum(most, 1e-9)).sum())
