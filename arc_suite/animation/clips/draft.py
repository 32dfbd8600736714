"""A draft of a clip: a motion at the pace of the physics, with its gait."""

import math
from typing import NamedTuple

import numpy as np

from arc_suite.animation.clips import planting
from arc_suite.animation.clips.foot_contacts import (
    MIN_RISE,
    MIN_RISE_IN_GESTURE,
    FootContact,
    find_foot_contacts,
    sole_heights,
)
from arc_suite.animation.clips.root_motion import ClipMotion, Pose
from arc_suite.robots.spec import Body

_MAX_SOLE_DEPTH = 0.025  # standing heights, that a sole is below the ground where others are on it


class Draft(NamedTuple):
    """A motion with a sample for every substep.

    Attributes:
        motion: motion of the body.
        cycles: gait cycles that it holds; 0 without a gait.
        cycle: duration of a gait cycle, s; NaN without a gait.
        loops: whether its last pose is its first one.
        stands: whether all feet stay on the ground, so that there are no foot contact events.
        weight: share of the weight that legs allow; None for a clip without weight. See `weight.add_weight`.
    """

    motion: ClipMotion
    cycles: int = 0
    cycle: float = math.nan
    loops: bool = True
    stands: bool = False
    weight: float | None = None

    @property
    def start(self) -> Pose:
        """First pose."""
        return self.motion.pose(0)

    @property
    def cycle_samples(self) -> int:
        """Samples in a gait cycle."""
        return round(self.cycle / self.motion.time_step)

    def stance_height_and_contacts(self, body: Body) -> tuple[float, list[FootContact]]:
        """Return the median height of soles in stance, m, and the foot contact events; none without a gait."""
        heights = sole_heights(body, self.motion.poses())
        if self.stands:
            return float(np.median(heights)), []
        min_rise = MIN_RISE if self.cycles else MIN_RISE_IN_GESTURE
        contacts, stance = find_foot_contacts(self.motion, body, heights, self.cycle, self.loops, min_rise)
        if not stance.any():
            return 0.0, contacts
        return float(np.median(heights[stance])), contacts

    def plant_feet(self, body: Body) -> "Draft":
        """Return the draft with feet in stance that do not slide; see `planting.plant_feet`."""
        return self._replace(motion=planting.plant_feet(body, self.motion, self.cycle, self.loops))

    def put_on_ground(self, body: Body) -> "Draft":
        """Return the draft with soles in stance on the ground, and none deep in it."""
        lowest = float(sole_heights(body, self.motion.poses()).min())
        stance_height, _ = self.stance_height_and_contacts(body)
        height = min(stance_height, lowest + _MAX_SOLE_DEPTH * body.torso.standing_height)
        return self._replace(motion=self.motion.lower(height))
