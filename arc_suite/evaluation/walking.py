"""The criteria of a walk: one rule for surveys, transfers, checks of a body and searches for creatures.

A body walks if it does not fall, keeps its torso off the ground, and comes near the target speed. Speeds are shares of
the target: the task's target velocity along world x, forwards or backwards, or its command.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.models.stride import MIN_SPEED_SHARE
from arc_suite.tasks import Task, readings

MAX_TOUCHING = 0.01  # share of the time that the torso may touch the ground
MIN_UPRIGHTNESS = 0.5  # cosine of the torso's tilt; a body that tilts by more than 60 degrees has fallen

# Endings of a walk: by its time limit, or before.
TIME = "time"
FALL = "fall"
DIVERGENCE = "divergence"


class Verdict(NamedTuple):
    """The result of a walk.

    Attributes:
        speed: share of the target speed; see `shares`.
        drift: displacement to the left of the targets, as a share of the target path.
        touching: share of the time that the torso touched the ground.
        failures: reasons why the motion is no walk; empty for a walk.
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
    """Records one episode in an environment of `arc_suite.load`, as a watcher of `evaluation.run` or step by step.

    After a fall no more steps are recorded: the body counts as at rest.

    Attributes:
        ending: `FALL` or `DIVERGENCE` after one, else `TIME`.
    """

    def __init__(self, environment):
        """Prepare for the next episode."""
        self.ending = TIME
        self._task = environment.task.definition
        self._physics = environment.physics
        self._data = environment.physics.data.ptr
        model = environment.physics.model.ptr
        self._torso_geoms = np.flatnonzero(model.geom_bodyid == self._task.scene.layout.torso)
        self._poses = []  # (3,) of the torso: x and y, m, and yaw, rad; at the reset and after each step
        self._targets = []
        self._touching = []

    def __call__(self, timestep) -> None:
        """Record a `TimeStep`; the first one is that of the reset.

        Raises:
            ValueError: a task without a target velocity or command.
        """
        if self.ending != TIME:
            return
        data = self._data
        qpos = readings.torso_qpos(data.qpos, self._task.scene.layout)
        pose = np.array((*qpos[:2], rotations.yaw(qpos[3:7])))
        self._poses.append(pose)
        if timestep.first():
            self._touching.append(False)
        else:
            self._touching.append(bool(np.isin(data.contact.geom, self._torso_geoms).any()))
            if self._physics.divergence is not None:
                self.ending = DIVERGENCE
            elif has_fallen(timestep.discount == 0.0, data.qpos[3:7]):
                self.ending = FALL
        self._targets.append(target(self._task, timestep.observation, pose))

    @property
    def length(self) -> int:
        """Return the number of control steps so far, or until the fall."""
        return len(self._poses) - 1

    def note_divergence(self) -> None:
        """End the walk with a step in which the physics diverged."""
        self._poses.append(self._poses[-1])
        self.ending = DIVERGENCE

    def verdict(self, steps: float) -> Verdict:
        """Return the result of the walk.

        Args:
            steps: number of control steps of the whole trial; the walk may have ended before.
        """
        displacements = np.diff(np.array(self._poses)[:, :2], axis=0)
        targets = np.array(self._targets[: self.length])
        return assess(targets, displacements, np.array(self._touching), steps, self.ending)


def assess(targets: np.ndarray, displacements: np.ndarray, touching: np.ndarray, steps: float, ending: str) -> Verdict:
    """Return the result of a walk of n control steps.

    Args:
        targets: (n, 2) target displacements, m; see `target`.
        displacements: (n, 2) displacements of the torso, m.
        touching: (n + 1,) whether the torso touched the ground at the start and after each step.
        steps: number of control steps of the whole trial; after a fall the body counts as at rest.
        ending: `TIME`, `FALL` or `DIVERGENCE`.
    """
    speed, drift = shares(targets, displacements, steps)
    touching_share = float(touching.mean())
    return Verdict(speed, drift, touching_share, failures(speed, touching_share, ending))


def has_fallen(terminated, quaternions):
    """Return whether bodies (...) have fallen: their task has ended the episode, or the torso tilts too far.

    Args:
        terminated: (...) whether the task has ended the episode.
        quaternions: (..., 4) orientations of the torsos.
    """
    return terminated | (rotations.upright(quaternions) < MIN_UPRIGHTNESS)


def is_slow(speed: float) -> bool:
    """Return whether a speed, as a share of the target speed, is too low for a walk; true for NaN."""
    return not speed >= MIN_SPEED_SHARE


def target(task: Task, blocks: Mapping[str, np.ndarray], place: np.ndarray) -> np.ndarray:
    """Return the target displacement (2,) of the next control step in the world, m.

    Args:
        task: task with a constant target velocity, or with a command.
        blocks: blocks of the observation by name.
        place: (3,) pose of the torso: x and y, m, and yaw, rad.

    Raises:
        ValueError: a task without a target velocity and a command.
    """
    timestep = task.scene.control_timestep
    if task.target_velocity is not None:
        return np.array((timestep * task.target_velocity, 0.0))
    if task.parameters is None or "command" not in blocks:
        raise ValueError(f"task {task.name}: expected one that observes a command or has a target velocity")
    desired = timestep * task.parameters.target_velocity * blocks["command"][:2]
    return rotations.to_heading_frame(desired, -place[2])


def shares(targets: np.ndarray, displacements: np.ndarray, steps: float) -> tuple[float, float]:
    """Return how far a body moved along its targets, and how far aside, as shares of the target path.

    Args:
        targets: (n, 2) displacements of the control steps until the end or a fall, m; see `target`.
        displacements: (n, 2) displacements of the torso in these steps, m.
        steps: number of control steps of the whole trial; after a fall the body counts as at rest.

    Returns:
        The speed as a share of the target speed, and the drift, positive to the left. They are 1 and 0 if all
        targets are 0.
    """
    path = float((targets * targets).sum()) * steps / len(targets)
    along = float((targets * displacements).sum())
    aside = float((targets[:, 0] * displacements[:, 1] - targets[:, 1] * displacements[:, 0]).sum())
    return (along / path, aside / path) if path else (1.0, 0.0)


def failures(speed: float, touching: float, ending: str = TIME) -> tuple[str, ...]:
    """Return why a motion is no walk: a fall, a torso that drags, or slowness; empty for a walk.

    Args:
        speed: as a share of the target speed; see `shares`.
        touching: share of the time that the torso touched the ground.
        ending: `TIME`, `FALL` or `DIVERGENCE`.
    """
    has_failure = {ending: ending != TIME, "touch": touching >= MAX_TOUCHING, "slow": is_slow(speed)}
    return tuple(name for name, failed in has_failure.items() if failed)
