"""What a person chooses from where pose and gait are by command: poses within a body's room, gaits by name."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from arc_suite.models import posture
from arc_suite.robots import gaits
from arc_suite.robots.spec import Body
from arc_suite.tasks import Task, clock

OWN_GAIT = "own"  # name of the gait that a task prescribes
TEMPO_RANGE = (0.6, 1.4)  # of a gait, multiples of the prescribed frequency


def is_directed(task: Task) -> bool:
    """Return whether pose and gait of a task are by command."""
    return task.commands.get("pose") == len(posture.POSE_NAMES) and "gait" in task.commands


def pose_room(body: Body) -> np.ndarray:
    """Return how far each number of a pose can go, (6, 2) in whole hundredths, with feet that may slide."""
    hundredths = 100.0 * posture.measure_room(body, planted=False)
    return np.trunc(hundredths.round(4)) / 100.0  # rounded first, as 28.99999999 stands for 29


def gaits_by_name(task: Task) -> dict[str, list[float]]:
    """Return the phase offsets, cycles, and the duty factor of gaits, by name: the task's own, and those that fit."""
    body = task.scene.body
    own_offsets = np.divide(task.parameters.phase_offsets, clock.TWO_PI)
    numbers_of_gait = {OWN_GAIT: [*own_offsets, task.parameters.duty_factor]}
    for name in gaits.fitting_gaits(body):
        gait = gaits.gait(body, name)
        numbers_of_gait[name] = [*gait.offsets, gait.duty_factor]
    return numbers_of_gait


def commands(
    task: Task,
    desired: Sequence[float] | np.ndarray | None,
    pose: Sequence[float] | np.ndarray | None,
    gait: str | None,
    tempo: float = 1.0,
) -> dict[str, Any]:
    """Return what a person sets of a task's commands, by name; None leaves it to the task.

    Args:
        task: task whose other commands are left out.
        desired: (3,) velocity, or None.
        pose: (6,), reduced to the body's room, or None.
        gait: its name, or None; a gait that does not fit is replaced by the body's own. Its frequency and duty factor
            suit the speed; see `gaits.PACES`.
        tempo: multiple of the frequency of the gait.
    """
    value_of_command: dict[str, Any] = {}
    if task.commands.get("command") == 3:
        value_of_command["command"] = desired
    if is_directed(task):
        value_of_command["pose"] = None
        if pose is not None:
            value_of_command["pose"] = _limit_pose(np.asarray(pose), pose_room(task.scene.body))
        value_of_command["gait"] = None
        if gait:
            numbers_of_gait = gaits_by_name(task)
            *offsets, duty_factor = numbers_of_gait.get(gait, numbers_of_gait[OWN_GAIT])
            pace = gaits.pace_under_command((1.0, 0.0, 0.0) if desired is None else desired)
            frequency = tempo * pace.tempo * task.parameters.gait_frequency
            value_of_command["gait"] = [*offsets, duty_factor + pace.duty_change, frequency]
    return value_of_command


def _limit_pose(pose: np.ndarray, room: np.ndarray) -> np.ndarray:
    """Return a pose (6,) within a room (6, 2); the more numbers change, the less each of them does."""
    pose = pose.clip(room[:, 0], room[:, 1])
    limits = abs(np.where(pose < 0.0, room[:, 0], room[:, 1]))
    limit_shares = abs(pose) / np.maximum(limits, 1e-9)
    return pose / max(1.0, limit_shares.sum())
