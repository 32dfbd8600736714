"""Commands: the velocity that a body is to follow, and how well it does.

A command is a frozen value with pure functions of its own memory. Velocities are (forward, left,
turning) as the torso heads, in the units of `Context.units`. `place` is (..., 3): x and y of the
torso's frame, m, and its yaw, rad.
"""

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple, Protocol, Self, runtime_checkable

import numpy as np

from arc_suite import checks, rotations
from arc_suite.arenas.pillars import CELLS, PITCH
from arc_suite.markers import Marker
from arc_suite.robots.spec import Body
from arc_suite.tasks import terms
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.context import Context
from arc_suite.tasks.parts import Planar, Scalar
from arc_suite.tasks.readings import component
from arc_suite.tasks.sensors import FAR

BAND = 0.75  # of the command, and of half of the unit at least: the error at which tracking earns nothing
RANGES = ((-0.5, 1.0), (-0.5, 0.5), (-1.0, 1.0))  # of commands that are drawn: forward, left and turning
DIRECTIONS, FARTHEST = ("forward", "left", "turning"), 10.0  # names of these, and bound of what may be drawn
COMMANDS, SHORTEST, LONGEST = 17, 60, 161  # of a schedule, and control steps that each is held

GOALS = 16  # of a chain; after the last one the way leads back
NEAR = 0.7  # distance of the torso at which a goal is reached, R
_DISK, _GOAL = 0.02, (0.2, 0.9, 0.4, 1.0)  # thickness, R, and color of the disk that shows a goal

_MOVES = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j]


class Followed(NamedTuple):
    """A command after a control step.

    Attributes:
        memory: of the command.
        desired: (..., 3) the velocity that holds from now on.
        tracking: (...) how well the step followed it, at most 1.
        arrived: (...) whether the step reached a goal; False where there are none.
    """

    memory: Any
    desired: np.ndarray
    tracking: np.ndarray
    arrived: np.ndarray | bool = False


@runtime_checkable
class WithLive(Protocol):
    """What the memory of a command must have that can be set live, see `Command.live`: a NamedTuple with this field.

    Attributes:
        live: (..., 3) velocity that is set from outside; NaN for what the task itself would do.
    """

    live: np.ndarray


@dataclasses.dataclass(frozen=True)
class Command(ABC):
    """What a body is to follow.

    A command of a new kind writes the five abstract methods. Unless its `live` is empty, its memory is a `WithLive`.

    Attributes:
        settings: names of the fields that a caller may set.
    """

    settings: ClassVar[tuple[str, ...]] = ()

    @abstractmethod
    def start(self, context: Context, random: np.random.RandomState, schedule: "Scheduled") -> Any:
        """Return the memory at the start; see `CommandTask.start` for the order of draws."""

    @abstractmethod
    def desired(self, context: Context, memory, steps, place):
        """Return the velocity (..., 3) that holds at a place after control steps (...)."""

    @abstractmethod
    def follow(self, context: Context, memory, steps, before, place, motion, readings) -> Followed:
        """Return the command after a control step.

        Args:
            context: of the task.
            memory: of the command, before the step.
            steps: (...) control steps since the start.
            before: (..., 3) the place before the step.
            place: (..., 3) the place after it.
            motion: (..., 3) mean velocity of the torso.
            readings: after the step.
        """

    @abstractmethod
    def terms(self, memory, followed, upright, stepped) -> dict:
        """Return the bonuses for following, each (...), by name.

        Args:
            memory: of the command, after the step.
            followed: (...) tracking of the step.
            upright: (...) cosine of the torso's tilt.
            stepped: (...) share of the feet that followed the contact schedule.
        """

    @abstractmethod
    def observe(self, context: Context, memory) -> dict:
        """Return the blocks that it adds to the observation, those of `blocks`."""

    def with_settings(self, body: Body, overrides: Mapping[str, Any]) -> Self:
        """Return the command with checked settings in place of its own.

        Raises:
            ValueError: a value that does not fit.
        """
        return self

    def live(self, body: Body) -> dict[str, int]:
        """Return the sizes of what may be set from outside while an episode runs, by name."""
        return {"command": 3}

    def blocks(self, body: Body) -> dict[str, Block]:
        """Return the blocks that it adds to the observation, by name."""
        return {}

    def schedule(self, random: np.random.RandomState, share: float) -> "Scheduled":
        """Draw a schedule, which every command does; `share` says how far a curriculum has widened its ranges."""
        return draw_schedule(random)

    def begin(self, context: Context, memory, place) -> Any:
        """Return the memory from which the first step starts."""
        return memory

    def resampled(self, memory, steps) -> Any:
        """Return whether (...) another drawn command holds since control step `steps` (...)."""
        return False

    def progress(self, context: Context, memory, judged) -> dict:
        """Return the metrics that it adds to progress, given the steps (...) over which the episode is judged."""
        return {}

    def outcome(self, context: Context, memory, tracking, judged):
        """Return the outcome (...) by which a curriculum judges an episode: its mean tracking."""
        return tracking / judged

    def markers(self, context: Context, memory) -> list[Marker]:
        """Return what pictures show of it, in addition to the command's arrows."""
        return []


class Live(NamedTuple):
    """Memory of a command that can be set live.

    Attributes:
        live: (..., 3) set from outside; NaN for what the task itself would do.
        distance: (...) along world x since the start, m.
        gained: (...) velocity along world x by the target velocity, a leaky mean over a cycle of the gait.
    """

    live: np.ndarray
    distance: np.ndarray
    gained: np.ndarray


class Scheduled(NamedTuple):
    """Memory of a schedule.

    Attributes:
        ends: (..., COMMANDS) steps at which the commands of the schedule end.
        schedule: (..., COMMANDS, 3) commands.
        live: (..., 3) set from outside, in place of the schedule where it is not NaN.
        gained: (...) share of the command that the mean motion reaches in its direction; 0 at a stop.
    """

    ends: np.ndarray
    schedule: np.ndarray
    live: np.ndarray
    gained: np.ndarray


def draw_schedule(random: np.random.RandomState, ranges=RANGES) -> Scheduled:
    """Draw how long each command is held, then the commands between ranges (3, 2)."""
    ends = random.randint(SHORTEST, LONGEST, COMMANDS).cumsum()
    schedule = np.array([draw_command(random, ranges) for _ in range(COMMANDS)])
    return Scheduled(ends, schedule, np.full(3, np.nan), np.float64(0.0))


def draw_command(random: np.random.RandomState, ranges=RANGES) -> np.ndarray:
    """Draw a command (3,): mostly forward, some turning or sideways, one in ten a stop; always six draws.

    Speed and turning, as shares of the farthest of their ranges (3, 2) or of 1, are at most 1 together.
    """
    low, high = np.transpose(ranges)
    command = random.uniform(low, high)
    sideways, turns, goes = random.uniform(size=3) < (0.5, 0.7, 0.95)
    command = command * (1.0, sideways, turns)
    fast, quick = max(1.0, *np.abs(ranges[:2]).flat), max(1.0, *np.abs(ranges[2]))
    size = np.hypot(command[0], command[1]) / fast + abs(command[2]) / quick
    return command / max(size, 1.0) * (goes and size >= 0.2)


def tracking(desired, motion):
    """Return how well a motion (..., 3) follows a velocity (..., 3): the product of course and turning, 0 to 1."""
    numpy, error = motion.__array_namespace__(), desired - motion
    speed = numpy.hypot(desired[..., 0], desired[..., 1])
    miss = numpy.hypot(error[..., 0], error[..., 1])
    course = terms.triangle(miss, BAND * numpy.maximum(speed, 0.5))
    return course * terms.triangle(error[..., 2], BAND * numpy.maximum(abs(desired[..., 2]), 0.5))


def along(desired, motion):
    """Return the projection of a motion (..., 3) onto a velocity (..., 3), as a share (...) of it; 0 at a stop.

    Unlike `tracking` it rises from standing still, so a learner finds its first steps by it.
    """
    size, reached = _product(desired, desired), _product(desired, motion)
    return reached / size.__array_namespace__().where(size > 0.0, size, 1.0)


def _product(one, other):
    """The scalar product (...) of vectors (..., 3), summed in one order for any leading axes."""
    products = one * other
    return products[..., 0] + products[..., 1] + products[..., 2]


@dataclasses.dataclass(frozen=True)
class Schedule(Command):
    """Commands that are drawn for the episode, each held for some seconds; stops are among them.

    Attributes:
        commands: ranges that replace some of `RANGES`, by the names in `DIRECTIONS`, in units of the command.
    """

    commands: tuple[tuple[float, float], ...] = RANGES

    settings: ClassVar[tuple[str, ...]] = ("commands",)

    def with_settings(self, body: Body, overrides: Mapping[str, Any]) -> Self:
        """Return the schedule with checked ranges in place of its own."""
        ranges = dict(zip(DIRECTIONS, self.commands, strict=True))
        for name, span in checks.mapping("commands", overrides.get("commands")).items():
            checks.name(name, DIRECTIONS, "command")
            ranges[name] = checks.span(f"commands[{name!r}]", span, -FARTHEST, FARTHEST)
        return dataclasses.replace(self, commands=tuple(ranges.values()))

    def schedule(self, random: np.random.RandomState, share: float) -> Scheduled:
        """Draw a schedule between the ranges, as far as a curriculum has widened them."""
        if share == 1.0:
            return draw_schedule(random, self.commands)
        return draw_schedule(random, np.array(RANGES) + share * np.subtract(self.commands, RANGES))

    def start(self, context: Context, random, schedule: Scheduled) -> Scheduled:
        """Return the drawn schedule."""
        return schedule

    def desired(self, context: Context, memory: Scheduled, steps, place):
        """Return the command that holds; a schedule that has run out begins again."""
        numpy = memory.ends.__array_namespace__()
        return numpy.where(numpy.isnan(memory.live), held(memory.ends, memory.schedule, steps), memory.live)

    def follow(self, context: Context, memory: Scheduled, steps, before, place, motion, readings) -> Followed:
        """Return the command after a control step, and how far the motion reaches in its direction."""
        desired = self.desired(context, memory, steps, place)
        memory = memory._replace(gained=along(desired, motion))
        return Followed(memory, desired, tracking(desired, motion))

    def terms(self, memory: Scheduled, followed, upright, stepped) -> dict:
        """Return the bonuses for progress in the command's direction, and for following it."""
        return velocity_bonuses(memory.gained, followed, upright, stepped)

    def observe(self, context: Context, memory: Scheduled) -> dict:
        """Return no blocks."""
        return {}

    def resampled(self, memory: Scheduled, steps) -> Any:
        """Return whether (...) the next command of the schedule holds since step `steps`, unless a live one does."""
        return begins(memory.ends, memory.live, steps)


def held(ends, values, steps):
    """Return which of the values (..., n, size) of a schedule holds at step `steps` (...).

    Args:
        ends: (..., n) steps at which they end; a schedule that has run out begins again.
        values: in their order.
        steps: since the start.
    """
    step = steps % ends[..., -1]
    current = (step[..., None] >= ends).sum(axis=-1)[..., None, None]
    return ends.__array_namespace__().take_along_axis(values, current, axis=-2)[..., 0, :]


def begins(ends, live, steps):
    """Return whether (...) the next of the values of a schedule holds since step `steps` (...); see `held`.

    It does not where a value (..., size) from outside is complete.
    """
    step = steps % ends[..., -1]
    changes = (step[..., None] == ends).any(axis=-1) | ((step == 0) & (steps > 0))
    return changes & ends.__array_namespace__().isnan(live).any(axis=-1)


@dataclasses.dataclass(frozen=True)
class AlongLane(Command):
    """Along world x at the target velocity, and a turn back into that direction."""

    def start(self, context: Context, random, schedule: Scheduled) -> Live:
        """Return a memory without displacement; the drawn schedule is not used."""
        return Live(schedule.live, np.float64(0.0), np.float64(0.0))

    def desired(self, context: Context, memory: Live, steps, place):
        """Return the command as the torso heads."""
        heading, numpy = place[..., 2], place.__array_namespace__()
        turn = (-heading * context.reach / context.height).clip(-1.0, 1.0)
        along = numpy.stack([numpy.cos(heading), -numpy.sin(heading), turn], axis=-1)
        return numpy.where(numpy.isnan(memory.live), along, memory.live)

    def follow(self, context: Context, memory: Live, steps, before, place, motion, readings) -> Followed:
        """Return the command after a control step, and the distance."""
        desired = self.desired(context, memory, steps, place)
        displacement = component(place, 0) - component(before, 0)
        gained = _gained(context, memory.gained, displacement)
        memory = Live(memory.live, memory.distance + displacement, gained)
        return Followed(memory, desired, tracking(desired, motion))

    def terms(self, memory: Live, followed, upright, stepped) -> dict:
        """Return the bonuses for progress along the lane, and for following the command."""
        return velocity_bonuses(memory.gained, followed, upright, stepped)

    def observe(self, context: Context, memory: Live) -> dict:
        """Return no blocks."""
        return {}

    def progress(self, context: Context, memory: Live, judged) -> dict:
        """Return the distance along the lane as a share of that at the target velocity."""
        return {"distance": self.outcome(context, memory, None, judged)}

    def outcome(self, context: Context, memory: Live, tracking, judged):
        """Return the same share."""
        return memory.distance / (context.pace * judged)


class Chain(NamedTuple):
    """Memory of a chain of goals.

    Attributes:
        goals: (..., GOALS, 2) where they are, m.
        reached: (...) how many goals were.
        arrived: (...) whether one was in the latest step.
        gained: (...) approach to the goal by the target velocity, a leaky mean over a cycle of the gait.
        to_goal: (..., 2) from the torso to the present goal, forward and left, m.
    """

    goals: np.ndarray
    reached: np.ndarray
    arrived: np.ndarray
    gained: np.ndarray
    to_goal: np.ndarray


def draw_chain(random: np.random.RandomState) -> np.ndarray:
    """Draw a chain of goals (GOALS, 2): corners of the grid of pillars, in widths of a cell."""
    return chain(random.uniform(size=GOALS))


def chain(numbers) -> np.ndarray:
    """Return corners (n, 2) of the grid's cells, each next to the one before, the first next to the start.

    Args:
        numbers: (n,) from 0 to 1; each chooses among the corners next to the one before, straight
            or across a cell, except the one before that.
    """
    corners, farthest = [(0, 0), (0, 0)], CELLS // 2
    for number in numbers:
        near = [(corners[-1][0] + i, corners[-1][1] + j) for i, j in _MOVES]
        near = [corner for corner in near if max(map(abs, corner)) <= farthest and corner != corners[-2]]
        corners.append(near[int(number * len(near))])
    return np.array(corners[2:], float)


def at_goal(bearing):
    """Return the command (..., 3) that turns to a bearing (...), rad, and walks there as far as it is faced."""
    numpy = bearing.__array_namespace__()
    forward = numpy.cos(bearing).clip(0.0)
    return numpy.stack([forward, 0.0 * forward, bearing.clip(-1.0, 1.0)], axis=-1)


@dataclasses.dataclass(frozen=True)
class ToGoal(Command):
    """Straight to a goal, pillars or not, and when it is reached to the next one of a chain.

    Lengths are multiples of the arena's unit R.
    """

    def live(self, body: Body) -> dict[str, int]:
        """Return nothing: goals are not set from outside."""
        return {}

    def blocks(self, body: Body) -> dict[str, Block]:
        """Return the block of the goal's direction and distance."""
        direction = Planar(axes=("cosine of the goal's direction", "sine of the goal's direction"))
        return {"goal": Block((direction, Scalar("distance of the goal", f"{FAR:g} R")))}

    def start(self, context: Context, random, schedule: Scheduled) -> Chain:
        """Draw the chain of goals."""
        goals = context.arena.unit * PITCH * draw_chain(random)
        return Chain(goals, 0, np.False_, np.float64(0.0), np.zeros(2))

    def begin(self, context: Context, memory: Chain, place) -> Chain:
        """Return the memory with the first goal as seen from the place."""
        return memory._replace(to_goal=_to_goal(memory.goals, memory.reached, place))

    def desired(self, context: Context, memory: Chain, steps, place):
        """Return the command: straight at the goal as far as the body faces it, and a turn to face it."""
        goal, numpy = memory.to_goal, memory.goals.__array_namespace__()
        return at_goal(numpy.arctan2(goal[..., 1], goal[..., 0]))

    def follow(self, context: Context, memory: Chain, steps, before, place, motion, readings) -> Followed:
        """Return the command after a control step: progress to the goal, and the next goal where it is reached."""
        numpy, unit = place.__array_namespace__(), context.arena.unit
        far = numpy.hypot(memory.to_goal[..., 0], memory.to_goal[..., 1])
        goal = _to_goal(memory.goals, memory.reached, place)
        near = numpy.hypot(goal[..., 0], goal[..., 1])
        arrived = near <= NEAR * unit
        reached = memory.reached + arrived
        memory = Chain(
            goals=memory.goals,
            reached=reached,
            arrived=arrived,
            gained=_gained(context, memory.gained, far - near),
            to_goal=_to_goal(memory.goals, reached, place),
        )
        return Followed(memory, self.desired(context, memory, steps, place), _bounded(memory.gained), arrived)

    def terms(self, memory: Chain, followed, upright, stepped) -> dict:
        """Return the bonuses for progress to the goal and for reaching it."""
        earned = {"progress": _bounded(memory.gained) * upright, "goal": memory.arrived * 1.0}
        return {**earned, "obedient_gait": followed * stepped}

    def observe(self, context: Context, memory: Chain) -> dict:
        """Return cosine and sine of the goal's bearing, and its distance."""
        goal, unit = memory.to_goal, context.arena.unit
        numpy = goal.__array_namespace__()
        apart = numpy.maximum(numpy.hypot(goal[..., 0], goal[..., 1]), 1e-9 * unit)[..., None]
        return {"goal": numpy.concatenate([goal / apart, (apart / (FAR * unit)).clip(0.0, 1.0)], axis=-1)}

    def progress(self, context: Context, memory: Chain, judged) -> dict:
        """Return how many goals were reached."""
        return {"goals": memory.reached * 1.0}

    def markers(self, context: Context, memory: Chain) -> list[Marker]:
        """Return the goal as the disk within which it is reached."""
        unit = context.arena.unit
        middle = np.array((*_goal(memory.goals, memory.reached), 0.0))
        return [Marker("cylinder", middle, middle + (0.0, 0.0, _DISK * unit), NEAR * unit, _GOAL)]


def velocity_bonuses(gained, followed, upright, stepped) -> dict:
    """Return the bonuses for progress and for following a velocity, each (...).

    Args:
        gained: (...) progress as a share of what the command asks for.
        followed: (...) tracking of the step.
        upright: (...) cosine of the torso's tilt.
        stepped: (...) share of the feet that followed the contact schedule.
    """
    return {
        "progress": _bounded(gained) * upright,
        "tracking": followed,
        "obedient_gait": followed * stepped,
    }


def _gained(context: Context, before, displacement):
    """The leaky mean (...) of progress, given that before the step and the displacement (...) of the step, m."""
    return (1.0 - context.leak) * before + context.leak * displacement / context.pace


def _bounded(gained):
    """What progress (...) earns: at most 1, without a lower bound, so that a body that sways earns its net progress."""
    return gained.clip(max=1.0)


def _goal(goals, reached):
    """Where the present goal is (..., 2), m, after a number (...) of reached ones."""
    numpy, end = goals.__array_namespace__(), GOALS - 1
    number = end - abs(end - reached % (2 * end))
    return numpy.take_along_axis(goals, numpy.asarray(number)[..., None, None], axis=-2)[..., 0, :]


def _to_goal(goals, reached, place):
    """Where the present goal is from the torso (..., 2), forward and left, m."""
    return rotations.to_heading_frame(_goal(goals, reached) - place[..., :2], place[..., 2])
