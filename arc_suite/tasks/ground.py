"""Grounds: where a task with a command takes place, and what a body sees of it.

A ground is a frozen value with pure functions of its own memory. `place` is (..., 3): x and y of the
torso's frame, m, and its yaw, rad.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from arc_suite import checks, rotations
from arc_suite.arenas import FLAT, Arena, terrain
from arc_suite.arenas.pillars import COUNT, RADIUS, Pillars
from arc_suite.models import posture
from arc_suite.models.sizing import control_timestep
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.context import Context
from arc_suite.tasks.contract import CURRICULUM, STEPS
from arc_suite.tasks.fitting import reach
from arc_suite.tasks.parameters import Parameters
from arc_suite.tasks.parts import Grid, Rays
from arc_suite.tasks.readings import Readings
from arc_suite.tasks.sensors import RAYS, SCAN, SIGHT

STARTS = ("standing", "belly")  # poses in which an episode starts
LEVELS = 10  # of a curriculum, with difficulties from 0 to 1
STAYS = 0.75  # probability of the highest level after itself; else any
SPREAD = 6.0  # half-width of the start across the lane, h, as are the next four
OFF_LANE = 10.0  # distance from the middle of the lane at which an episode is truncated
SUNK = 0.05  # depth of a foot's center under the ground that a contact never reaches
LONGEST = 300.0  # length of a lane ahead of the start
END = 1.0  # before the end of a lane, at which an episode is truncated
SINKING = 5  # consecutive control steps after which a foot has sunk for good


class Nothing(NamedTuple):
    """Memory of a ground that remembers nothing."""


@dataclasses.dataclass(frozen=True)
class Ground:
    """Where a body moves.

    Attributes:
        own_arena: whether the ground is the only arena of the task.
        blocks: that it adds to the observation, by name.
    """

    own_arena: ClassVar[bool] = False
    blocks: ClassVar[Mapping[str, Block]] = {}

    @property
    def adapts(self) -> bool:
        """Whether the outcome of an episode chooses where the next one starts."""
        return False

    @property
    def lies(self) -> bool:
        """Whether a body starts with its torso on the ground."""
        return False

    @property
    def settings(self) -> tuple[str, ...]:
        """The names of the fields that a caller may set."""
        return ()

    def with_settings(self, overrides: Mapping[str, Any]) -> Self:
        """Return the ground with checked settings in place of its own.

        Raises:
            ValueError: a value that does not fit.
        """
        return self

    def arena(self, body: Body, parameters: Parameters) -> Arena:
        """Return the arena that suits a body."""
        return FLAT

    def pose(self, scene) -> np.ndarray:
        """Return the pose (nq,) in which a body starts in a `contract.Scene`, before noise and displacement."""
        return scene.standing

    def first(self) -> Any:
        """Return the stream state with which a new stream of episodes begins."""
        return None

    def place(self, context: Context, random: np.random.RandomState, stream) -> tuple[Any, tuple[float, float]]:
        """Draw where the body starts: return the memory, and the displacement of the start, x and y, m."""
        return Nothing(), (0.0, 0.0)

    def share(self, memory) -> float:
        """Return how far a curriculum has widened the ranges of commands, from 0 to 1."""
        return 1.0

    def obstacles(self, context: Context, random: np.random.RandomState, memory) -> tuple[Any, np.ndarray | None]:
        """Draw where obstacles stand: return the memory, and their positions (n, 3), m; None where there are none."""
        return memory, None

    def touches(self, data):
        """Return whether the body touches an obstacle, (...) booleans; None where there are none."""
        return None

    def after(self, context: Context, memory, place, readings, arrived) -> Any:
        """Return the memory after a control step; `arrived` (...) says whether it reached a goal."""
        return memory

    def ended(self, memory, fell) -> tuple:
        """Return whether the episode is terminated and whether it is truncated, given whether the body fell."""
        return fell, False

    def observe(self, context: Context, memory, place, readings: Readings) -> dict:
        """Return the blocks that it adds to the observation."""
        return {}

    def progress(self, memory) -> dict:
        """Return the metrics that it adds to progress."""
        return {}

    def stream_state(self, memory, outcome, fell) -> Any:
        """Return what the next episode of the stream starts from."""
        return None


class Stream(NamedTuple):
    """What an episode leaves to the next one of its stream.

    Attributes:
        level: of a curriculum.
        outcome: share of what was commanded that it achieved; NaN where there was no episode.
        failed: whether it ended in failure.
        visited: whether its level was any one in place of the highest.
    """

    level: int | np.ndarray
    outcome: float | np.ndarray
    failed: bool | np.ndarray
    visited: bool | np.ndarray = False


class Lane(NamedTuple):
    """Memory of lanes.

    Attributes:
        lane: (...) y of its middle, m.
        level: (...) of the curriculum; 0 without one.
        visits: (...) whether the level is any one in place of the highest.
        sinking: (...) consecutive control steps for which a foot has been under ground.
        sunk: (...) whether a foot is stuck in the ground, which contacts should never allow.
        left: (...) whether the torso has left the lane, to a side or at an end.
    """

    lane: np.ndarray
    level: np.ndarray
    visits: np.ndarray
    sinking: np.ndarray
    sunk: np.ndarray
    left: np.ndarray


def next_level(stream: Stream, stays, other, down: float, up: float):
    """Return the level (...) of the next episode, and whether it visits any level; arrays have any leading axes.

    Who masters the highest level visits another one for one episode in four, and returns.

    Args:
        stream: of the episode before.
        stays: (...) drawn from 0 to 1.
        other: (...) a level, drawn.
        down: outcome below which the level falls.
        up: outcome above which it rises, unless the episode failed.
    """
    level = np.asarray(stream.level) if isinstance(stream.level, int) else stream.level
    numpy, highest = level.__array_namespace__(), LEVELS - 1
    rises = (stream.outcome > up) & numpy.logical_not(stream.failed)
    starts = rises & (level == highest) & numpy.logical_not(stream.visited) & (stays >= STAYS)
    goes_on = stream.visited & numpy.isnan(stream.outcome)  # nothing happened on the visit
    risen = numpy.where(starts, other, (level + 1).clip(max=highest))
    fallen = numpy.where(stream.outcome < down, (level - 1).clip(0), level)
    returns = stream.visited & ~goes_on
    return numpy.where(returns, highest, numpy.where(rises, risen, fallen)), starts | goes_on


class Widened(NamedTuple):
    """Memory of level ground with a curriculum.

    Attributes:
        level: (...) of the curriculum.
        visits: (...) whether the level is any one in place of the highest.
    """

    level: np.ndarray
    visits: np.ndarray


@dataclasses.dataclass(frozen=True)
class Level(Ground):
    """Any arena that a caller chooses, flat ground by default.

    Attributes:
        start: "standing", or "belly": the body begins with its torso on the ground.
        curriculum: whether the ranges of commands widen from the usual ones to those that are asked for.
        level: at which a curriculum begins.
        thresholds: outcomes below and above which its level falls and rises.
    """

    start: str = STARTS[0]
    curriculum: bool = False
    level: int = 0
    thresholds: tuple[float, float] = (0.25, 0.5)

    @property
    def settings(self) -> tuple[str, ...]:
        """The names of the fields that a caller may set."""
        return ("start", *CURRICULUM)

    def with_settings(self, overrides: Mapping[str, Any]) -> Self:
        """Return the ground with checked settings."""
        start = checks.name(overrides.get("start", self.start), STARTS, "start")
        curriculum = checks.boolean("curriculum", overrides.get("curriculum", self.curriculum))
        level = checks.integer("level", overrides.get("level", self.level), 0, LEVELS - 1)
        for name, given in (
            ("curriculum", curriculum and not overrides.get("commands")),
            ("level", level and not curriculum),
        ):
            if given:
                wanted = "commands, whose ranges it widens" if name == "curriculum" else "curriculum=True"
                raise ValueError(f"{name}: expected with {wanted}, got {overrides[name]}")
        return dataclasses.replace(self, start=start, curriculum=curriculum, level=level)

    @property
    def adapts(self) -> bool:
        """Whether there is a curriculum."""
        return self.curriculum

    def first(self) -> Stream | None:
        """Return the level at which a stream begins."""
        return Stream(self.level, np.nan, False) if self.curriculum else None

    def place(self, context: Context, random: np.random.RandomState, stream):
        """Draw the level of a curriculum, in two draws; the body starts at the origin."""
        if not self.curriculum:
            return super().place(context, random, stream)
        level, visits = next_level(stream, random.uniform(), random.randint(LEVELS), *self.thresholds)
        return Widened(int(level), visits), (0.0, 0.0)

    def share(self, memory) -> float:
        """Return how far the ranges of commands are widened, from 0 to 1."""
        return memory.level / (LEVELS - 1.0) if self.curriculum else 1.0

    def progress(self, memory) -> dict:
        """Return the `level` of a curriculum."""
        return {"level": memory.level * 1.0} if self.curriculum else {}

    def stream_state(self, memory, outcome, fell) -> Stream | None:
        """Return what the next level follows from."""
        return Stream(memory.level, outcome, fell, memory.visits) if self.curriculum else None

    @property
    def lies(self) -> bool:
        """Whether a body starts with its torso on the ground."""
        return self.start == "belly"

    def pose(self, scene) -> np.ndarray:
        """Return the pose of the start, lying or standing."""
        if not self.lies:
            return scene.standing
        (height, angles), qpos = posture.belly(scene.body), scene.standing.copy()
        qpos[2] = height
        qpos[scene.layout.joint_angles] += angles
        return qpos


@dataclasses.dataclass(frozen=True)
class Lanes(Ground):
    """Lanes along x. An episode draws one lane of the difficulty, or of the level of a curriculum.

    Attributes:
        kinds: of ground, in the order of `terrain.KINDS`; an episode draws one.
        copies: lanes of each kind, and of each kind and level of a curriculum; boxes cost time, so there are fewer.
        middle: share of the lane's length at which a body starts.
        thresholds: outcomes below and above which a curriculum's level falls and rises.
        difficulty: difficulty of all lanes, without a curriculum.
        curriculum: whether episodes climb levels of difficulty by their outcomes.
        level: level at which a curriculum begins.
        terrain_seed: seed of the random ground.
        rise, slope, width: size of obstacles, m, the slope in rad; None for the size that follows from the difficulty.
    """

    kinds: tuple[str, ...]
    copies: tuple[int, int] = (8, 2)
    middle: float = 0.0
    thresholds: tuple[float, float] = (0.4, 0.8)
    difficulty: float = terrain.DIFFICULTY
    curriculum: bool = False
    level: int = 0
    terrain_seed: int = 0
    rise: float | None = None
    slope: float | None = None
    width: float | None = None

    own_arena: ClassVar[bool] = True
    blocks: ClassVar[Mapping[str, Block]] = {
        "scan": Block((Grid(SCAN, "ground {:.2f} R forward, {:.2f} R left", "h"),), noise=0.1)
    }

    @property
    def settings(self) -> tuple[str, ...]:
        """The names of the fields that a caller may set; sizes where there is one kind of ground."""
        return ("difficulty", *CURRICULUM, "terrain_seed", *terrain.sizes(self.kinds))

    def with_settings(self, overrides: Mapping[str, Any]) -> Self:
        """Return the lanes with checked settings."""
        given = {name: overrides.get(name, getattr(self, name)) for name in self.settings}
        sizes = [name for name in terrain.sizes(self.kinds) if given[name] is not None]
        for name in ("difficulty", *CURRICULUM):
            if sizes and name in overrides:
                raise ValueError(f"{name}: expected none with {sizes[0]}={given[sizes[0]]}, got {overrides[name]}")
        return dataclasses.replace(
            self,
            difficulty=checks.number("difficulty", given["difficulty"], 0.0, 1.0),
            curriculum=checks.boolean("curriculum", given["curriculum"]),
            level=checks.integer("level", given["level"], 0, LEVELS - 1),
            terrain_seed=checks.integer("terrain_seed", given["terrain_seed"], 0, 2**32 - 1),
            **{name: checks.number(name, given[name], *terrain.SIZES[name]) for name in sizes},
        )

    @property
    def adapts(self) -> bool:
        """Whether there is a curriculum."""
        return self.curriculum

    def arena(self, body: Body, parameters: Parameters) -> Arena:
        """Return the lanes, long enough for the distance at the target velocity, and a seventh more."""
        distance = abs(parameters.target_velocity) * STEPS * control_timestep(body)
        length = min(6.0 + np.ceil(1.15 * distance / body.torso.standing_height), LONGEST)
        levels = np.arange(LEVELS) / (LEVELS - 1.0) if self.curriculum else [self.difficulty]
        copies = dict.fromkeys(self.kinds, self.copies[self.curriculum])
        sizes = {name: size for name in terrain.SIZES if (size := getattr(self, name)) is not None}
        return terrain.made(body, copies, float(length), tuple(map(float, levels)), self.terrain_seed, sizes)

    def first(self) -> Stream:
        """Return the level at which a stream begins, which its first episode neither raises nor lowers."""
        return Stream(self.level, np.nan, False)

    def place(self, context: Context, random: np.random.RandomState, stream: Stream):
        """Draw kind, level (two draws), lane and place across it."""
        kind, stays, other = random.randint(len(self.kinds)), random.uniform(), random.randint(LEVELS)
        copies, arena = self.copies[self.curriculum], context.arena
        lane, aside = random.randint(copies), random.uniform(-SPREAD, SPREAD)
        level, visits, levels = 0, np.False_, 1
        if self.curriculum:
            (level, visits), levels = next_level(stream, stays, other, *self.thresholds), LEVELS
        middle = arena.start((kind * levels + int(level)) * copies + lane)
        start = (self.middle * arena.length * arena.unit, middle + aside * arena.unit)
        return Lane(np.float64(middle), int(level), visits, 0, np.False_, np.False_), start

    def after(self, context: Context, memory: Lane, place, readings: Readings, arrived) -> Lane:
        """Count how long a foot has been under ground, and see whether the torso is still in the lane."""
        unit, length = context.arena.unit, context.arena.length
        sinking = (memory.sinking + 1) * (readings.foot_heights < -SUNK * unit).any(axis=-1)
        x, y = place[..., 0], place[..., 1]
        beyond = (x > (length - END) * unit) | (x < (END - terrain.BACK) * unit)
        left = beyond | (abs(y - memory.lane) > OFF_LANE * unit)
        return memory._replace(sinking=sinking, sunk=sinking >= SINKING, left=left)

    def ended(self, memory: Lane, fell) -> tuple:
        """Terminate where the body fell or a foot sank; truncate where the torso has left the lane."""
        return fell | memory.sunk, memory.left

    def observe(self, context: Context, memory: Lane, place, readings: Readings) -> dict:
        """Return the heights (..., 175) of the ground at `sensors.SCAN`, in h, clipped to [-1, 1].

        0 is where the ground would be if the torso stood over it at its standing height.
        """
        position, heading, arena = readings.torso_position, place[..., 2], context.arena
        numpy = position.__array_namespace__()
        reach = numpy.asarray(context.reach)[..., None]
        forward, left = numpy.asarray(SCAN[0]) * reach, numpy.asarray(SCAN[1]) * reach
        cosine, sine = numpy.cos(heading)[..., None], numpy.sin(heading)[..., None]
        x = position[..., 0:1] + cosine * forward - sine * left
        y = position[..., 1:2] + sine * forward + cosine * left
        return {"scan": ((arena.height(x, y) - position[..., 2:3]) / arena.unit + 1.0).clip(-1.0, 1.0)}

    def progress(self, memory: Lane) -> dict:
        """Return whether a foot `sank`, and the `level` of a curriculum."""
        return {"sank": memory.sunk * 1.0} | ({"level": memory.level * 1.0} if self.curriculum else {})

    def stream_state(self, memory: Lane, outcome, fell) -> Stream:
        """Return what the next level follows from."""
        return Stream(memory.level, outcome, fell | memory.sunk, memory.visits)


class Pillared(NamedTuple):
    """Memory of a field of pillars.

    Attributes:
        pillars: (..., COUNT, 2) where they stand, m.
        touched: (...) whether a pillar was touched on the way to the present goal.
        collisions: (...) ways to a goal, the present one among them, on which a pillar was touched.
    """

    pillars: np.ndarray
    touched: np.ndarray
    collisions: np.ndarray


@dataclasses.dataclass(frozen=True)
class PillarField(Ground):
    """A floor with pillars, seen by a range sensor. Lengths are multiples of R, as bodies fit between by their legs."""

    own_arena: ClassVar[bool] = True
    blocks: ClassVar[Mapping[str, Block]] = {
        "ranges": Block((Rays(RAYS, "range at {:.0f} degrees to the left", f"{SIGHT:g} R"),), noise=0.02)
    }

    def arena(self, body: Body, parameters: Parameters) -> Arena:
        """Return a floor with pillars that suits the body's size."""
        return Pillars(reach(body), 2.0 * body.torso.standing_height)

    def obstacles(self, context: Context, random: np.random.RandomState, memory) -> tuple[Pillared, np.ndarray]:
        """Draw where pillars stand."""
        pillars = context.arena.places(random.uniform(-1.0, 1.0, (COUNT, 2)))
        return Pillared(pillars[:, :2], np.False_, 0), pillars

    def touches(self, data):
        """Return whether a force acts on a pillar."""
        return (data.cfrc_ext[..., -COUNT:, :] != 0.0).any(axis=(-2, -1))

    def after(self, context: Context, memory: Pillared, place, readings, arrived) -> Pillared:
        """Count the ways on which a pillar was touched."""
        collided = readings.touches & ~memory.touched
        touched = (memory.touched | readings.touches) & ~arrived
        return Pillared(memory.pillars, touched, memory.collisions + collided)

    def observe(self, context: Context, memory: Pillared, place, readings: Readings) -> dict:
        """Return the distances (..., 24) of pillars along `sensors.RAYS`, as shares of `SIGHT`, at most 1."""
        numpy, unit = place.__array_namespace__(), context.arena.unit
        apart = memory.pillars - place[..., None, :2]
        apart = rotations.to_heading_frame(apart, place[..., 2:]) / unit
        x, y = apart[..., None, :, 0], apart[..., None, :, 1]
        forward, left = numpy.asarray(RAYS)[..., None]
        along = x * forward + y * left
        # Half of the chord that the ray cuts off the pillar, squared.
        chord = RADIUS * RADIUS - (x * left - y * forward) ** 2
        hit = numpy.where((chord >= 0.0) & (along >= 0.0), along - numpy.sqrt(chord.clip(0.0)), SIGHT)
        return {"ranges": (hit.min(axis=-1) / SIGHT).clip(0.0, 1.0)}

    def progress(self, memory: Pillared) -> dict:
        """Return on how many ways a pillar was touched."""
        return {"collisions": memory.collisions * 1.0}
