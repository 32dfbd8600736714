"""Steer: follow a target velocity forward, sideways and in turning, stops included, in the prescribed gait.

Nothing in it has a scale: lengths are told in standing heights h, speeds in the body's own target
velocity or sqrt(g h), rates in sqrt(g / h), contact forces in the body's weight. Directions are the
body's own, as the torso heads, so that an episode may start in any. What standing still would earn
is gated by how well the command is followed.
"""

import functools
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.markers import Marker
from arc_suite.models.sizing import GRAVITY
from arc_suite.models.standing import standing
from arc_suite.tasks import mirrors, terms, walk
from arc_suite.tasks import readings as reading
from arc_suite.tasks.contract import Start
from arc_suite.tasks.fitting import velocity_units
from arc_suite.tasks.mirrors import PLANAR, Mirror
from arc_suite.tasks.readings import Readings, component

BAND = 0.75  # of the command, and of half of the unit at least: the error at which tracking earns nothing
COMMANDS, SHORTEST, LONGEST = 17, 60, 161  # of a schedule, and control steps that each is held
LOWEST = 0.3  # healthy height of the torso over the ground, in standing heights
LYING = 0.5  # of the weight: who has it carried by the torso itself lies on the ground
LEAST_UPRIGHT = 0.4  # healthy cosine of the torso's tilt
OVER = 0.5  # height of the command's arrows over the torso, in standing heights
GOING, TURNING = (1.0, 0.75, 0.1, 1.0), (0.2, 0.8, 1.0, 1.0)  # their colours
# Walk's weights of rates in SI units, as Queen has them in units of her own.
RATES = {"angular_velocity": -0.654, "vertical_velocity": -0.147}
_OWN = [
    (field, np.ndarray)
    for field in ("steps", "place", "motion", "ends", "schedule", "command", "followed", "tracking", "fell")
]


class Memory(NamedTuple("Memory", [*walk.Memory.__annotations__.items(), *_OWN])):
    """What is remembered beside the walk's; velocities are (forward, left, turning) in units of `Steer.units`.

    Attributes:
        steps: (...) control steps since the start; the clock's tick rests while the command says stop.
        place: (..., 3) of the torso's frame at the latest reading: x and y, m, and yaw, rad.
        motion: (..., 3) velocity of the torso, a leaky mean over a cycle of the gait.
        ends: (..., COMMANDS) steps at which the commands of the schedule end.
        schedule: (..., COMMANDS, 3) commands.
        command: (..., 3) set from outside, in place of the schedule where it is not NaN.
        followed: (...) tracking of the latest step.
        tracking: (...) sum over the steps.
        fell: (...) whether the torso lies on the ground or is tilted too far.
    """


def draw_command(random: np.random.RandomState) -> np.ndarray:
    """Draw a command (3,): mostly forward, some turning or sideways, one in ten a stop; always six draws."""
    command = random.uniform((-0.5, -0.5, -1.0), (1.0, 0.5, 1.0))
    sideways, turns, goes = random.uniform(size=3) < (0.5, 0.7, 0.95)
    command = command * (1.0, sideways, turns)
    size = np.hypot(command[0], command[1]) + abs(command[2])
    return command / max(size, 1.0) * (goes and size >= 0.2)


class Steer(walk.Walk):
    """Following a velocity command.

    Attributes:
        yaw: half-width of the heading at the start, rad.
    """

    name, target_velocity = "steer", None
    commands = {"command": 3}
    yaw = math.pi
    bonuses = {"tracking": 1.5, "healthy": 1.0, "obedient_gait": 1.5}

    @classmethod
    def fitted(cls, body, overrides: Mapping[str, Any]) -> walk.Settings:
        """Return walk's settings, with this task's weights."""
        weights = RATES | dict(overrides.get("weights") or {})
        return super().fitted(body, {**overrides, "weights": weights})

    @functools.cached_property
    def blocks(self) -> Mapping[str, int]:
        """Walk's, and the command beside the motion that is to follow it."""
        return {**super().blocks, "command": 6}

    @property
    def mirrors(self) -> Mapping[str, Mirror]:
        """Walk's; what goes left goes right, and turns the other way."""
        return {**super().mirrors, "command": mirrors.joined([PLANAR, PLANAR])}

    @functools.cached_property
    def units(self) -> np.ndarray:
        """(3,) the target velocity, twice, m/s, and rad/s at which feet move as fast when turning on the spot."""
        return velocity_units(self.scene.body, self.parameters.target_velocity)

    @functools.cached_property
    def reach(self) -> float:
        """R, the mean distance of the feet from their centre, m."""
        return self.units[0] / self.units[2]

    @functools.cached_property
    def force_unit(self) -> np.ndarray:
        """(6,) the body's weight, N: three times that on a lever of its height, N m, then thrice as it is."""
        pose = standing(self.scene.body)
        return pose.mass * GRAVITY * np.repeat((pose.height, 1.0), 3)

    def start(self, random: np.random.RandomState, carry: Any) -> Start:
        """Draw walk's start, then the yaw, then how long each command is held, then what they are."""
        start = super().start(random, carry)
        start.qpos[3:7] = rotations.turned(start.qpos[3:7], random.uniform(-self.yaw, self.yaw))
        ends = random.randint(SHORTEST, LONGEST, COMMANDS).cumsum()
        schedule = np.array([draw_command(random) for _ in range(COMMANDS)])
        zero = np.float64(0.0)
        own = (0, np.zeros(3), np.zeros(3), ends, schedule, np.full(3, np.nan), zero, zero, np.False_)
        return start._replace(memory=Memory(*start.memory, *own))

    def read(self, data) -> Readings:
        """Take the readings, with contact forces in the body's weight and as the torso heads."""
        layout, heading = self.scene.layout, rotations.yaw(data.qpos[..., 3:7])[..., None]
        forces = data.cfrc_ext[..., layout.parts, :] / self.force_unit
        parts = []
        for i in (0, 3):  # torque, force
            parts += [rotations.headed(forces[..., i : i + 2], heading), forces[..., i + 2 : i + 3]]
        forces = forces.__array_namespace__().concatenate(parts, axis=-1)
        return reading.read(data, layout, self.scene.arena, forces)

    def lift(self, memory: Memory, readings: Readings) -> np.ndarray:
        """Return the qpos (..., nq) that brings every foot clear of the ground, level ground too: none is thrown up."""
        return self.lifted(readings)

    def begin(self, memory: Memory, readings: Readings) -> Memory:
        """Take down where the torso is."""
        return super().begin(memory, readings)._replace(place=_place(readings))

    def after(self, memory: Memory, readings: Readings) -> Memory:
        """Advance the walk, and the mean velocity in the frame of the heading at the start of the step."""
        place, heading, step = _place(readings), memory.place[..., 2], self.scene.control_timestep
        numpy = place.__array_namespace__()
        way = place - memory.place
        turn = rotations.wrapped(way[..., 2])
        way = numpy.concatenate([rotations.headed(way[..., :2], heading), turn[..., None]], axis=-1)
        leak = min(self.parameters.gait_frequency * step, 1.0)
        motion = (1.0 - leak) * memory.motion + leak * way / (step * self.units)
        going = self.wanted(memory).any(axis=-1)
        tick = memory.tick + going
        stance = self.clock.at(self.clock.stance, tick) | ~going[..., None]  # all feet, while the command says stop
        memory = self.measured(memory, readings, tick, stance)
        memory = memory._replace(steps=memory.steps + 1, place=place, motion=motion, fell=~self.healthy(readings))
        followed = self.tracked(memory)
        return memory._replace(followed=followed, tracking=memory.tracking + followed)

    def wanted(self, memory: Memory):
        """Return the command (..., 3) that holds; a schedule that has run out begins again."""
        step, numpy = memory.steps % memory.ends[..., -1], memory.ends.__array_namespace__()
        current = (step[..., None] >= memory.ends).sum(axis=-1)[..., None, None]
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
        """Return walk's costs without scale, and bonuses for following the command in the prescribed gait."""
        walked = super().terms(memory, readings)
        height = self.scene.body.torso.standing_height
        own = {
            "tracking": memory.followed,
            "healthy": self.healthy(readings).astype(float),
            "obedient_gait": memory.followed * walked["gait_bonus"],
            "angular_velocity": walked["angular_velocity"] * (height / GRAVITY),
            "vertical_velocity": walked["vertical_velocity"] / (GRAVITY * height),
        }
        return {name: own.get(name, walked.get(name)) for name in self.settings.weights}

    def healthy(self, readings: Readings):
        """Return whether the torso is upright, and high enough without being carried by the ground: (...) booleans."""
        high = readings.torso_height >= LOWEST * self.scene.body.torso.standing_height
        lies = component(readings.contact_forces, 5) >= LYING  # upwards on the torso
        return high & ~lies & (rotations.upright(readings.torso_quaternion) >= LEAST_UPRIGHT)

    def observe(self, memory: Memory, readings: Readings) -> dict:
        """Return walk's blocks as the torso heads, without a clock at a stop; and the command beside the motion."""
        numpy, walked = memory.motion.__array_namespace__(), super().observe(memory, readings)
        heading, wanted = rotations.yaw(readings.torso_quaternion), self.wanted(memory)
        quaternion = rotations.turned(readings.torso_quaternion, -heading)
        posture, velocities = readings.posture, readings.velocities
        velocity = rotations.headed(velocities[..., :2], heading)
        return walked | {
            "posture": numpy.concatenate([posture[..., :1], quaternion, posture[..., 5:]], axis=-1),
            "velocities": numpy.concatenate([velocity, velocities[..., 2:]], axis=-1),
            "gait_clock": walked["gait_clock"] * wanted.any(axis=-1)[..., None],
            "command": numpy.concatenate([wanted, memory.motion], axis=-1),
        }

    def ended(self, memory: Memory, readings: Readings) -> tuple:
        """Return as terminated who fell; none is truncated."""
        return memory.fell, False

    def marks(self, memory: Memory, readings: Readings) -> list[Marker]:
        """Return arrows over the torso: the velocity that is asked for, and that to the side of what is R ahead.

        The latter is what turns. At the target velocity an arrow is R long.
        """
        unit, (x, y, heading) = self.reach, memory.place
        forward, left, turn = (unit * share for share in self.wanted(memory))
        middle = np.array((x, y, readings.torso_position[2] + OVER * self.scene.body.torso.standing_height))
        ahead = np.array((math.cos(heading), math.sin(heading), 0.0))
        aside = np.array((-ahead[1], ahead[0], 0.0))
        arrows = (middle, forward * ahead + left * aside, GOING), (middle + unit * ahead, turn * aside, TURNING)
        arrows = [Marker("arrow", foot, foot + way, 0.06 * unit, colour) for foot, way, colour in arrows if way.any()]
        return [Marker("cylinder", middle, middle + (0.0, 0.0, 0.06 * unit), 0.1 * unit, GOING), *arrows]

    def progress(self, memory: Memory) -> dict:
        """Return the mean `tracking`, whether the body `fell`, and `gait_compliance`."""
        steps = memory.steps + (memory.steps == 0)
        right = 1.0 - memory.wrong_in_all / (steps * len(self.parameters.phase_offsets))
        return {"tracking": memory.tracking / steps, "fell": memory.fell * 1.0, "gait_compliance": right}


def _place(readings: Readings):
    numpy, yaw = readings.posture.__array_namespace__(), rotations.yaw(readings.torso_quaternion)
    return numpy.stack([*(component(readings.frame_position, i) for i in (0, 1)), yaw], axis=-1)
