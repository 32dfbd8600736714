"""A gait and a pose of the torso by command, drawn for the episode or set while it runs.

Pose and gait glide to the command. The clock counts integers: every gait's edges are exact, whatever its numbers,
and the phase goes on when another gait is asked for.
"""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from arc_suite import checks, rotations
from arc_suite.models import posture
from arc_suite.models.standing import GRAVITY
from arc_suite.robots import gaits
from arc_suite.robots.spec import Body
from arc_suite.tasks import terms
from arc_suite.tasks.blocks import Block, gait_clock
from arc_suite.tasks.clock import TWO_PI
from arc_suite.tasks.command import BAND, COMMANDS, LONGEST, SHORTEST, begins, held
from arc_suite.tasks.context import Context
from arc_suite.tasks.parts import ROTATIONS, Legs, Planar, Scalar

CYCLE = 1 << 20  # units of the clock
STEADY = ("trot", "walk", "tripod", "tetrapod", "ripple")  # gaits that are drawn, where they fit

_TEMPI = (0.8, 1.2)  # of the frequencies that are drawn, multiples of the prescribed one
_SHARE = 0.35  # of the numbers of a pose that are drawn; others are 0
_SPEED = 0.25  # at which a pose glides, standing heights or rad a sqrt(h / g)
_LEAST = 0.1  # standing heights or rad: a pose as far from the rest is judged as strictly as any nearer one
_UNTIMED = 0.7  # share of the feet that follow a contact schedule by chance, when a body walks in another gait
_DUTIES = (0.05, 0.95)
_FASTEST = 0.25  # cycles a control step


@dataclasses.dataclass(frozen=True, eq=False)
class Choices:
    """What poses and gaits are drawn from.

    Attributes:
        room: (6, 2) bounds of the numbers of a pose.
        gaits: (n, legs + 2) in units of the clock.
        tempi: between which their frequencies are drawn, multiples of the prescribed one.
    """

    room: np.ndarray
    gaits: np.ndarray
    tempi: tuple[float, float]


class Reference(NamedTuple):
    """What poses and gaits of a body are measured by.

    Attributes:
        ride: height of the torso at rest, standing heights.
        feet: (legs, 2) places from the torso at rest, forward and left, m.
        angles: (joints,) at rest, from the default ones, rad.
        turns: (joints, 6) of joints in a pose, rad.
        glide: of a pose in a control step, standing heights or rad.
        step: a control step, s.
        gait: (legs + 2,) the prescribed one, in units of the clock.
        choices: what is drawn from.
    """

    ride: float
    feet: np.ndarray
    angles: np.ndarray
    turns: np.ndarray
    glide: float
    step: float
    gait: np.ndarray
    choices: Choices


class GaitAndPoseMemory(NamedTuple):
    """Memory of a gait and a pose by command.

    Attributes:
        pose_ends: (..., COMMANDS) steps at which the poses of the schedule end.
        poses: (..., COMMANDS, 6); see `posture`.
        live_pose: (..., 6) set from outside, in place of the schedule where it is not NaN.
        gait_ends: (..., COMMANDS) steps at which the gaits of the schedule end.
        gaits: (..., COMMANDS, legs + 2) in units of the clock: offsets, duty factor, and advance in a control step.
        live_gait: (..., legs + 2) set from outside: offsets, cycles, duty factor, and frequency, Hz.
        pose: (..., 6) that holds.
        gait: (..., legs + 2) that holds, in units of the clock.
        phase: (...) of the gait, in units of the clock.
        off: (..., 6) by which the torso is off the pose that holds, a leaky mean over a cycle of the prescribed gait.
        posed: (...) how well the latest step kept the pose, 0 to 1.
        all_posed: (...) sum of `posed` over the steps.
        stepped: (...) share of the feet that follow the contact schedule, a leaky mean over the same cycle.
    """

    pose_ends: np.ndarray
    poses: np.ndarray
    live_pose: np.ndarray
    gait_ends: np.ndarray
    gaits: np.ndarray
    live_gait: np.ndarray
    pose: np.ndarray
    gait: np.ndarray
    phase: np.ndarray
    off: np.ndarray
    posed: np.ndarray
    all_posed: np.ndarray
    stepped: np.ndarray


_LIVE = {"pose": "live_pose", "gait": "live_gait"}


@dataclasses.dataclass(frozen=True)
class GaitAndPose:
    """A gait and a pose of the torso by command, in addition to a velocity; each is held for some seconds.

    Attributes:
        poses: share of the body's room from which poses are drawn; 0 for none.
        gaits: names of gaits that are drawn, with their frequencies; None for the steady ones that fit, and none of
            them for the prescribed gait alone.
        settings: names of the fields that a caller may set.
        observed: names of the blocks that show the gait and the pose that hold.
    """

    poses: float = 0.8
    gaits: tuple[str, ...] | None = None

    settings: ClassVar[tuple[str, ...]] = ("poses", "gaits")
    observed: ClassVar[tuple[str, ...]] = ("pose", "gait")

    def with_settings(self, body: Body, overrides: Mapping[str, Any]) -> Self:
        """Return the value with checked settings in place of its own.

        Raises:
            ValueError: a value that does not fit.
        """
        poses = checks.number("poses", overrides.get("poses", self.poses), 0.0, 1.0)
        names = overrides.get("gaits", self.gaits)
        names = None if names is None else checks.names("gaits", names, gaits.fitting_gaits(body), "gait")
        return dataclasses.replace(self, poses=poses, gaits=names)

    def live(self, body: Body) -> dict[str, int]:
        """Return the sizes of what may be set from outside while an episode runs, by name."""
        return {"pose": 6, "gait": len(body.legs) + 2}

    def limits(self, body: Body, step: float) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Return the lowest and highest numbers of poses and gaits, by name, given a control step, s."""
        most = np.append(np.ones(len(body.legs)), (_DUTIES[1], _FASTEST / step))
        least = np.append(-np.ones(len(body.legs)), (_DUTIES[0], 1.0 / (CYCLE * step)))
        return {"pose": (-np.ones(6), np.ones(6)), "gait": (least, most)}

    def named(self, body: Body, name: str, value: str) -> np.ndarray | None:
        """Return the numbers of a gait that is named, at the frequency that the task asks for; None for other commands.

        Raises:
            ValueError: no such gait, or one that does not fit the body.
        """
        if name != "gait":
            return None
        made = gaits.gait(body, value)
        return np.array((*made.offsets, made.duty_factor, np.nan))

    def reference(self, scene, parameters) -> Reference:
        """Return what poses and gaits of a body are measured by, in a task with `parameters.Parameters`."""
        body, rest = scene.body, posture.rest(scene.body)
        height, step = body.torso.standing_height, scene.control_timestep
        own = np.append(parameters.phase_offsets / TWO_PI, (parameters.duty_factor, parameters.gait_frequency))
        names = [name for name in STEADY if name in gaits.fitting_gaits(body)] if self.gaits is None else self.gaits
        made = [gaits.gait(body, name) for name in names]
        drawn = [np.array((*gait.offsets, gait.duty_factor, parameters.gait_frequency)) for gait in made] or [own]
        tempi = (1.0, 1.0) if names == () else _TEMPI
        return Reference(
            ride=rest.ride,
            feet=rest.places[:, :2],
            angles=rest.legs.by_joint(rest.angles),
            turns=posture.turns(body),
            glide=_SPEED * math.sqrt(GRAVITY / height) * step,
            step=step,
            gait=counted(own, step),
            choices=Choices(self.poses * posture.room(body, planted=False), counted(np.array(drawn), step), tempi),
        )

    def blocks(self, body: Body) -> dict[str, Block]:
        """Return the blocks that it adds: the clock and the pose that hold, and of the gait sine and cosine of the
        phase of each leg, the duty factor and the frequency by sqrt(g / h)."""
        pose = (
            Scalar("height", "h"),
            Planar(unit="h"),
            Planar(unit="rad", axes=ROTATIONS[:2], axial=True),
            Scalar("yaw", "rad", sign=-1),
        )
        gait = (
            Legs(body, "sine of the phase of {}"),
            Legs(body, "cosine of the phase of {}"),
            Scalar("duty factor"),
            Scalar("frequency", "sqrt(g / h)"),
        )
        return {"gait_clock": gait_clock(), "pose": Block(pose), "gait": Block(gait)}

    def start(self, context: Context, random: np.random.RandomState) -> GaitAndPoseMemory:
        """Draw poses and gaits, and when they end; an episode begins at rest, in the prescribed gait."""
        reference = context.reference
        low, high = reference.choices.room.T
        ends, gait_ends = (random.randint(SHORTEST, LONGEST, COMMANDS).cumsum() for _ in range(2))
        poses = random.uniform(-1.0, 1.0, (COMMANDS, 6)) * (random.uniform(size=(COMMANDS, 6)) < _SHARE)
        # Not all numbers at their bounds at once.
        poses /= abs(poses).sum(axis=-1, keepdims=True).clip(min=1.0)
        which, tempi = random.uniform(size=COMMANDS), random.uniform(*reference.choices.tempi, COMMANDS)
        drawn = reference.choices.gaits[(which * len(reference.choices.gaits)).astype(int)]
        drawn[:, -1] = np.rint(drawn[:, -1] * tempi)
        zero, still = np.float64(0.0), np.zeros(6)
        return GaitAndPoseMemory(
            pose_ends=ends,
            poses=np.where(poses < 0.0, -low, high) * poses,
            live_pose=np.full(6, np.nan),
            gait_ends=gait_ends,
            gaits=drawn,
            live_gait=np.full(len(reference.gait), np.nan),
            pose=still,
            gait=reference.gait,
            phase=np.int64(0),
            off=still,
            posed=zero,
            all_posed=zero,
            stepped=np.float64(1.0),
        )

    def before_feet(self, context: Context, memory: GaitAndPoseMemory, steps, going) -> GaitAndPoseMemory:
        """Return the memory with pose and gait a control step nearer to the command, and the clock a step on.

        Args:
            context: of the task.
            memory: before the step.
            steps: (...) control steps since the start, this one included.
            going: (...) whether the velocity is no stop, at which the clock rests.
        """
        xp, reference = memory.pose.__array_namespace__(), context.reference
        asked = held(memory.pose_ends, memory.poses, steps)
        asked = xp.where(xp.isnan(memory.live_pose), asked, memory.live_pose)
        glide = xp.asarray(reference.glide)[..., None]
        pose = memory.pose + xp.minimum(xp.maximum(asked - memory.pose, -glide), glide)
        live = counted(memory.live_gait, xp.asarray(reference.step)[..., None])
        asked = xp.where(xp.isnan(memory.live_gait), held(memory.gait_ends, memory.gaits, steps), live)
        gait = glided(memory.gait, asked)
        phase = (memory.phase + gait[..., -1] * going) % CYCLE
        return memory._replace(pose=pose, gait=gait, phase=phase)

    def after(self, context: Context, memory: GaitAndPoseMemory, readings, stepped) -> GaitAndPoseMemory:
        """Return the memory with how well the torso keeps its pose, and the feet their schedule.

        Args:
            context: of the task.
            memory: of `before_feet`.
            readings: after the step.
            stepped: (...) share of the feet that followed the contact schedule.
        """
        xp = memory.pose.__array_namespace__()
        leaks = xp.asarray(context.leak)[..., None]
        off = (1.0 - leaks) * memory.off + leaks * (measured(context, readings) - memory.pose)
        posed = kept(memory.pose[..., :3], off[..., :3]) * kept(memory.pose[..., 3:], off[..., 3:])
        stepped = (1.0 - context.leak) * memory.stepped + context.leak * stepped
        return memory._replace(off=off, posed=posed, all_posed=memory.all_posed + posed, stepped=stepped)

    def resampled(self, memory: GaitAndPoseMemory, steps) -> Any:
        """Return whether (...) another drawn pose or gait holds since step `steps`, unless live."""
        pose = begins(memory.pose_ends, memory.live_pose, steps)
        return pose | begins(memory.gait_ends, memory.live_gait, steps)

    def with_command(self, memory: GaitAndPoseMemory, name: str, value) -> GaitAndPoseMemory:
        """Return the memory with a live pose or gait."""
        return memory._replace(**{_LIVE[name]: value})

    def phase(self, memory: GaitAndPoseMemory):
        """Return the phase (...) of the gait, rad."""
        return memory.phase * (TWO_PI / CYCLE)

    def circle(self, memory: GaitAndPoseMemory):
        """Return sine and cosine (..., 2) of the phase."""
        return _circle(memory.phase, memory.pose)

    def stance(self, memory: GaitAndPoseMemory):
        """Return which feet (..., legs) the gait that holds has on the ground."""
        return _phases(memory) < memory.gait[..., -2:-1]

    def leg_phases(self, memory: GaitAndPoseMemory) -> tuple[Any, Any]:
        """Return the phase (..., legs) of each leg, rad, and the duty factor (...) of the gait that holds."""
        return _phases(memory) * (TWO_PI / CYCLE), memory.gait[..., -2] / CYCLE

    def crouch(self, memory: GaitAndPoseMemory):
        """Return the share (...) of its height at rest that the torso is asked to keep, at most 1."""
        return (1.0 + memory.pose[..., 0]).clip(max=1.0)

    def default_angles(self, context: Context, memory: GaitAndPoseMemory, default_angles):
        """Return the angles (..., joints) from which the posture is measured: those of the pose that holds, rad.

        Args:
            context: of the task.
            memory: after the step.
            default_angles: (joints,) of the task, rad.
        """
        reference = context.reference
        turned = (reference.turns * memory.pose[..., None, :]).sum(axis=-1)
        return default_angles + reference.angles + turned

    def terms(self, memory: GaitAndPoseMemory, earned: Mapping[str, Any], followed) -> dict:
        """Return the bonuses for the velocity, and that for following it in the pose and the gait.

        Args:
            memory: after the step.
            earned: bonuses of the velocity's command, by name.
            followed: (...) tracking of the step.
        """
        in_gait = ((memory.stepped - _UNTIMED) / (1.0 - _UNTIMED)).clip(0.0)
        obedience = followed * memory.posed * in_gait
        return {"progress": earned["progress"], "tracking": earned["tracking"], "obedience": obedience}

    def observe(self, context: Context, memory: GaitAndPoseMemory) -> dict:
        """Return the pose and the gait that hold."""
        xp, reference = memory.pose.__array_namespace__(), context.reference
        circles = _circle(_phases(memory), memory.pose)
        rate = xp.asarray(context.height / GRAVITY) ** 0.5 / xp.asarray(reference.step)
        duty, advance = (memory.gait[..., i] / CYCLE for i in (-2, -1))
        numbers = xp.stack([duty, advance * rate], axis=-1)
        return {
            "pose": memory.pose,
            "gait": xp.concatenate([circles[..., 0], circles[..., 1], numbers], axis=-1),
        }

    def progress(self, memory: GaitAndPoseMemory, judged) -> dict:
        """Return how well the pose was kept, on average over the steps (...) by which the episode is judged."""
        return {"pose_tracking": memory.all_posed / judged}


def counted(gait, step) -> np.ndarray:
    """Return a gait (..., legs + 2) in units of the clock, integers; NaN becomes any of them.

    Args:
        gait: offsets, cycles, duty factor and frequency, Hz.
        step: a control step, s.
    """
    numpy = gait.__array_namespace__()
    gait = numpy.where(numpy.isnan(gait), 0.0, gait)
    offsets, duty, advance = gait[..., :-2] % 1.0, gait[..., -2:-1], gait[..., -1:] * step
    shares = numpy.concatenate([offsets, duty.clip(*_DUTIES), advance.clip(1.0 / CYCLE, _FASTEST)], axis=-1)
    return numpy.rint(CYCLE * shares).astype(int)


def glided(gait, asked):
    """Return a gait (..., legs + 2) that is a control step nearer to another, within a cycle; offsets the short way."""
    numpy, half, advance = gait.__array_namespace__(), CYCLE // 2, gait[..., -1:]
    apart = asked - gait
    apart = numpy.concatenate([(apart[..., :-2] + half) % CYCLE - half, apart[..., -2:]], axis=-1)
    most = numpy.maximum(advance // 2, 1)
    gait = gait + numpy.minimum(numpy.maximum(apart, -most), most)
    return numpy.concatenate([gait[..., :-2] % CYCLE, gait[..., -2:]], axis=-1)


def measured(context: Context, readings):
    """Return the pose (..., 6) of a torso over its feet."""
    numpy, reference, height = readings.posture.__array_namespace__(), context.reference, context.height
    rest = numpy.asarray(reference.feet)
    middle, apart = readings.feet.mean(axis=-2, keepdims=True), rest - rest.mean(axis=-2, keepdims=True)
    shift = (rest - readings.feet).mean(axis=-2) / numpy.asarray(height)[..., None]
    (x, y), (feet_x, feet_y) = (numpy.moveaxis(places, -1, 0) for places in (apart, readings.feet - middle))
    yaw = numpy.arctan2((feet_x * y - feet_y * x).sum(axis=-1), (feet_x * x + feet_y * y).sum(axis=-1))
    rise = readings.torso_height / height - reference.ride
    tilt = posture.tilt(rotations.matrix(readings.torso_quaternion)[..., 2, :])
    return numpy.concatenate([rise[..., None], shift, tilt, yaw[..., None]], axis=-1)


def kept(pose, off):
    """Return how well (...) some numbers (..., n) of a pose are kept, given by how much (..., n) they are off."""
    numpy = pose.__array_namespace__()
    size, miss = (numpy.sqrt((numbers * numbers).sum(axis=-1)) for numbers in (pose, off))
    return terms.triangle(miss, BAND * numpy.maximum(size, _LEAST / BAND))


def _phases(memory: GaitAndPoseMemory):
    """The phase (..., legs) of each leg, in units of the clock."""
    return (memory.phase[..., None] + memory.gait[..., :-2]) % CYCLE


def _circle(phase, like):
    """Sine and cosine (..., 2) of phases (...), in units of the clock."""
    numpy, angle = like.__array_namespace__(), phase * (TWO_PI / CYCLE)
    return numpy.stack([numpy.sin(angle), numpy.cos(angle)], axis=-1)
