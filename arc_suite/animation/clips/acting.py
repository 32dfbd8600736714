"""Motions simulated from the pose at rest: a rise, jumps, a death."""

import copy
import math

import mujoco
import numpy as np

from arc_suite.animation.clips import gestures
from arc_suite.animation.clips.recordings import Recording
from arc_suite.animation.clips.root_motion import Motion, Pose, advance_straight, stay_at_start
from arc_suite.cpg import leaps
from arc_suite.cpg.drives import drive
from arc_suite.cpg.selection import presets_of
from arc_suite.models import sizing
from arc_suite.models.kinematics import Legs
from arc_suite.models.outline import torso_box
from arc_suite.models.standing import posed, stood
from arc_suite.robots.spec import Body
from arc_suite.simulation.model import compiled
from arc_suite.tasks import readings

# Durations are multiples of sqrt(h / g), h being the standing height.
_SINK, _HOLD, _GIVE, _FALL = 6.0, 2.0, 1.5, 6.0
_FLACCID = 0.05  # of the damping of joints without life
_LIES = 0.6  # of the height at rest, below which a torso lies
_NEAR = 0.1  # of the height at rest, within which a torso lies on the ground


def rise(body: Body, rest: Pose) -> Motion:
    """Return how a body rises from its belly, or as near to it as its legs fold.

    Raises:
        ValueError: the legs hardly fold.
    """
    sink, hold = _steps(body, _SINK), _steps(body, _HOLD)
    share = np.concatenate([_eased(sink), np.ones(hold), _eased(sink)[::-1], np.zeros(hold)])
    joints = gestures.lower_torso(body, rest, share * _depth(body, rest))
    recording = _driven(body, rest, joints + _holding(body, rest) - rest.joints)
    first = sizing.simulation(body).substeps * (sink + hold)
    _check_lies(body, rest, recording.poses[first])
    return stay_at_start(recording, first, len(recording.poses) - 1 - first)


def jump(body: Body, rest: Pose) -> Motion:
    """Return how a body jumps on the spot.

    Raises:
        ValueError: its feet do not leave the ground, or it does not land on them.
    """
    recording = _leapt(body, rest, leaps.JUMPS, "clearance")
    return stay_at_start(recording, 0, len(recording.poses) - 1)


def leap(body: Body, rest: Pose) -> Motion:
    """Return how a body leaps ahead, over a root that goes along below its torso.

    Raises:
        ValueError: its feet do not leave the ground, or it does not land on them.
    """
    return advance_straight(_leapt(body, rest, presets_of(body)["leaping"].choice, "distance"))


def _leapt(body: Body, rest: Pose, choice: tuple[leaps.Leap, ...], measure: str) -> Recording:
    legs = Legs.of(sizing.sized(body))
    found = leaps.found(body, tuple(rest.joints.tolist()), choice, measure)
    targets = leaps.keyframes(body, legs, legs.by_leg(rest.joints), found)
    held = np.tile(rest.joints, (_steps(body, _HOLD), 1))
    return _driven(body, rest, np.concatenate([targets, held]) + _holding(body, rest) - rest.joints)


def death(body: Body, rest: Pose) -> Motion:
    """Return how a body collapses: its legs give way, then its joints are without torque and nearly without damping.

    Raises:
        ValueError: the legs hardly fold.
    """
    give, fall = _steps(body, _GIVE), _steps(body, _FALL)
    joints = gestures.lower_torso(body, rest, np.append(_eased(give), 1.0) * _depth(body, rest))
    limp = np.full((fall, len(rest.joints)), np.nan)
    recording = _driven(body, rest, np.concatenate([joints, limp]), damping=_FLACCID)
    _check_lies(body, rest, recording.poses[-1])
    return stay_at_start(recording, 0, len(recording.poses) - 1)


def _depth(body: Body, rest: Pose) -> float:
    """Return the height of the torso's lowest point over the ground at rest, m."""
    return rest.position[2] + torso_box(body)[0][2]


def _check_lies(body: Body, rest: Pose, pose: np.ndarray) -> None:
    """Raise a ValueError if a torso stands still."""
    if (
        pose[2] > _LIES * rest.position[2]
        and pose[2] - rest.position[2] + _depth(body, rest) > _NEAR * rest.position[2]
    ):
        raise ValueError("the legs do not fold far enough to lie down")


def _steps(body: Body, duration: float) -> int:
    """Return the number of control steps in a multiple of sqrt(h / g)."""
    return round(duration * math.sqrt(body.torso.standing_height / sizing.GRAVITY) / sizing.control_timestep(body))


def _eased(steps: int) -> np.ndarray:
    return 0.5 - 0.5 * np.cos(np.pi * np.arange(steps) / steps)


def _holding(body: Body, rest: Pose) -> np.ndarray:
    """Return the target angles (joints,), rad, at which position control holds a pose under the body's weight."""
    sized = sizing.sized(body)
    pose = posed(sized, rest.joints)
    limits = np.array([joint.torque for joint in sized.joints])
    return rest.joints + pose.loads / (limits * drive(sized, pose.inertias).stiffness)


def _driven(body: Body, rest: Pose, targets: np.ndarray, damping: float = 1.0) -> Recording:
    """Simulate a body from rest.

    Args:
        body: the spec.
        rest: first pose.
        targets: (steps + 1, joints) of position control, rad; NaN for no torque.
        damping: of the joints, as a share of their own.

    Returns:
        A pose for every substep.
    """
    sized = sizing.sized(body)
    driven = drive(sized, posed(sized, rest.joints).inertias)
    model = copy.copy(compiled(body))
    model.dof_damping[6:] *= damping
    layout = readings.layout(model, body)
    data, step = mujoco.MjData(model), sizing.control_timestep(body)
    data.qpos[:] = readings.positions(np.concatenate(rest), layout, stood(model))
    moved, count = [data.qpos.copy()], len(body.joint_names)
    for target, later in zip(targets[:-1], targets[1:], strict=True):
        angles, speeds = readings.pose(data.qpos, layout)[7:], data.qvel[layout.joint_velocities]
        actions = driven.actions(target, (later - target) / step, angles, speeds)
        data.ctrl[:count] = np.nan_to_num(actions)
        if body.source:
            data.ctrl[count : 2 * count] = np.isnan(actions)  # releases of servos
        for _ in range(sized.simulation.substeps):
            mujoco.mj_step(model, data)
            moved.append(data.qpos.copy())
    return Recording(model.opt.timestep, sized.simulation.substeps, readings.pose(np.stack(moved), layout))
