"""Commands: the velocity that a body is to follow, and how well it follows.

A command is a frozen value with pure functions of its own memory. Velocities are (forward, left, turning) relative to
the heading of the torso, in the units of `Context.units`. `place` is (..., 3): x and y of the torso's frame, m, and
its yaw, rad.
"""

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
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

BAND = 0.75  # error at which tracking is 0, as a share of the command
MIN_JUDGED_COMMAND = 0.5  # units of the command; smaller commands are judged as strictly as one of this size
DIRECTIONS = ("forward", "left", "turning")
RANGES = ((-0.5, 1.0), (-0.5, 0.5), (-1.0, 1.0))  # of drawn commands, by direction
MAX_COMMAND = 10.0  # bound of the ranges that a caller may set
COMMANDS = 17  # number of commands in a schedule
SHORTEST = 60  # control steps; a command holds for at least so many
LONGEST = 161  # control steps; a command holds for fewer
_SIDEWAYS_PROBABILITY = 0.5
_TURNING_PROBABILITY = 0.7
_GOING_PROBABILITY = 0.95  # other commands are stops
_MIN_COMMAND_SIZE = 0.2  # as a share of the largest; smaller commands become stops

GOALS = 16  # number of goals in a chain; after the last one, the way leads back along the chain
GOAL_RADIUS = 0.7  # distance of the torso at which a goal is reached, R
_MIN_GOAL_DISTANCE = 1e-9  # R; directions are divided by distances
_DISK_THICKNESS = 0.02  # of the disk that shows a goal, R
_DISK_COLOR = (0.2, 0.9, 0.4, 1.0)

# Steps from a corner of a grid to the eight corners around it.
_MOVES = [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)]


class Followed(NamedTuple):
    """What a command returns after a control step, see `Command.follow`.

    Attributes:
        memory: memory of the command.
        desired: (..., 3) the velocity that holds from now on.
        tracking: (...) how well the step followed the velocity, at most 1.
        arrived: (...) whether the step reached a goal; False where there are none.
    """

    memory: Any
    desired: np.ndarray
    tracking: np.ndarray
    arrived: np.ndarray | bool = False


@runtime_checkable
class WithLive(Protocol):
    """Memory of a command that can be set live, see `Command.live`: a NamedTuple with this field.

    Attributes:
        live: (..., 3) velocity that is set from outside; NaN for that of the command itself.
    """

    live: np.ndarray


@dataclasses.dataclass(frozen=True)
class Command(ABC):
    """A velocity that a body is to follow.

    A command of a new kind defines the five abstract methods. Unless its `live` is empty, its memory is a `WithLive`.

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
    def follow(self, context: Context, memory, steps, place_before, place, motion, readings) -> Followed:
        """Return the command after a control step.

        Args:
            context: context of the task.
            memory: memory of the command, before the step.
            steps: (...) control steps since the start.
            place_before: (..., 3) the place before the step.
            place: (..., 3) the place after it.
            motion: (..., 3) mean velocity of the torso.
            readings: after the step.
        """

    @abstractmethod
    def terms(self, memory, step_tracking, upright, feet_in_schedule) -> dict:
        """Return the bonuses for following, each (...), by name.

        Args:
            memory: memory of the command, after the step.
            step_tracking: (...) tracking of the step.
            upright: (...) cosine of the torso's tilt.
            feet_in_schedule: (...) share of the feet that followed the contact schedule.
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

    @property
    def velocity_ranges(self) -> Sequence[tuple[float, float]]:
        """The least and the greatest desired velocity by direction, in units of the command."""
        return RANGES

    def blocks(self, body: Body) -> dict[str, Block]:
        """Return the blocks that it adds to the observation, by name."""
        return {}

    def schedule(self, random: np.random.RandomState, share: float) -> "Scheduled":
        """Draw a schedule. Every command draws one, so that tasks have the same draws; `Schedule` alone uses it.

        Args:
            random: the random generator.
            share: share, from 0 to 1, by which a curriculum has widened the ranges of commands.
        """
        return draw_schedule(random)

    def begin(self, context: Context, memory, place) -> Any:
        """Return the memory from which the first step starts."""
        return memory

    def resampled(self, memory, steps) -> Any:
        """Return whether (...) another drawn command holds since control step `steps` (...)."""
        return False

    def progress(self, context: Context, memory, judged_steps) -> dict:
        """Return the metrics that it adds to progress, given the steps (...) over which the episode is judged."""
        return {}

    def outcome(self, context: Context, memory, all_tracking, judged_steps):
        """Return the outcome (...) by which a curriculum judges an episode: its mean tracking."""
        return all_tracking / judged_steps

    def markers(self, context: Context, memory) -> list[Marker]:
        """Return the markers that pictures show in addition to the arrows of the velocity."""
        return []


class Live(NamedTuple):
    """Memory of `AlongLane`.

    Attributes:
        live: (..., 3) velocity that is set from outside; NaN for that of the command itself.
        distance: (...) along world x since the start, m.
        speed_share: (...) velocity along world x over the target velocity, a leaky mean over a cycle of the gait.
    """

    live: np.ndarray
    distance: np.ndarray
    speed_share: np.ndarray


class Scheduled(NamedTuple):
    """Memory of `Schedule`.

    Attributes:
        ends: (..., COMMANDS) steps at which the commands of the schedule end.
        schedule: (..., COMMANDS, 3) commands.
        live: (..., 3) velocity that is set from outside; NaN for that of the schedule.
        speed_share: (...) share of the command that the mean motion reaches in its direction; 0 at a stop.
    """

    ends: np.ndarray
    schedule: np.ndarray
    live: np.ndarray
    speed_share: np.ndarray


def draw_schedule(random: np.random.RandomState, ranges=RANGES) -> Scheduled:
    """Draw how long each command holds, then the commands between ranges (3, 2)."""
    ends = random.randint(SHORTEST, LONGEST, COMMANDS).cumsum()
    schedule = np.array([draw_command(random, ranges) for _ in range(COMMANDS)])
    return Scheduled(ends, schedule, np.full(3, np.nan), np.float64(0.0))


def draw_command(random: np.random.RandomState, ranges=RANGES) -> np.ndarray:
    """Draw a command (3,): mostly forward, some turning or sideways, one in ten a stop; always six draws.

    The sum of speed and turning is at most 1, each as a share of the largest in its ranges (3, 2), or of 1.
    """
    low, high = np.transpose(ranges)
    command = random.uniform(low, high)
    goes_sideways, turns, goes = random.uniform(size=3) < (
        _SIDEWAYS_PROBABILITY,
        _TURNING_PROBABILITY,
        _GOING_PROBABILITY,
    )
    command = command * (1.0, goes_sideways, turns)
    max_speed = max(1.0, *np.abs(ranges[:2]).flat)
    max_turning = max(1.0, *np.abs(ranges[2]))
    size = np.hypot(command[0], command[1]) / max_speed + abs(command[2]) / max_turning
    is_going = goes and size >= _MIN_COMMAND_SIZE
    return command / max(size, 1.0) * is_going  # 0 for a stop


def tracking(desired, motion):
    """Return how well (...) a motion (..., 3) follows a velocity (..., 3), from 0 to 1.

    It is the product of two kernels: of the planar velocity, and of turning.
    """
    xp = motion.__array_namespace__()
    error = desired - motion
    desired_speed = xp.hypot(desired[..., 0], desired[..., 1])
    planar_error = xp.hypot(error[..., 0], error[..., 1])
    planar_tracking = terms.triangle(planar_error, BAND * xp.maximum(desired_speed, MIN_JUDGED_COMMAND))
    desired_turning = abs(desired[..., 2])
    turning_tracking = terms.triangle(error[..., 2], BAND * xp.maximum(desired_turning, MIN_JUDGED_COMMAND))
    return planar_tracking * turning_tracking


def projected_share(desired, motion):
    """Return the projection of a motion (..., 3) onto a velocity (..., 3), as a share (...) of it; 0 at a stop.

    Unlike `tracking`, it increases from standing still on, so that a learner is rewarded for its first steps.
    """
    squared_speed = _scalar_product(desired, desired)
    xp = squared_speed.__array_namespace__()
    return _scalar_product(desired, motion) / xp.where(squared_speed > 0.0, squared_speed, 1.0)


def _scalar_product(left, right):
    """Return the scalar product (...) of vectors (..., 3), summed in one order for any leading axes."""
    products = left * right
    return products[..., 0] + products[..., 1] + products[..., 2]


@dataclasses.dataclass(frozen=True)
class Schedule(Command):
    """Commands that are drawn for the episode, each for some seconds; some are stops.

    Attributes:
        commands: ranges that replace some of `RANGES`, by the names in `DIRECTIONS`, in units of the command.
    """

    commands: tuple[tuple[float, float], ...] = RANGES

    settings: ClassVar[tuple[str, ...]] = ("commands",)

    @property
    def velocity_ranges(self) -> Sequence[tuple[float, float]]:
        """The ranges between which commands are drawn."""
        return self.commands

    def with_settings(self, body: Body, overrides: Mapping[str, Any]) -> Self:
        """Return the schedule with checked ranges in place of its own."""
        ranges = dict(zip(DIRECTIONS, self.commands, strict=True))
        for name, span in checks.mapping("commands", overrides.get("commands")).items():
            checks.name(name, DIRECTIONS, "direction of commands")
            ranges[name] = checks.span(f"commands[{name!r}]", span, -MAX_COMMAND, MAX_COMMAND)
        return dataclasses.replace(self, commands=tuple(ranges.values()))

    def schedule(self, random: np.random.RandomState, share: float) -> Scheduled:
        """Draw a schedule between the ranges, which a curriculum widens from `RANGES` to those of the settings."""
        if share == 1.0:
            return draw_schedule(random, self.commands)
        widening = np.subtract(self.commands, RANGES)
        return draw_schedule(random, np.array(RANGES) + share * widening)

    def start(self, context: Context, random, schedule: Scheduled) -> Scheduled:
        """Return the drawn schedule."""
        return schedule

    def desired(self, context: Context, memory: Scheduled, steps, place):
        """Return the command that holds; after its end, the schedule repeats."""
        xp = memory.ends.__array_namespace__()
        scheduled = scheduled_value(memory.ends, memory.schedule, steps)
        return xp.where(xp.isnan(memory.live), scheduled, memory.live)

    def follow(self, context: Context, memory: Scheduled, steps, place_before, place, motion, readings) -> Followed:
        """Return the command after a control step, and the share of it that the motion reaches."""
        desired = self.desired(context, memory, steps, place)
        memory = memory._replace(speed_share=projected_share(desired, motion))
        return Followed(memory, desired, tracking(desired, motion))

    def terms(self, memory: Scheduled, step_tracking, upright, feet_in_schedule) -> dict:
        """Return the bonuses for progress in the command's direction, and for following it."""
        return velocity_bonuses(memory.speed_share, step_tracking, upright, feet_in_schedule)

    def observe(self, context: Context, memory: Scheduled) -> dict:
        """Return no blocks."""
        return {}

    def resampled(self, memory: Scheduled, steps) -> Any:
        """Return whether (...) the next command of the schedule holds since step `steps`, unless a live one does."""
        return begins_next(memory.ends, memory.live, steps)


def scheduled_value(ends, values, steps):
    """Return the value (..., size) of a schedule that holds at step `steps` (...).

    Args:
        ends: (..., n) steps at which values end; after the last one, the schedule repeats.
        values: (..., n, size), in order.
        steps: (...) control steps since the start.
    """
    xp = ends.__array_namespace__()
    step = steps % ends[..., -1]
    ended_values = (step[..., None] >= ends).sum(axis=-1)
    index = ended_values[..., None, None]
    return xp.take_along_axis(values, index, axis=-2)[..., 0, :]


def begins_next(ends, live, steps):
    """Return whether (...) the next value of a schedule holds since step `steps` (...); see `scheduled_value`.

    It is False where a live value (..., size) without NaN holds in place of the schedule.
    """
    xp = ends.__array_namespace__()
    step = steps % ends[..., -1]
    repeats = (step == 0) & (steps > 0)
    begins = (step[..., None] == ends).any(axis=-1) | repeats
    schedule_holds = xp.isnan(live).any(axis=-1)
    return begins & schedule_holds


@dataclasses.dataclass(frozen=True)
class AlongLane(Command):
    """Velocity along world x at the target velocity, with a turn that brings the heading back to that direction."""

    def start(self, context: Context, random, schedule: Scheduled) -> Live:
        """Return a memory without displacement; the drawn schedule is not used."""
        return Live(schedule.live, np.float64(0.0), np.float64(0.0))

    def desired(self, context: Context, memory: Live, steps, place):
        """Return the velocity along the lane, relative to the heading, or the live one."""
        heading = place[..., 2]
        xp = place.__array_namespace__()
        turning = (-heading * context.reach / context.height).clip(-1.0, 1.0)
        along_lane = xp.stack([xp.cos(heading), -xp.sin(heading), turning], axis=-1)
        return xp.where(xp.isnan(memory.live), along_lane, memory.live)

    def follow(self, context: Context, memory: Live, steps, place_before, place, motion, readings) -> Followed:
        """Return the command after a control step, and the distance."""
        desired = self.desired(context, memory, steps, place)
        displacement = component(place, 0) - component(place_before, 0)
        speed_share = _mean_speed_share(context, memory.speed_share, displacement)
        memory = Live(memory.live, memory.distance + displacement, speed_share)
        return Followed(memory, desired, tracking(desired, motion))

    def terms(self, memory: Live, step_tracking, upright, feet_in_schedule) -> dict:
        """Return the bonuses for progress along the lane, and for following the command."""
        return velocity_bonuses(memory.speed_share, step_tracking, upright, feet_in_schedule)

    def observe(self, context: Context, memory: Live) -> dict:
        """Return no blocks."""
        return {}

    def progress(self, context: Context, memory: Live, judged_steps) -> dict:
        """Return the distance along the lane as a share of that at the target velocity."""
        return {"distance": self.outcome(context, memory, None, judged_steps)}

    def outcome(self, context: Context, memory: Live, all_tracking, judged_steps):
        """Return the distance along the lane as a share of that at the target velocity."""
        return memory.distance / (context.pace * judged_steps)


class Chain(NamedTuple):
    """Memory of `ToGoal`: a chain of goals.

    Attributes:
        goals: (..., GOALS, 2) positions, m.
        reached: (...) number of goals that were reached.
        arrived: (...) whether the latest step reached one.
        speed_share: (...) velocity to the goal over the target velocity, a leaky mean over a cycle of the gait.
        to_goal: (..., 2) from the torso to the present goal, forward and left, m.
    """

    goals: np.ndarray
    reached: np.ndarray
    arrived: np.ndarray
    speed_share: np.ndarray
    to_goal: np.ndarray


def draw_chain(random: np.random.RandomState) -> np.ndarray:
    """Draw a chain of goals (GOALS, 2): corners of the grid of pillars, in widths of a cell."""
    return chain(random.uniform(size=GOALS))


def chain(numbers) -> np.ndarray:
    """Return corners (n, 2) of the grid's cells, each next to the previous one, the first one next to the start.

    Args:
        numbers: (n,) from 0 to 1. Each chooses among the corners of the grid next to the latest one, along a side or
            across a cell. The corner before the latest one is left out, so that the way does not lead back at once.
    """
    edge = CELLS // 2
    corners = [(0, 0), (0, 0)]  # the start, twice
    for number in numbers:
        x, y = corners[-1]
        neighbors = [(x + i, y + j) for i, j in _MOVES]
        in_grid = [corner for corner in neighbors if max(map(abs, corner)) <= edge]
        choices = [corner for corner in in_grid if corner != corners[-2]]
        corners.append(choices[int(number * len(choices))])
    return np.array(corners[2:], float)


def command_to_goal(bearing):
    """Return the command (..., 3) to a goal at a bearing (...), rad: a turn, and forward as it faces the goal."""
    xp = bearing.__array_namespace__()
    forward = xp.cos(bearing).clip(0.0)
    return xp.stack([forward, 0.0 * forward, bearing.clip(-1.0, 1.0)], axis=-1)


@dataclasses.dataclass(frozen=True)
class ToGoal(Command):
    """A velocity straight to a goal, whether or not pillars are in the way, then to the next goal of a chain.

    Lengths are multiples of the arena's unit R.
    """

    def live(self, body: Body) -> dict[str, int]:
        """Return no names, as goals cannot be set from outside."""
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
        """Return the command: straight to the goal as far as the body faces it, and a turn to face it."""
        goal = memory.to_goal
        xp = memory.goals.__array_namespace__()
        return command_to_goal(xp.arctan2(goal[..., 1], goal[..., 0]))

    def follow(self, context: Context, memory: Chain, steps, place_before, place, motion, readings) -> Followed:
        """Return the command after a control step: progress to the goal, and the next goal where it is reached."""
        xp = place.__array_namespace__()
        distance_before = xp.hypot(memory.to_goal[..., 0], memory.to_goal[..., 1])  # m
        to_goal = _to_goal(memory.goals, memory.reached, place)
        distance = xp.hypot(to_goal[..., 0], to_goal[..., 1])
        arrived = distance <= GOAL_RADIUS * context.arena.unit
        reached = memory.reached + arrived
        memory = Chain(
            goals=memory.goals,
            reached=reached,
            arrived=arrived,
            speed_share=_mean_speed_share(context, memory.speed_share, distance_before - distance),
            to_goal=_to_goal(memory.goals, reached, place),
        )
        desired = self.desired(context, memory, steps, place)
        return Followed(memory, desired, _progress_bonus(memory.speed_share), arrived)

    def terms(self, memory: Chain, step_tracking, upright, feet_in_schedule) -> dict:
        """Return the bonuses for progress to the goal and for reaching it."""
        return {
            "progress": _progress_bonus(memory.speed_share) * upright,
            "goal": memory.arrived * 1.0,
            "obedient_gait": step_tracking * feet_in_schedule,
        }

    def observe(self, context: Context, memory: Chain) -> dict:
        """Return cosine and sine of the goal's bearing, and its distance."""
        goal = memory.to_goal
        unit = context.arena.unit  # R, m
        xp = goal.__array_namespace__()
        distance = xp.hypot(goal[..., 0], goal[..., 1])  # m
        positive_distance = xp.maximum(distance, _MIN_GOAL_DISTANCE * unit)[..., None]
        direction = goal / positive_distance  # cosine and sine
        distance_share = (positive_distance / (FAR * unit)).clip(0.0, 1.0)
        return {"goal": xp.concatenate([direction, distance_share], axis=-1)}

    def progress(self, context: Context, memory: Chain, judged_steps) -> dict:
        """Return how many goals were reached."""
        return {"goals": memory.reached * 1.0}

    def markers(self, context: Context, memory: Chain) -> list[Marker]:
        """Return the goal as the disk within which it is reached."""
        unit = context.arena.unit  # R, m
        center = np.array((*_present_goal(memory.goals, memory.reached), 0.0))
        top = center + (0.0, 0.0, _DISK_THICKNESS * unit)
        return [Marker("cylinder", center, top, GOAL_RADIUS * unit, _DISK_COLOR)]


def velocity_bonuses(speed_share, step_tracking, upright, feet_in_schedule) -> dict:
    """Return the bonuses for progress and for following a velocity, each (...).

    Args:
        speed_share: (...) velocity in the direction of the command, as a share of the command.
        step_tracking: (...) tracking of the step.
        upright: (...) cosine of the torso's tilt.
        feet_in_schedule: (...) share of the feet that followed the contact schedule.
    """
    return {
        "progress": _progress_bonus(speed_share) * upright,
        "tracking": step_tracking,
        "obedient_gait": step_tracking * feet_in_schedule,
    }


def _mean_speed_share(context: Context, mean_before, displacement):
    """Return the leaky mean (...) of the speed share, given that before the step and its displacement (...), m."""
    return (1.0 - context.leak) * mean_before + context.leak * displacement / context.pace


def _progress_bonus(speed_share):
    """Return the bonus (...), at most 1. It has no lower bound, so that a body that sways has its net progress."""
    return speed_share.clip(max=1.0)


def _present_goal(goals, reached):
    """Return the position (..., 2) of the present goal, m, after a number (...) of goals that were reached."""
    xp = goals.__array_namespace__()
    last = GOALS - 1
    index = last - abs(last - reached % (2 * last))  # to the end of the chain and back
    return xp.take_along_axis(goals, xp.asarray(index)[..., None, None], axis=-2)[..., 0, :]


def _to_goal(goals, reached, place):
    """Return the position (..., 2) of the present goal from the torso, forward and left, m."""
    return rotations.to_heading_frame(_present_goal(goals, reached) - place[..., :2], place[..., 2])
