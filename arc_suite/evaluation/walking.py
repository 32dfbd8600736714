"""What counts as walking: the rule by which a survey and a transfer count the bodies that walk.

Speeds are shares of the target: a task's target velocity along world x, forwards or backwards, or its command.
"""

from collections.abc import Mapping

import numpy as np

from arc_suite import rotations
from arc_suite.models.stride import LEAST_SHARE
from arc_suite.tasks import Task

MOST_TOUCHING = 0.01  # share of the time that the torso may touch the ground
MOST_TILT_COSINE = 0.5  # of the torso; tilted by more than 60 degrees a body has fallen


def target(task: Task, blocks: Mapping[str, np.ndarray], place: np.ndarray) -> np.ndarray:
    """Return the target displacement (2,) of the next control step in the world, m.

    Args:
        task: with a constant target velocity, or a command.
        blocks: of the observation by name.
        place: (3,) of the torso: x and y, m, and yaw, rad.

    Raises:
        ValueError: a task with neither.
    """
    seconds = task.scene.control_timestep
    if task.target_velocity is not None:
        return np.array((seconds * task.target_velocity, 0.0))
    if task.parameters is None or "command" not in blocks:
        raise ValueError(f"task {task.name}: expected one that observes a command or has a target velocity")
    desired = seconds * task.parameters.target_velocity * blocks["command"][:2]
    return rotations.headed(desired, -place[2])


def shares(targets: np.ndarray, moved: np.ndarray, steps: float) -> tuple[float, float]:
    """Return how far a body moved along its targets, and how far aside, as shares of the target path.

    Args:
        targets: (n, 2) displacements of the control steps until the end or a fall, m; see `target`.
        moved: (n, 2) displacements of the torso in these steps, m.
        steps: of the whole trial; a body that has fallen rests.

    Returns:
        The speed as a share of the target speed, and the drift, positive to the left. They are 1 and 0 where all
        targets are stops.
    """
    path = float((targets * targets).sum()) * steps / len(targets)
    along = float((targets * moved).sum())
    aside = float((targets[:, 0] * moved[:, 1] - targets[:, 1] * moved[:, 0]).sum())
    return (along / path, aside / path) if path else (1.0, 0.0)


def failures(speed: float, touching: float, ending: str = "time") -> tuple[str, ...]:
    """Return why a motion is no walk: a fall, a torso that drags, or slowness; empty for a walk.

    Args:
        speed: as a share of the target speed; see `shares`.
        touching: share of the time that the torso touched the ground.
        ending: "time" at the end of the trial, else "fall" or "divergence".
    """
    found = {ending: ending != "time", "touch": touching >= MOST_TOUCHING, "slow": not speed >= LEAST_SHARE}
    return tuple(name for name, failed in found.items() if failed)
