"""Motions of a body that stays where it is, about the pose in which it rests."""

import math

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips.root_motion import Motion, Pose
from arc_suite.cpg.kinematics import Legs
from arc_suite.models.sizing import GRAVITY, control_timestep
from arc_suite.robots.spec import Body

_BREATH = 0.012  # of the standing height, by which the torso sinks and rises
_ASTRAY = 0.01  # of the standing height: a breath is shallower where a sole would be further from its place
_PERIOD = 12.0  # sqrt(h / g): about a breath, which takes longer the larger the animal
_ROUNDS = 50  # of the search for joint angles
_WEIGHTS = np.diag((1.0, 1.0, 8.0))  # of a sole's place: legs of two joints slide rather than sink
_DAMPING = 0.02  # of the standing height


def idle(body: Body, rest: Pose) -> Motion:
    """Return a breath of a standing body, as a loop that begins with the pose at rest.

    The torso sinks and rises like a sine, while joints bend so that the soles stay where they are; less where legs
    have too few joints for that.
    """
    height, step = body.torso.standing_height, control_timestep(body)
    samples = max(2, round(_PERIOD * math.sqrt(height / GRAVITY) / step))
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
    return Motion(
        step=step,
        root=np.zeros((samples + 1, 3)),
        positions=np.tile(pose.position, (samples + 1, 1)),
        quaternions=np.tile(pose.quaternion, (samples + 1, 1)),
        joints=np.tile(pose.joints, (samples + 1, 1)),
        twist=np.zeros(3),
    )


def sunk(body: Body, rest: Pose, depths: np.ndarray) -> tuple[np.ndarray, float]:
    """Return joint angles (samples, joints), rad, that keep soles in place while the torso sinks, and their error, m.

    Args:
        body: the spec.
        rest: pose from which it sinks.
        depths: (samples,) m.
    """
    legs = Legs.of(body, used=1.0)
    angles = legs.by_leg(rest.joints)
    # A joint at rest may be a little beyond its range, as limits are soft.
    legs = legs._replace(low=np.minimum(legs.low, angles), high=np.maximum(legs.high, angles))
    up = rotations.matrix(rest.quaternion)[2]  # the world's, as the torso sees it
    goals = legs.soles(angles)[0] + depths[:, None, None] * up
    angles = np.tile(angles, (len(depths), 1, 1))
    angles = legs.reached(angles, goals, _WEIGHTS, _DAMPING * body.torso.standing_height, _ROUNDS)
    return legs.by_joint(angles), float(abs(legs.soles(angles)[0] - goals).max())
