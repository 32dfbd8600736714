"""Motions in which nobody walks, from the pose at rest: a breath, a lean, a blow, a rise, jumps, a death."""

import copy
import math

import mujoco
import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips.recordings import Recording
from arc_suite.animation.clips.root_motion import Motion, Pose, advancing, standing
from arc_suite.cpg import leaps
from arc_suite.cpg.drives import drive
from arc_suite.cpg.selection import presets_of
from arc_suite.models import posture, sizing
from arc_suite.models.kinematics import Legs
from arc_suite.models.outline import torso_box
from arc_suite.models.standing import posed, stood
from arc_suite.robots.spec import Body
from arc_suite.simulation.model import compiled
from arc_suite.tasks import readings

# Durations are multiples of sqrt(h / g), speeds of sqrt(g h), h being the standing height.
_BLOW = 0.5  # change of the torso's velocity, backwards
_STAGGER, _SINK, _HOLD, _GIVE, _FALL = 8.0, 6.0, 2.0, 1.5, 6.0
_FLACCID = 0.05  # of the damping of joints without life
_LIES = 0.6  # of the height at rest, below which a torso lies
_NEAR = 0.1  # of the height at rest, within which a torso lies on the ground
_BREATH = 0.012  # of the standing height, by which the torso sinks and rises
_ASTRAY = 0.01  # of the standing height: a breath is shallower where a sole would be further from its place
_PERIOD = 12.0  # sqrt(h / g): about a breath, which takes longer the larger the animal
_ROUNDS = 50  # of the search for joint angles
_TURN, _OF_ROOM, _LEAST_TURN = 0.2, 0.8, 0.03  # rad, that a torso turns, at most a share of its room, and at least
_EASE, _SHOWN = 3.0, 4.0  # durations of a turn, and of the pose after it
_WEIGHTS = np.diag((1.0, 1.0, 8.0))  # of a sole's place: legs of two joints slide rather than sink


def idle(body: Body, rest: Pose) -> Motion:
    """Return a breath of a standing body, as a loop that begins with the pose at rest.

    The torso sinks and rises like a sine, while joints bend so that the soles stay where they are; less where legs
    have too few joints for that.
    """
    height, step = body.torso.standing_height, sizing.control_timestep(body)
    samples = max(2, round(_PERIOD * math.sqrt(height / sizing.GRAVITY) / step))
    breath = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(samples + 1) / samples)
    depth = _BREATH * height
    _, astray = sunk(body, rest, depth * breath)
    depth *= min(1.0, _ASTRAY * height / max(astray, 1e-9))
    joints, _ = sunk(body, rest, depth * breath)
    joints[-1] = joints[0]
    return held(rest, samples, step)._replace(
        positions=rest.position - (depth * breath)[:, None] * (0.0, 0.0, 1.0), joints=joints
    )


def held(pose: Pose, samples: int, step: float) -> Motion:
    """Return a pose held for a number of samples after the first one, with a root that stays."""
    positions, quaternions, joints = (np.tile(values, (samples + 1, 1)) for values in pose)
    return Motion(step, np.zeros((samples + 1, 3)), positions, quaternions, joints, np.zeros(3))


def hit(body: Body, rest: Pose) -> Motion:
    """Return how a body sways under a blow from ahead, while its joints hold the pose."""
    steps = _steps(body, _STAGGER)
    backwards = -_BLOW * math.sqrt(sizing.GRAVITY * body.torso.standing_height)
    recording = _driven(body, rest, np.tile(_holding(body, rest), (steps + 1, 1)), push=backwards)
    return standing(recording, 0, len(recording.poses) - 1)


def rise(body: Body, rest: Pose) -> Motion:
    """Return how a body rises from its belly, or as near to it as its legs fold.

    Raises:
        ValueError: the legs hardly fold.
    """
    sink, hold = _steps(body, _SINK), _steps(body, _HOLD)
    share = np.concatenate([_eased(sink), np.ones(hold), _eased(sink)[::-1], np.zeros(hold)])
    joints, _ = sunk(body, rest, share * _depth(body, rest))
    recording = _driven(body, rest, joints + _holding(body, rest) - rest.joints)
    first = sizing.simulation(body).substeps * (sink + hold)
    _check_lies(body, rest, recording.poses[first])
    return standing(recording, first, len(recording.poses) - 1 - first)


def jump(body: Body, rest: Pose) -> Motion:
    """Return how a body jumps on the spot.

    Raises:
        ValueError: its feet do not leave the ground, or it does not land on them.
    """
    recording = _leapt(body, rest, leaps.JUMPS, "clearance")
    return standing(recording, 0, len(recording.poses) - 1)


def leap(body: Body, rest: Pose) -> Motion:
    """Return how a body leaps ahead, over a root that goes along below its torso.

    Raises:
        ValueError: its feet do not leave the ground, or it does not land on them.
    """
    return advancing(_leapt(body, rest, presets_of(body)["leaping"].choice, "distance"))


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
    joints, _ = sunk(body, rest, np.append(_eased(give), 1.0) * _depth(body, rest))
    limp = np.full((fall, len(rest.joints)), np.nan)
    recording = _driven(body, rest, np.concatenate([joints, limp]), damping=_FLACCID)
    _check_lies(body, rest, recording.poses[-1])
    return standing(recording, 0, len(recording.poses) - 1)


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


def _driven(body: Body, rest: Pose, targets: np.ndarray, push: float = 0.0, damping: float = 1.0) -> Recording:
    """Simulate a body from rest.

    Args:
        body: the spec.
        rest: first pose.
        targets: (steps + 1, joints) of position control, rad; NaN for no torque.
        push: forward velocity of the torso at the start, m/s.
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
    data.qvel[0] = push
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


def turned(body: Body, rest: Pose, number: str, sign: float) -> Motion:
    """Return how a torso turns over its feet, stays so, and turns back.

    Args:
        body: the spec.
        rest: pose from which it turns.
        number: of the pose that changes; see `posture.NAMES`.
        sign: of the change.

    Raises:
        ValueError: the legs have no room for it.
    """
    place = posture.NAMES.index(number)
    bounds = posture.room(body, planted=False)[place]
    size = min(_TURN, _OF_ROOM * abs(bounds[int(sign > 0.0)]))
    if size < _LEAST_TURN:
        raise ValueError(f"the legs leave the torso no room to {number}")
    eased = _eased(_steps(body, _EASE))
    share = np.concatenate([eased, np.ones(_steps(body, _SHOWN)), eased[::-1], [0.0]])
    poses = sign * size * share[:, None] * np.eye(6)[place]
    joints, _ = over_feet(body, rest, poses)
    half = 0.5 * poses[:, 3:]
    quaternions = np.concatenate([np.cos(half.sum(axis=-1, keepdims=True)), np.sin(half)], axis=-1)  # about one axis
    motion = held(rest, len(poses) - 1, sizing.control_timestep(body))
    return motion._replace(joints=joints, quaternions=rotations.product(quaternions, motion.quaternions))


def sunk(body: Body, rest: Pose, depths: np.ndarray) -> tuple[np.ndarray, float]:
    """Return joint angles (samples, joints), rad, that keep soles in place while the torso sinks, and their error, m.

    Args:
        body: the spec.
        rest: pose from which it sinks.
        depths: (samples,) m.
    """
    poses = np.zeros((len(depths), 6))
    poses[:, 0] = -depths / body.torso.standing_height
    return over_feet(body, rest, poses)


def over_feet(body: Body, rest: Pose, poses: np.ndarray) -> tuple[np.ndarray, float]:
    """Return joint angles (samples, joints), rad, that keep soles in place under a posed torso, and their error, m.

    Args:
        body: the spec.
        rest: pose from which the torso moves.
        poses: (samples, 6) from there; see `posture`.
    """
    height, frame = body.torso.standing_height, rotations.matrix(rest.quaternion)
    legs = Legs.of(body, used=1.0)
    angles = legs.by_leg(rest.joints)
    # A joint at rest may be a little beyond its range, as limits are soft.
    legs = legs._replace(low=np.minimum(legs.low, angles), high=np.maximum(legs.high, angles))
    goals = posture.moved(legs.soles(angles)[0] @ frame.T, poses, height) @ frame
    angles = np.tile(angles, (len(poses), 1, 1))
    angles = legs.reached(angles, goals, _WEIGHTS, posture.DAMPING * height, _ROUNDS)
    return legs.by_joint(angles), float(abs(legs.soles(angles)[0] - goals).max())
