"""Navigate: reach goal after goal among pillars, of which a ring of ranges tells.

The task is steer's on a floor with pillars, with a command of its own: straight at the goal, pillars
or not. What it asks for is progress to the goal. Lengths are told in R, the mean distance of the feet
from their centre, since what has to fit between pillars is the body with its legs.
"""

import functools
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.arenas import Arena
from arc_suite.arenas.pillars import CELLS, COUNT, PITCH, RADIUS, Pillars
from arc_suite.markers import Marker
from arc_suite.robots.spec import Body
from arc_suite.tasks import steer
from arc_suite.tasks.contract import Start
from arc_suite.tasks.fitting import reach
from arc_suite.tasks.mirrors import Mirror
from arc_suite.tasks.readings import Readings

GOALS = 16  # of a chain; at its end it goes back
NEAR = 0.7  # distance of the torso from a goal at which it is reached, in R, as are the next two
SIGHT = 6.0  # of the ranges
FAR = 7.0  # distance of a goal from which on it is observed as far

# Directions (2, 24) of the ranges, forward and left: all around, ahead first, then to the left.
RAYS = np.stack([function(math.radians(15.0) * np.arange(24)) for function in (np.cos, np.sin)])

FLAT, GOAL = 0.02, (0.2, 0.9, 0.4, 1.0)  # thickness, in R, and colour of the disc that shows a goal

_MOVES = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j]
_OWN = ("pillars", "goals", "reached", "arrived", "gained", "touched", "collisions")


class Felt(NamedTuple("Felt", [(field, np.ndarray) for field in (*Readings._fields, "touches")])):
    """What the simulation shows, and whether anything `touches` a pillar, (...) booleans."""

    torso_height = Readings.torso_height


class Memory(NamedTuple("Memory", [(field, np.ndarray) for field in (*steer.Memory._fields, *_OWN)])):
    """What is remembered beside steer's.

    Attributes:
        pillars: (..., COUNT, 2) where they stand, m.
        goals: (..., GOALS, 2) where they are, m.
        reached: (...) how many goals were.
        arrived: (...) whether one was in the latest step.
        gained: (...) way to the goal in the latest step, as a share of that at the target velocity, from -1 to 1.
        touched: (...) whether a pillar was touched on the way to the present goal.
        collisions: (...) ways to a goal, the present one among them, on which a pillar was touched.
    """


def chain(numbers) -> np.ndarray:
    """Return corners (n, 2) of the grid's cells, each beside the one before, the first beside the start.

    Args:
        numbers: (n,) from 0 to 1, of which each chooses among the corners next to the one before, straight
            or across a cell, but for the one before that.
    """
    corners, farthest = [(0, 0), (0, 0)], CELLS // 2
    for number in numbers:
        near = [(corners[-1][0] + i, corners[-1][1] + j) for i, j in _MOVES]
        near = [corner for corner in near if max(map(abs, corner)) <= farthest and corner != corners[-2]]
        corners.append(near[int(number * len(near))])
    return np.array(corners[2:], float)


class Navigate(steer.Steer):
    """Reaching goals among pillars."""

    name, own_arena, commands = "navigate", True, {}
    bonuses = {"progress": 2.5, "healthy": 1.0, "obedient_gait": 1.5, "goal": 10.0}

    @classmethod
    def arena(cls, body: Body, settings) -> Arena:
        """Return a floor with pillars that suits the body's size."""
        return Pillars(reach(body), 2.0 * body.torso.standing_height)

    @functools.cached_property
    def blocks(self) -> Mapping[str, int]:
        """Steer's, where the goal is, and how far pillars are all around."""
        return {**super().blocks, "goal": 3, "ranges": RAYS.shape[1]}

    @property
    def mirrors(self) -> Mapping[str, Mirror]:
        """Steer's; goals and ranges on the left are on the right."""
        rays = np.arange(RAYS.shape[1])
        ranges = Mirror(-rays % len(rays), np.ones(len(rays), np.int8))
        return {**super().mirrors, "goal": Mirror.signed(1, -1, 1), "ranges": ranges}

    def start(self, random: np.random.RandomState, carry: Any) -> Start:
        """Draw steer's start, then where pillars stand, then the chain of goals."""
        start, arena = super().start(random, carry), self.scene.arena
        pillars = arena.places(random.uniform(-1.0, 1.0, (COUNT, 2)))
        goals = arena.unit * PITCH * chain(random.uniform(size=GOALS))
        memory = Memory(*start.memory, pillars[:, :2], goals, 0, np.False_, np.float64(0.0), np.False_, 0)
        return start._replace(memory=memory, mocap_pos=pillars)

    def read(self, data) -> Felt:
        """Take steer's readings, and whether a force acts on a pillar."""
        touches = (data.cfrc_ext[..., -COUNT:, :] != 0.0).any(axis=(-2, -1))
        return Felt(*super().read(data), touches)

    def after(self, memory: Memory, readings: Felt) -> Memory:
        """Advance the walk, and take down the way to the goal, touches of pillars, and whether the goal is reached."""
        far = self.distance(memory)
        memory = super().after(memory, readings)
        near = self.distance(memory)
        arrived = near <= NEAR * self.scene.arena.unit
        collided = readings.touches & ~memory.touched
        return memory._replace(
            reached=memory.reached + arrived,
            arrived=arrived,
            gained=((far - near) / (self.units[0] * self.scene.control_timestep)).clip(-1.0, 1.0),
            touched=(memory.touched | readings.touches) & ~arrived,
            collisions=memory.collisions + collided,
        )

    def goal(self, memory: Memory):
        """Return where the present goal is (..., 2), m."""
        numpy, end = memory.place.__array_namespace__(), GOALS - 1
        number = end - abs(end - memory.reached % (2 * end))
        return numpy.take_along_axis(memory.goals, numpy.asarray(number)[..., None, None], axis=-2)[..., 0, :]

    def to_goal(self, memory: Memory):
        """Return where the goal is from the torso (..., 2), forward and left, m."""
        return rotations.headed(self.goal(memory) - memory.place[..., :2], memory.place[..., 2])

    def distance(self, memory: Memory):
        """Return how far the goal is from the torso (...), m."""
        goal = self.to_goal(memory)
        return memory.place.__array_namespace__().hypot(goal[..., 0], goal[..., 1])

    def wanted(self, memory: Memory):
        """Return the command (..., 3): straight at the goal as far as the body faces it, and a turn to face it."""
        goal, numpy = self.to_goal(memory), memory.place.__array_namespace__()
        return at_goal(numpy.arctan2(goal[..., 1], goal[..., 0]))

    def tracked(self, memory: Memory):
        """Return the velocity toward the goal (...), as a share of the target velocity from 0 to 1."""
        goal, motion = self.to_goal(memory), memory.motion
        toward = goal[..., 0] * motion[..., 0] + goal[..., 1] * motion[..., 1]
        return (toward / self._apart(goal)).clip(0.0, 1.0)

    def _apart(self, goal):
        """Distance (...) of a goal (..., 2) that is never 0, m."""
        numpy = goal.__array_namespace__()
        return numpy.maximum(numpy.hypot(goal[..., 0], goal[..., 1]), 1e-9 * self.scene.arena.unit)

    def terms(self, memory: Memory, readings: Felt) -> dict:
        """Return steer's terms, and bonuses for progress to the goal and for reaching it."""
        own = {
            "progress": memory.gained * rotations.upright(readings.torso_quaternion),
            "goal": memory.arrived * 1.0,
        }
        return super().terms(memory, readings) | own

    def observe(self, memory: Memory, readings: Felt) -> dict:
        """Return steer's blocks, cosine and sine of the goal's bearing with its distance, and the ranges."""
        goal = self.to_goal(memory)
        numpy, apart = goal.__array_namespace__(), self._apart(goal)[..., None]
        goal = numpy.concatenate([goal / apart, (apart / (FAR * self.scene.arena.unit)).clip(0.0, 1.0)], axis=-1)
        return super().observe(memory, readings) | {"goal": goal, "ranges": self.ranges(memory)}

    def ranges(self, memory: Memory):
        """Return the distances (..., 24) of pillars along `RAYS` from the torso, as shares of `SIGHT`, at most 1."""
        numpy, unit = memory.place.__array_namespace__(), self.scene.arena.unit
        apart = memory.pillars - memory.place[..., None, :2]
        apart = rotations.headed(apart, memory.place[..., 2:]) / unit
        x, y = apart[..., None, :, 0], apart[..., None, :, 1]
        forward, left = numpy.asarray(RAYS)[..., None]
        along = x * forward + y * left
        # Half of the chord that the ray cuts off the pillar, squared.
        chord = RADIUS * RADIUS - (x * left - y * forward) ** 2
        hit = numpy.where((chord >= 0.0) & (along >= 0.0), along - numpy.sqrt(chord.clip(0.0)), SIGHT)
        return (hit.min(axis=-1) / SIGHT).clip(0.0, 1.0)

    def marks(self, memory: Memory, readings: Felt) -> list[Marker]:
        """Return steer's arrows, and the goal as a disc within which it is reached."""
        unit = self.scene.arena.unit
        middle = np.array((*self.goal(memory), 0.0))
        disc = Marker("cylinder", middle, middle + (0.0, 0.0, FLAT * unit), NEAR * unit, GOAL)
        return [*super().marks(memory, readings), disc]

    def progress(self, memory: Memory) -> dict:
        """Return how many `goals` were reached, on how many ways a pillar was hit, and steer's figures."""
        own = {"goals": memory.reached * 1.0, "collisions": memory.collisions * 1.0}
        return own | super().progress(memory)


def at_goal(bearing):
    """Return the command (..., 3) that turns to a bearing (...), rad, and walks there as far as it is faced."""
    numpy = bearing.__array_namespace__()
    ahead = numpy.cos(bearing).clip(0.0)
    return numpy.stack([ahead, 0.0 * ahead, bearing.clip(-1.0, 1.0)], axis=-1)
