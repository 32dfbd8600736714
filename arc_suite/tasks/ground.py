"""Rough ground, slopes, stairs, trenches, and a course of them all: walk along a lane at the target velocity.

The task is steer's on a terrain, with a command of its own: along the lane, told as the torso heads,
and a turn back into the lane's direction. An episode starts in one of several lanes, of one
difficulty or of a level of a curriculum.
"""

import functools
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from arc_suite import checks
from arc_suite.arenas import Arena, terrain
from arc_suite.models.sizing import control_timestep
from arc_suite.robots.spec import Body
from arc_suite.tasks import modifiers, steer, walk
from arc_suite.tasks.contract import STEPS, Start
from arc_suite.tasks.mirrors import Mirror
from arc_suite.tasks.readings import Readings
from arc_suite.tasks.terms import Parameters

LEVELS = 10  # of a curriculum, with difficulties from 0 to 1
UP, DOWN = 0.8, 0.4  # of the distance that was asked for: above or below it, the next level is higher or lower
STAYS = 0.75  # probability of the highest level after itself; else any
SPREAD = 6.0  # half-width of the start across the lane, in standing heights, as are the next four
OFF_LANE = 10.0  # from the middle of the lane, at which an episode is cut off
SUNK = 0.05  # depth of a foot's centre under the ground that a contact never reaches
LONGEST = 300.0  # way ahead of the start
END = 1.0  # before the end of a lane, at which an episode is cut off
SINKING = 5  # control steps running after which a foot has sunk for good

# Where ground is seen: places forward and left of the torso, in R, the mean distance of the feet from their centre.
# They are denser along the way, where trenches lie across.
AHEAD, ASIDE = np.linspace(-1.5, 2.1, 25), np.linspace(-1.2, 1.2, 7)
SCAN = np.stack(np.meshgrid(AHEAD, ASIDE, indexing="ij")).reshape(2, -1)


class Ground(NamedTuple):
    """Settings of the ground.

    Attributes:
        difficulty: of all lanes, from 0 to 1, without a curriculum.
        curriculum: whether episodes climb levels of difficulty by how far they go.
        level: from 0 to 9, at which a curriculum begins.
        terrain_seed: of what is random in the ground.
    """

    difficulty: float = terrain.DIFFICULTY
    curriculum: bool = False
    level: int = 0
    terrain_seed: int = 0


class Settings(NamedTuple):
    """What a walk over ground is made of, beside the body: a walk's settings, and those of the ground."""

    parameters: Parameters
    weights: dict[str, float]
    noise: walk.Noise
    ground: Ground


class Carry(NamedTuple):
    """What an episode leaves to the next.

    Attributes:
        level: of a curriculum.
        outcome: how much of what was asked for it achieved; NaN where there was none.
        failed: whether it ended in failure.
    """

    level: int | np.ndarray
    outcome: float | np.ndarray
    failed: bool | np.ndarray


_FIELDS = [(field, np.ndarray) for field in (*steer.Memory._fields, "lane", "level", "sinking")]


class Memory(NamedTuple("Memory", _FIELDS)):
    """What is remembered beside steer's.

    Attributes:
        lane: (...) y of its middle, m.
        level: (...) of the curriculum; 0 without one.
        sinking: (...) control steps running for which a foot has been under ground.
    """


def next_level(carry: Carry, stays: float, other: int, down: float = DOWN, up: float = UP) -> int:
    """Return the level of the next episode.

    Args:
        carry: of the episode before.
        stays: drawn from 0 to 1.
        other: a level, drawn.
        down: outcome below which the level falls.
        up: outcome above which it rises, unless the episode failed.
    """
    if carry.outcome > up and not carry.failed:
        if carry.level < LEVELS - 1:
            return carry.level + 1
        return carry.level if stays < STAYS else other
    return max(carry.level - 1, 0) if carry.outcome < down else carry.level


class Lanes(steer.Steer):
    """Walking along a lane of some kind of ground.

    Attributes:
        kinds: of ground, in the order of `terrain.KINDS`, one of which is drawn for an episode.
        copies: lanes of each kind, and of each kind and level of a curriculum; boxes cost time, so there are fewer.
        thresholds: outcomes below and above which a curriculum's level falls and rises.
    """

    yaw, own_arena, thresholds = 0.3, True, (DOWN, UP)
    kinds: tuple[str, ...]
    copies = (8, 2)
    demonstrators = ("balanced", "surefooted")

    @classmethod
    def fitted(cls, body: Body, overrides: Mapping[str, Any]) -> Settings:
        """Return steer's settings, with those of `Ground`."""
        for name in overrides:
            known, elsewhere = (*Ground._fields, *walk.NAMES), ("time_limit", *modifiers.NAMES)
            checks.name(name, known, f"setting of {cls.name}", near=elsewhere)
        own = Ground()._asdict() | {name: value for name, value in overrides.items() if name in Ground._fields}
        ground = Ground(
            checks.number("difficulty", own["difficulty"], 0.0, 1.0),
            checks.boolean("curriculum", own["curriculum"]),
            checks.integer("level", own["level"], 0, LEVELS - 1),
            checks.integer("terrain_seed", own["terrain_seed"], 0, 2**32 - 1),
        )
        walked = super().fitted(body, {name: overrides[name] for name in overrides if name not in Ground._fields})
        return Settings(*walked, ground)

    @classmethod
    def arena(cls, body: Body, settings: Settings) -> Arena:
        """Return the lanes, long enough for the distance at the target velocity, and a seventh more."""
        ground, height = settings.ground, body.torso.standing_height
        distance = abs(settings.parameters.target_velocity) * STEPS * control_timestep(body)
        length = min(6.0 + np.ceil(1.15 * distance / height), LONGEST)
        levels = np.arange(LEVELS) / (LEVELS - 1.0) if ground.curriculum else [ground.difficulty]
        copies = dict.fromkeys(cls.kinds, cls.copies[ground.curriculum])
        return terrain.made(body, copies, float(length), tuple(map(float, levels)), ground.terrain_seed)

    @functools.cached_property
    def blocks(self) -> Mapping[str, int]:
        """Steer's, and the height scan."""
        return {**super().blocks, "scan": SCAN.shape[1]}

    @property
    def mirrors(self) -> Mapping[str, Mirror]:
        """Steer's; what is seen on the left is seen on the right, as on mirrored ground."""
        places = np.arange(SCAN.shape[1]).reshape(len(AHEAD), len(ASIDE))[:, ::-1].ravel()
        return {**super().mirrors, "scan": Mirror(places, np.ones(len(places), np.int8))}

    def first(self) -> Carry:
        """Return the level at which a stream begins, which it neither raises nor lowers."""
        return Carry(self.settings.ground.level, np.nan, False)

    def start(self, random: np.random.RandomState, carry: Carry) -> Start:
        """Draw kind, level (two draws), lane and place across it; then steer's start, nearly along the lane."""
        kind, stays, other = random.randint(len(self.kinds)), random.uniform(), random.randint(LEVELS)
        copies = self.copies[self.settings.ground.curriculum]
        lane, place = random.randint(copies), random.uniform(-SPREAD, SPREAD)
        start = super().start(random, carry)
        level, levels = 0, 1
        if self.settings.ground.curriculum:
            level, levels = next_level(carry, stays, other, *self.thresholds), LEVELS
        arena = self.scene.arena
        middle = arena.start((kind * levels + level) * copies + lane)
        start.qpos[1] += middle + place * arena.unit
        return start._replace(memory=Memory(*start.memory, np.float64(middle), level, 0))

    def after(self, memory: Memory, readings: Readings) -> Memory:
        """Advance the walk, and count how long a foot has been under ground."""
        under = (readings.foot_heights < -SUNK * self.scene.arena.unit).any(axis=-1)
        return super().after(memory, readings)._replace(sinking=(memory.sinking + 1) * under)

    def wanted(self, memory: Memory):
        """Return the command (..., 3): along the lane at the target velocity, and a turn into its direction."""
        heading, numpy = memory.place[..., 2], memory.place.__array_namespace__()
        turn = (-heading * self.reach / self.scene.arena.unit).clip(-1.0, 1.0)
        along = numpy.stack([numpy.cos(heading), -numpy.sin(heading), turn], axis=-1)
        return numpy.where(numpy.isnan(memory.command), along, memory.command)

    def observe(self, memory: Memory, readings: Readings) -> dict:
        """Return steer's blocks, and how high the ground about the torso is over where it would stand at ease."""
        return super().observe(memory, readings) | {"scan": self.scan(memory, readings)}

    def scan(self, memory: Memory, readings: Readings):
        """Return the heights (..., 175) of the ground at `SCAN`, in standing heights, clipped to [-1, 1].

        0 is where the ground would be if the torso stood over it at its standing height.
        """
        position, heading = readings.torso_position, memory.place[..., 2]
        numpy, arena = position.__array_namespace__(), self.scene.arena
        forward, left = numpy.asarray(SCAN * self.reach)
        cosine, sine = numpy.cos(heading)[..., None], numpy.sin(heading)[..., None]
        x = position[..., 0:1] + cosine * forward - sine * left
        y = position[..., 1:2] + sine * forward + cosine * left
        return ((arena.height(x, y) - position[..., 2:3]) / arena.unit + 1.0).clip(-1.0, 1.0)

    def ended(self, memory: Memory, readings: Readings) -> tuple:
        """Return as terminated who fell or sank, as truncated who has left the lane or reached its end."""
        return memory.fell | self.sunk(memory), self.left(memory)

    def sunk(self, memory: Memory):
        """Return whether a foot is stuck in the ground, which contacts should never allow: (...) booleans."""
        return memory.sinking >= SINKING

    def left(self, memory: Memory):
        """Return whether the torso is beside or beyond the lane: (...) booleans."""
        x, y = memory.place[..., 0], memory.place[..., 1]
        unit, ahead = self.scene.arena.unit, self.scene.arena.length
        beyond = (x > (ahead - END) * unit) | (x < (END - terrain.BACK) * unit)
        return beyond | (abs(y - memory.lane) > OFF_LANE * unit)

    def progress(self, memory: Memory) -> dict:
        """Return `distance`, as a share; steer's figures; whether a foot `sank`; and the `level` of a curriculum."""
        figures = {"distance": self.distance(memory), **super().progress(memory), "sank": self.sunk(memory) * 1.0}
        return figures | ({"level": memory.level * 1.0} if self.settings.ground.curriculum else {})

    def distance(self, memory: Memory):
        """Return the way along the lane (...) as a share of that at the target velocity; see `asked`."""
        return memory.distance / (self.units[0] * self.scene.control_timestep * self.asked(memory))

    def asked(self, memory: Memory):
        """Return of how many steps (...) an episode is judged: of all where it is over, else of those so far."""
        numpy = memory.distance.__array_namespace__()
        over = memory.fell | self.sunk(memory) | self.left(memory)
        return numpy.where(over, min(self.step_limit, STEPS), memory.steps + (memory.steps == 0))

    def carry(self, memory: Memory) -> Carry:
        """Return what the next level is drawn from."""
        return Carry(memory.level, self.outcome(memory), memory.fell | self.sunk(memory))

    def outcome(self, memory: Memory):
        """Return by what a curriculum judges an episode (...)."""
        return self.distance(memory)


class Rough(Lanes):
    """Walking over rough ground."""

    name, kinds = "rough", ("rough",)


class Slopes(Lanes):
    """Walking up and down slopes."""

    name, kinds = "slopes", ("slopes",)


class Stairs(Lanes):
    """Walking up and down flights of stairs."""

    name, kinds = "stairs", ("stairs",)
    copies = (4, 1)


class Gaps(Lanes):
    """Walking over trenches."""

    name, kinds = "gaps", ("gaps",)
    demonstrators = ("sighted",)
    copies = (4, 1)


class Course(Lanes):
    """Walking over one of the four kinds of ground, drawn for every episode."""

    name, kinds = "course", terrain.KINDS
    copies = (2, 1)
