"""Steer: follow a target velocity forward, sideways and in turning, which changes on a schedule, in the given gait."""

import functools
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.models.standing import standing
from arc_suite.tasks import terms, walk
from arc_suite.tasks.contract import Start
from arc_suite.tasks.readings import Readings

BAND = 0.75  # of the command, and of half of the unit at least: the error at which tracking earns nothing
COMMANDS, SHORTEST, LONGEST = 17, 60, 161  # of a schedule, and control steps that each is held
_OWN = [(field, np.ndarray) for field in ("place", "motion", "ends", "schedule", "command", "tracking")]


class Memory(NamedTuple("Memory", [*walk.Memory.__annotations__.items(), *_OWN])):
    """What is remembered beside the walk's; velocities are (forward, left, turning) in units of `Steer.units`.

    Attributes:
        place: (..., 3) of the torso's frame at the latest reading: x and y, m, and yaw, rad.
        motion: (..., 3) velocity of the torso, a leaky mean over a cycle of the gait.
        ends: (..., COMMANDS) ticks at which the commands of the schedule end.
        schedule: (..., COMMANDS, 3) commands.
        command: (..., 3) set from outside, in place of the schedule where it is not NaN.
        tracking: (...) sum over the steps.
    """


def draw_command(random: np.random.RandomState) -> np.ndarray:
    """Draw a command (3,): mostly forward, some turning or sideways, one in ten a stop; always six draws."""
    command = random.uniform((-0.5, -0.5, -1.0), (1.0, 0.5, 1.0))
    sideways, turns, goes = random.uniform(size=3) < (0.5, 0.7, 0.95)
    command = command * (1.0, sideways, turns)
    size = np.hypot(command[0], command[1]) + abs(command[2])
    return command / max(size, 1.0) * (goes and size >= 0.2)


class Steer(walk.Walk):
    """Following a velocity command."""

    name, target_velocity = "steer", None
    commands = {"command": 3}
    bonuses = {"tracking": 1.5, "healthy": 1.0, "obedient_gait": 1.5}

    @functools.cached_property
    def blocks(self) -> Mapping[str, int]:
        """Walk's, and the command beside the motion that is to follow it."""
        return {**super().blocks, "command": 6}

    @functools.cached_property
    def units(self) -> np.ndarray:
        """(3,) the target velocity, twice, m/s, and rad/s at which feet move as fast when turning on the spot."""
        pose, speed = standing(self.scene.body), abs(self.parameters.target_velocity)
        return np.array((speed, speed, speed / np.hypot(*(pose.soles - pose.centre)[:, :2].T).mean()))

    def start(self, random: np.random.RandomState, carry: Any) -> Start:
        """Draw walk's start, then the yaw, then how long each command is held, then what they are."""
        start = super().start(random, carry)
        start.qpos[3:7] = rotations.turned(start.qpos[3:7], random.uniform(-math.pi, math.pi))
        ends = random.randint(SHORTEST, LONGEST, COMMANDS).cumsum()
        schedule = np.array([draw_command(random) for _ in range(COMMANDS)])
        own = (np.zeros(3), np.zeros(3), ends, schedule, np.full(3, np.nan), np.float64(0.0))
        return start._replace(memory=Memory(*start.memory, *own))

    def begin(self, memory: Memory, readings: Readings) -> Memory:
        """Take down where the torso is."""
        return super().begin(memory, readings)._replace(place=_place(readings))

    def after(self, memory: Memory, readings: Readings) -> Memory:
        """Advance the walk, and the mean velocity in the frame of the heading at the start of the step."""
        place, heading, step = _place(readings), memory.place[..., 2], self.scene.control_timestep
        numpy = place.__array_namespace__()
        sine, cosine = numpy.sin(heading), numpy.cos(heading)
        x, y, turn = ((place - memory.place)[..., i] for i in range(3))
        way = numpy.stack([cosine * x + sine * y, cosine * y - sine * x, rotations.wrapped(turn)], axis=-1)
        leak = min(self.parameters.gait_frequency * step, 1.0)
        motion = (1.0 - leak) * memory.motion + leak * way / (step * self.units)
        memory = super().after(memory, readings)._replace(place=place, motion=motion)
        return memory._replace(tracking=memory.tracking + self.tracked(memory))

    def wanted(self, memory: Memory):
        """Return the command (..., 3) that holds; a schedule that has run out begins again."""
        tick, numpy = memory.tick % memory.ends[..., -1], memory.ends.__array_namespace__()
        current = (tick[..., None] >= memory.ends).sum(axis=-1)[..., None, None]
        scheduled = numpy.take_along_axis(memory.schedule, current, axis=-2)[..., 0, :]
        return numpy.where(numpy.isnan(memory.command), scheduled, memory.command)

    def tracked(self, memory: Memory):
        """Return how well the motion follows the command, the product of course and turning: (...) from 0 to 1."""
        wanted, numpy = self.wanted(memory), memory.motion.__array_namespace__()
        error = wanted - memory.motion
        speed, miss = (numpy.hypot(vector[..., 0], vector[..., 1]) for vector in (wanted, error))
        course = terms.tent(miss, BAND * numpy.maximum(speed, 0.5))
        return course * terms.tent(error[..., 2], BAND * numpy.maximum(abs(wanted[..., 2]), 0.5))

    def terms(self, memory: Memory, readings: Readings) -> dict:
        """Return walk's costs, and bonuses for following the command, in the prescribed gait."""
        walked, tracking = super().terms(memory, readings), self.tracked(memory)
        earned = {"tracking": tracking, "obedient_gait": tracking * walked["gait_bonus"]}
        return earned | {name: term for name, term in walked.items() if name in self.settings.weights}

    def observe(self, memory: Memory, readings: Readings) -> dict:
        """Return walk's blocks, and the command and the motion side by side."""
        command = memory.motion.__array_namespace__().concatenate([self.wanted(memory), memory.motion], axis=-1)
        return super().observe(memory, readings) | {"command": command}

    def progress(self, memory: Memory) -> dict:
        """Return the mean `tracking`, and `gait_compliance`."""
        steps = memory.tick + (memory.tick == 0)
        return {"tracking": memory.tracking / steps, "gait_compliance": super().progress(memory)["gait_compliance"]}


def _place(readings: Readings):
    x, y, yaw = *(readings.frame_position[..., i] for i in (0, 1)), rotations.yaw(readings.torso_quaternion)
    return yaw.__array_namespace__().stack([x, y, yaw], axis=-1)
