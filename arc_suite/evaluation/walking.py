"""What counts as walking: one rule for surveys, transfers, checks of a body and searches for creatures.

A body walks if it does not fall, keeps its torso off the ground, and comes near the target speed. Speeds are shares of
the target: a task's target velocity along world x, forwards or backwards, or its command.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.models.stride import MIN_SPEED_SHARE
from arc_suite.tasks import Task

MOST_TOUCHING = 0.01  # share of the time that the torso may touch the ground
MOST_TILT_COSINE = 0.5  # of the torso; tilted by more than 60 degrees a body has fallen

# How a walk ends: at the end of its time, or before.
TIME, FALL, DIVERGENCE = "time", "fall", "divergence"


class Verdict(NamedTuple):
    """What a walk came to.

    Attributes:
        speed: as a share of the target speed; see `shares`.
        drift: displacement to the left of the targets, as a share of the target path.
        touching: share of the time that the torso touched the ground.
        failures: why it does not count as walking; empty if it does.
    """

    speed: float
    drift: float
    touching: float
    failures: tuple[str, ...]

    @property
    def walks(self) -> bool:
        """Return whether the body walked."""
        return not self.failures

    @property
    def fell(self) -> bool:
        """Return whether the walk ended before its time."""
        return FALL in self.failures or DIVERGENCE in self.failures


class WalkWatcher:
    """Watches one episode in an environment of `arc_suite.load`, as a watcher of `evaluation.run` or step by step.

    A body that has fallen rests: later steps do not count.

    Attributes:
        ending: `TIME` so far, else `FALL` or `DIVERGENCE`.
    """

    def __init__(self, environment):
        """Prepare to watch the next episode."""
        self.ending = TIME
        self._task = environment.task.definition
        self._data = environment.physics.data.ptr
        model = environment.physics.model.ptr
        self._torso_geoms = np.flatnonzero(model.geom_bodyid == model.body("torso").id)
        self._places, self._targets, self._touching = [], [], []

    def __call__(self, timestep) -> None:
        """See a `TimeStep`, that of the reset first.

        Raises:
            ValueError: a task without a target velocity or command.
        """
        if self.ending != TIME:
            return
        data = self._data
        self._places.append(np.array((*data.qpos[:2], rotations.yaw(data.qpos[3:7]))))
        if timestep.first():
            self._touching.append(False)
        else:
            self._touching.append(bool(np.isin(data.contact.geom, self._torso_geoms).any()))
            if has_fallen(timestep.discount == 0.0, data.qpos[3:7]):
                self.ending = FALL
        self._targets.append(target(self._task, timestep.observation, self._places[-1]))

    @property
    def length(self) -> int:
        """Return the number of control steps so far, or until the fall."""
        return len(self._places) - 1

    def note_divergence(self) -> None:
        """End the walk by a step in which the physics diverged."""
        self._places.append(self._places[-1])
        self.ending = DIVERGENCE

    def verdict(self, steps: float) -> Verdict:
        """Return what the walk came to.

        Args:
            steps: of the whole trial, from which a fallen body is missing.
        """
        moved = np.diff(np.array(self._places)[:, :2], axis=0)
        targets = np.array(self._targets[: self.length])
        return assess(targets, moved, np.array(self._touching), steps, self.ending)


def assess(targets: np.ndarray, moved: np.ndarray, touching: np.ndarray, steps: float, ending: str) -> Verdict:
    """Return what a walk of n control steps came to.

    Args:
        targets: (n, 2) displacements that it was to make, m; see `target`.
        moved: (n, 2) displacements of the torso, m.
        touching: whether the torso touched the ground at the start and after each step.
        steps: of the whole trial; a body that has fallen rests.
        ending: `TIME`, `FALL` or `DIVERGENCE`.
    """
    speed, drift = shares(targets, moved, steps)
    touched = float(touching.mean())
    return Verdict(speed, drift, touched, failures(speed, touched, ending))


def has_fallen(terminated, quaternions):
    """Return whether bodies (...) have fallen: their task has ended the episode, or the torso has tilted too far.

    Args:
        terminated: (...) booleans.
        quaternions: (..., 4) of the torsos.
    """
    return terminated | (rotations.upright(quaternions) < MOST_TILT_COSINE)


def is_slow(speed: float) -> bool:
    """Return whether a speed, as a share of the target's, is too low for a walk."""
    return not speed >= MIN_SPEED_SHARE  # true of NaN


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
    return rotations.to_heading_frame(desired, -place[2])


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


def failures(speed: float, touching: float, ending: str = TIME) -> tuple[str, ...]:
    """Return why a motion is no walk: a fall, a torso that drags, or slowness; empty for a walk.

    Args:
        speed: as a share of the target speed; see `shares`.
        touching: share of the time that the torso touched the ground.
        ending: `TIME`, `FALL` or `DIVERGENCE`.
    """
    found = {ending: ending != TIME, "touch": touching >= MOST_TOUCHING, "slow": is_slow(speed)}
    return tuple(name for name, failed in found.items() if failed)
