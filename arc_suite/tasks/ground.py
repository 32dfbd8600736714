"""Grounds: where a task with a command takes place, and what a body observes of it.

A ground is a frozen value with pure functions of its own memory. `place` is (..., 3): x and y of the
torso's frame, m, and its yaw, rad.
"""

import dataclasses
import math
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
from arc_suite.tasks.contract import CURRICULUM, LEVEL, STEPS
from arc_suite.tasks.fitting import reach
from arc_suite.tasks.parameters import Parameters
from arc_suite.tasks.parts import Grid, Rays
from arc_suite.tasks.readings import Readings
from arc_suite.tasks.sensors import RAYS, SCAN, SIGHT

STARTS = ("standing", "belly")  # poses in which an episode starts
LEVELS = 10  # of a curriculum, with difficulties from 0 to 1
STAY_PROBABILITY = 0.75  # of the highest level after itself; else any level follows
START_SPREAD = 6.0  # largest distance of the start from the middle of the lane, h
OFF_LANE = 10.0  # distance from the middle of the lane at which an episode is truncated, h
MAX_LANE_LENGTH = 300.0  # ahead of the start, h
SUNK_DEPTH = 0.05  # of a foot's center under the ground, h; the center of a foot in contact is never so deep
SUNK_STEPS = 5  # consecutive control steps at this depth after which a foot is stuck
_LANE_MARGIN_FACTOR = 1.15  # of the length of a lane, over the distance at the target velocity
_LANE_MARGIN = 6.0  # added to the length of a lane, h

SCAN_BLOCKS = {"scan": Block((Grid(SCAN, "ground {:.2f} R forward, {:.2f} R left", "h"),), noise=0.1)}


class Nothing(NamedTuple):
    """Memory of a ground that has nothing to remember."""


@dataclasses.dataclass(frozen=True)
class Ground:
    """Where a body moves.

    Attributes:
        own_arena: whether the ground is the only arena of the task.
    """

    own_arena: ClassVar[bool] = False

    @property
    def blocks(self) -> Mapping[str, Block]:
        """The blocks that it adds to the observation, by name."""
        return {}

    @property
    def adapts(self) -> bool:
        """Whether the start of an episode depends on the outcome of the previous one."""
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
        """Return the share, from 0 to 1, by which a curriculum has widened the ranges of commands."""
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
        """Return the stream state from which the next episode starts."""
        return None


class Stream(NamedTuple):
    """Stream state of a curriculum, which an episode leaves for the next one.

    Attributes:
        level: level of the episode.
        outcome: outcome of the episode, see `Command.outcome`; NaN where there was none.
        failed: whether the episode ended in failure.
        visited: whether the episode visited another level from the highest one, to which the next one returns.
    """

    level: int | np.ndarray
    outcome: float | np.ndarray
    failed: bool | np.ndarray
    visited: bool | np.ndarray = False


class Lane(NamedTuple):
    """Memory of `Lanes`: the lane in which the episode began.

    Attributes:
        center_y: (...) y of the middle of the lane, m.
        level: (...) level of the curriculum; 0 without one.
        visits: (...) whether the episode visits this level, from the highest one.
        steps_under_ground: (...) consecutive control steps for which a foot has been at `SUNK_DEPTH`.
        is_stuck: (...) whether a foot is stuck under the ground, an artifact of contacts.
        has_left: (...) whether the torso has left the lane to a side.
    """

    center_y: np.ndarray
    level: np.ndarray
    visits: np.ndarray
    steps_under_ground: np.ndarray
    is_stuck: np.ndarray
    has_left: np.ndarray


def next_level(stream: Stream, chance, level_to_visit, down: float, up: float):
    """Return the level (...) of the next episode, and whether (...) the episode visits it.

    After a success at the highest level, one episode in four visits another level, and the next one returns.

    Args:
        stream: state that the previous episode has left.
        chance: (...) drawn from 0 to 1; it decides whether a visit begins.
        level_to_visit: (...) drawn.
        down: outcome below which the level falls.
        up: outcome above which the level rises, unless the episode failed.
    """
    level = np.asarray(stream.level) if isinstance(stream.level, int) else stream.level
    xp = level.__array_namespace__()
    highest = LEVELS - 1
    has_succeeded = (stream.outcome > up) & xp.logical_not(stream.failed)
    may_visit = has_succeeded & (level == highest) & xp.logical_not(stream.visited)
    begins_visit = may_visit & (chance >= STAY_PROBABILITY)
    continues_visit = stream.visited & xp.isnan(stream.outcome)  # the visit had no outcome
    ends_visit = stream.visited & ~continues_visit
    level_after_success = xp.where(begins_visit, level_to_visit, (level + 1).clip(max=highest))
    level_otherwise = xp.where(stream.outcome < down, (level - 1).clip(0), level)
    level = xp.where(has_succeeded, level_after_success, level_otherwise)
    return xp.where(ends_visit, highest, level), begins_visit | continues_visit


def observe_scan(context: Context, place, readings: Readings) -> dict:
    """Return the block `scan`: the heights (..., 175) of the ground at `sensors.SCAN`, in h, clipped to [-1, 1].

    0 is the height of the ground if the torso is at its standing height.
    """
    position = readings.torso_position
    heading = place[..., 2]
    xp = position.__array_namespace__()
    reach = xp.asarray(context.reach)[..., None]  # R, m
    forward = xp.asarray(SCAN[0]) * reach
    left = xp.asarray(SCAN[1]) * reach
    cosine = xp.cos(heading)[..., None]
    sine = xp.sin(heading)[..., None]
    x = position[..., 0:1] + cosine * forward - sine * left
    y = position[..., 1:2] + sine * forward + cosine * left
    heights = (context.arena.height(x, y) - position[..., 2:3]) / context.height + 1.0
    return {"scan": heights.clip(-1.0, 1.0)}


class Widened(NamedTuple):
    """Memory of `Level` with a curriculum.

    Attributes:
        level: (...) level of the curriculum.
        visits: (...) whether the episode visits this level, from the highest one.
    """

    level: np.ndarray
    visits: np.ndarray


@dataclasses.dataclass(frozen=True)
class Level(Ground):
    """Any arena that a caller chooses, flat ground by default.

    Attributes:
        start: "standing", or "belly": the body begins with its torso on the ground.
        curriculum: whether the ranges of commands widen from the default ones to those of the setting `commands`.
        level: level at which a curriculum begins.
        scan: whether a body observes the heights of the ground around it.
        thresholds: outcomes below and above which its level falls and rises.
    """

    start: str = STARTS[0]
    curriculum: bool = False
    level: int = 0
    scan: bool = False
    thresholds: tuple[float, float] = (0.25, 0.5)

    @property
    def settings(self) -> tuple[str, ...]:
        """The names of the fields that a caller may set."""
        return ("start", CURRICULUM, LEVEL, "scan")

    @property
    def blocks(self) -> Mapping[str, Block]:
        """The height scan, if there is one."""
        return SCAN_BLOCKS if self.scan else {}

    def with_settings(self, overrides: Mapping[str, Any]) -> Self:
        """Return the ground with checked settings."""
        start = checks.name(overrides.get("start", self.start), STARTS, "start")
        curriculum, level = _check_curriculum(self, overrides)
        if curriculum and not overrides.get("commands"):
            raise ValueError("curriculum: needs the setting commands, whose ranges it widens")
        scan = checks.boolean("scan", overrides.get("scan", self.scan))
        return dataclasses.replace(self, start=start, curriculum=curriculum, level=level, scan=scan)

    def observe(self, context: Context, memory, place, readings: Readings) -> dict:
        """Return the height scan, if there is one."""
        return observe_scan(context, place, readings) if self.scan else {}

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
        """Return the share, from 0 to 1, by which the ranges of commands are widened."""
        return memory.level / (LEVELS - 1.0) if self.curriculum else 1.0

    def progress(self, memory) -> dict:
        """Return the `level` of a curriculum."""
        return {"level": memory.level * 1.0} if self.curriculum else {}

    def stream_state(self, memory, outcome, fell) -> Stream | None:
        """Return the stream state of the curriculum; None without one."""
        return Stream(memory.level, outcome, fell, memory.visits) if self.curriculum else None

    @property
    def lies(self) -> bool:
        """Whether a body starts with its torso on the ground."""
        return self.start == "belly"

    def pose(self, scene) -> np.ndarray:
        """Return the pose of the start, lying or standing."""
        if not self.lies:
            return scene.standing
        height, angles = posture.find_belly_pose(scene.body)
        qpos = scene.standing.copy()
        qpos[2] = height
        qpos[scene.layout.joint_angles] += angles
        return qpos


@dataclasses.dataclass(frozen=True)
class Lanes(Ground):
    """Lanes along x. An episode draws one lane of the difficulty, or of the level of a curriculum.

    Attributes:
        kinds: kinds of ground, in the order of `terrain.KINDS`; an episode draws one.
        copies: number of lanes of each kind without a curriculum, and of each kind and level with one. There are fewer
            of kinds made of boxes, which take time to simulate.
        middle: share of the lane's length at which a body starts.
        thresholds: outcomes below and above which a curriculum's level falls and rises.
        difficulty: difficulty of all lanes, without a curriculum.
        curriculum: whether episodes climb levels of difficulty by their outcomes.
        level: level at which a curriculum begins.
        terrain_seed: seed of the random ground.
        rise, slope, width: size of obstacles, m, the slope in rad; None for the size that follows from the difficulty.
        roams: whether commands lead to all sides. Then a body may change lanes, and further lanes lie on both sides of
            those in which episodes start.
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
    roams: bool = False

    own_arena: ClassVar[bool] = True

    @property
    def blocks(self) -> Mapping[str, Block]:
        """The height scan."""
        return SCAN_BLOCKS

    @property
    def settings(self) -> tuple[str, ...]:
        """The names of the fields that a caller may set; sizes where there is one kind of ground."""
        return ("difficulty", CURRICULUM, LEVEL, "terrain_seed", *terrain.sizes(self.kinds))

    def with_settings(self, overrides: Mapping[str, Any]) -> Self:
        """Return the lanes with checked settings."""
        values = {name: overrides.get(name, getattr(self, name)) for name in self.settings}
        size_names = [name for name in terrain.sizes(self.kinds) if values[name] is not None]
        for name in ("difficulty", CURRICULUM, LEVEL):
            if size_names and name in overrides:
                size_name = size_names[0]
                raise ValueError(f"{name}: expected none with {size_name}={values[size_name]}, got {overrides[name]}")
        sizes: dict[str, Any] = {}
        for name in size_names:
            sizes[name] = checks.number(name, values[name], *terrain.SIZES[name])
        difficulty = checks.number("difficulty", values["difficulty"], 0.0, 1.0)
        curriculum, level = _check_curriculum(self, overrides)
        if curriculum and "difficulty" in overrides:
            raise ValueError(
                "difficulty: expected none with curriculum=True, as each level has its own, "
                f"got {overrides['difficulty']}"
            )
        return dataclasses.replace(
            self,
            difficulty=difficulty,
            curriculum=curriculum,
            level=level,
            terrain_seed=checks.integer("terrain_seed", values["terrain_seed"], 0, 2**32 - 1),
            **sizes,
        )

    @property
    def adapts(self) -> bool:
        """Whether there is a curriculum."""
        return self.curriculum

    def arena(self, body: Body, parameters: Parameters) -> Arena:
        """Return the lanes, which are longer than the distance that a body walks at the target velocity."""
        distance = abs(parameters.target_velocity) * STEPS * control_timestep(body)  # m
        distance_with_margin = np.ceil(_LANE_MARGIN_FACTOR * distance / body.torso.standing_height)  # h
        length = min(_LANE_MARGIN + distance_with_margin, MAX_LANE_LENGTH)
        if self.curriculum:
            difficulties = tuple(float(difficulty) for difficulty in np.arange(LEVELS) / (LEVELS - 1.0))
        else:
            difficulties = (float(self.difficulty),)
        copies = dict.fromkeys(self.kinds, self._copies)
        sizes = {name: getattr(self, name) for name in terrain.SIZES if getattr(self, name) is not None}
        lanes = terrain.make_lanes(body, copies, float(length), difficulties, self.terrain_seed, sizes)
        if not self.roams:
            return lanes
        # A body starts in the middle of the length, and can go as far to either side.
        side_lanes = math.ceil((0.5 * length + START_SPREAD - 0.5 * terrain.WIDTH) / terrain.WIDTH)
        first_lane = lanes.lanes[0]
        last_lane = lanes.lanes[-1]
        all_lanes = (first_lane,) * side_lanes + lanes.lanes + (last_lane,) * side_lanes
        return dataclasses.replace(lanes, lanes=all_lanes)

    def first(self) -> Stream:
        """Return the level at which a stream begins; without an outcome, the first episode has it."""
        return Stream(self.level, np.nan, False)

    @property
    def _copies(self) -> int:
        """The number of lanes of each kind and level."""
        without_curriculum, with_curriculum = self.copies
        return with_curriculum if self.curriculum else without_curriculum

    def place(self, context: Context, random: np.random.RandomState, stream: Stream):
        """Draw kind, level (two draws), lane and distance from the middle of the lane, in this order."""
        kind = random.randint(len(self.kinds))
        chance = random.uniform()
        level_to_visit = random.randint(LEVELS)
        lane = random.randint(self._copies)
        distance = random.uniform(-START_SPREAD, START_SPREAD)  # h
        level = 0
        visits = np.False_
        levels = 1
        if self.curriculum:
            level, visits = next_level(stream, chance, level_to_visit, *self.thresholds)
            levels = LEVELS
        arena = context.arena
        number = (kind * levels + int(level)) * self._copies + lane  # of the lane among those with starts
        starting_lanes = len(self.kinds) * levels * self._copies
        side_lanes = (len(arena.lanes) - starting_lanes) // 2
        center_y = arena.start(side_lanes + number)  # m
        x = self.middle * arena.length * arena.unit
        y = center_y + distance * arena.unit
        memory = Lane(
            center_y=np.float64(center_y),
            level=int(level),
            visits=visits,
            steps_under_ground=0,
            is_stuck=np.False_,
            has_left=np.False_,
        )
        return memory, (x, y)

    def after(self, context: Context, memory: Lane, place, readings: Readings, arrived) -> Lane:
        """Return the memory with the steps of a foot under ground, and whether the torso has left the lane."""
        unit = context.arena.unit  # m, the standing height h
        is_under_ground = (readings.foot_heights < -SUNK_DEPTH * unit).any(axis=-1)
        steps_under_ground = (memory.steps_under_ground + 1) * is_under_ground
        is_off_lane = abs(place[..., 1] - memory.center_y) > OFF_LANE * unit
        return memory._replace(
            steps_under_ground=steps_under_ground,
            is_stuck=steps_under_ground >= SUNK_STEPS,
            has_left=is_off_lane & (not self.roams),
        )

    def ended(self, memory: Lane, fell) -> tuple:
        """Return whether the body fell or a foot is stuck, and whether the torso has left the lane."""
        return fell | memory.is_stuck, memory.has_left

    def observe(self, context: Context, memory: Lane, place, readings: Readings) -> dict:
        """Return the height scan."""
        return observe_scan(context, place, readings)

    def progress(self, memory: Lane) -> dict:
        """Return whether a foot `sank`, and the `level` of a curriculum."""
        metrics = {"sank": memory.is_stuck * 1.0}
        if self.curriculum:
            metrics["level"] = memory.level * 1.0
        return metrics

    def stream_state(self, memory: Lane, outcome, fell) -> Stream:
        """Return the level and the outcome of the episode."""
        return Stream(memory.level, outcome, fell | memory.is_stuck, memory.visits)


def _check_curriculum(ground: Level | Lanes, overrides: Mapping[str, Any]) -> tuple[bool, int]:
    """Return whether there is a curriculum, and the level at which it begins: settings of a ground, overridden.

    Raises:
        ValueError: a value that does not fit, or a level without a curriculum.
    """
    curriculum = checks.boolean(CURRICULUM, overrides.get(CURRICULUM, ground.curriculum))
    level = checks.integer(LEVEL, overrides.get(LEVEL, ground.level), 0, LEVELS - 1)
    if level and not curriculum:
        raise ValueError(f"level: needs the setting curriculum=True, got {level}")
    return curriculum, level


class Pillared(NamedTuple):
    """Memory of `PillarField`.

    Attributes:
        pillars: (..., COUNT, 2) positions, m.
        touched: (...) whether a pillar was touched on the way to the present goal.
        collisions: (...) number of ways to a goal on which a pillar was touched, with the present way.
    """

    pillars: np.ndarray
    touched: np.ndarray
    collisions: np.ndarray


@dataclasses.dataclass(frozen=True)
class PillarField(Ground):
    """A floor with pillars, which a range sensor measures. Lengths are in R, as the legs must fit between pillars."""

    own_arena: ClassVar[bool] = True

    @property
    def blocks(self) -> Mapping[str, Block]:
        """The ranges."""
        return {"ranges": Block((Rays(RAYS, "range at {:.0f} degrees to the left", f"{SIGHT:g} R"),), noise=0.02)}

    def arena(self, body: Body, parameters: Parameters) -> Arena:
        """Return a floor with pillars that suits the body's size."""
        return Pillars(reach(body), 2.0 * body.torso.standing_height)

    def obstacles(self, context: Context, random: np.random.RandomState, memory) -> tuple[Pillared, np.ndarray]:
        """Draw the positions of pillars."""
        pillars = context.arena.places(random.uniform(-1.0, 1.0, (COUNT, 2)))
        return Pillared(pillars[:, :2], np.False_, 0), pillars

    def touches(self, data):
        """Return whether a force acts on a pillar."""
        return (data.cfrc_ext[..., -COUNT:, :] != 0.0).any(axis=(-2, -1))

    def after(self, context: Context, memory: Pillared, place, readings, arrived) -> Pillared:
        """Count the ways on which a pillar was touched."""
        is_new_collision = readings.touches & ~memory.touched
        touched = (memory.touched | readings.touches) & ~arrived
        return Pillared(memory.pillars, touched, memory.collisions + is_new_collision)

    def observe(self, context: Context, memory: Pillared, place, readings: Readings) -> dict:
        """Return the distances (..., 24) of pillars along `sensors.RAYS`, as shares of `SIGHT`, at most 1."""
        xp = place.__array_namespace__()
        unit = context.arena.unit  # R, m
        from_torso = memory.pillars - place[..., None, :2]
        from_torso = rotations.to_heading_frame(from_torso, place[..., 2:]) / unit  # R
        x = from_torso[..., None, :, 0]
        y = from_torso[..., None, :, 1]
        forward, left = xp.asarray(RAYS)[..., None]
        distance_along_ray = x * forward + y * left  # of the axis of each pillar
        distance_from_ray = x * left - y * forward
        squared_half_chord = RADIUS * RADIUS - distance_from_ray**2  # of the ray in the pillar
        is_hit = (squared_half_chord >= 0.0) & (distance_along_ray >= 0.0)
        distance_of_hit = distance_along_ray - xp.sqrt(squared_half_chord.clip(0.0))
        ranges = xp.where(is_hit, distance_of_hit, SIGHT)
        return {"ranges": (ranges.min(axis=-1) / SIGHT).clip(0.0, 1.0)}

    def progress(self, memory: Pillared) -> dict:
        """Return the number of ways on which a pillar was touched."""
        return {"collisions": memory.collisions * 1.0}
