"""A body that stands and breathes: the standing pose, with soles that stay where they are."""

import math

import numpy as np

from arc_suite.cpg.kinematics import Legs
from arc_suite.export.root_motion import Motion
from arc_suite.models.sizing import GRAVITY, control_timestep
from arc_suite.models.standing import standing
from arc_suite.robots.spec import Body

_BREATH = 0.012  # of the standing height, by which the torso sinks and rises
_ASTRAY = 0.01  # of the standing height: a breath is shallower where a sole would be further from its place
_PERIOD = 12.0  # sqrt(h / g): about a breath, which takes longer the larger the animal
_BENT = 0.05  # of the distance to the middle of a joint's range
_ROUNDS = 50  # of the search for joint angles
_WEIGHTS = np.diag((1.0, 1.0, 8.0))  # of a sole's place: legs of two joints slide rather than sink
_DAMPING = 0.02  # of the standing height


def idle(body: Body) -> Motion:
    """Return a breath of a standing body, as a loop.

    It is the standing pose, all joints at zero, with every sole on the ground, lowered a little so that straight legs
    can bend. The torso sinks and rises like a sine, while joints bend so that the soles stay where they are; less
    where legs have too few joints for that.
    """
    height, step = body.torso.standing_height, control_timestep(body)
    samples = max(2, round(_PERIOD * math.sqrt(height / GRAVITY) / step))
    # All of the range: some joints stand at an end of it.
    legs, soles = Legs.of(body, used=1.0), standing(body).soles
    bent = np.tile(_BENT * 0.5 * (legs.low + legs.high), (samples, 1, 1))  # a straight leg is singular
    goals = np.tile(soles, (samples, 1, 1))
    breath = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(samples) / samples)
    depth = _BREATH * height
    for _ in range(2):
        heights = -np.median(soles[:, 2]) - depth * (0.5 + breath)
        goals[..., 2] = -heights[:, None]
        angles = legs.reached(bent, goals, _WEIGHTS, _DAMPING * height, _ROUNDS)
        depth *= min(1.0, _ASTRAY * height / abs(legs.soles(angles)[0] - goals).max())
    again = np.arange(samples + 1) % samples
    still = np.zeros((samples + 1, 3))
    return Motion(
        step=step,
        root=still,
        positions=still + heights[again, None] * (0.0, 0.0, 1.0),
        quaternions=np.tile((1.0, 0.0, 0.0, 0.0), (samples + 1, 1)),
        joints=legs.by_joint(angles)[again],
        twist=np.zeros(3),
    )
