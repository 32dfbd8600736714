"""Commanded gaits and poses of the torso, drawn for the episode or set while it runs.

The present pose and gait glide: they approach the commanded ones by bounded steps. The clock counts integers, so that
touchdowns of every gait are exact. The phase continues when the command changes to another gait.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np

from arc_suite import checks, rotations
from arc_suite.models import posture
from arc_suite.models.standing import GRAVITY, rate_unit
from arc_suite.robots import gaits
from arc_suite.robots.spec import Body
from arc_suite.tasks import terms
from arc_suite.tasks.blocks import Block, gait_clock
from arc_suite.tasks.clock import TWO_PI, compliance
from arc_suite.tasks.command import BAND, COMMANDS, LONGEST, SHORTEST, begins_next, scheduled_value
from arc_suite.tasks.context import Context
from arc_suite.tasks.parts import ROTATIONS, Legs, Planar, Scalar

CYCLE = 1 << 20  # units of the clock in a cycle of the gait
DRAWN_GAITS = ("trot", "walk", "tripod", "tetrapod", "ripple")  # those that fit the body

_FREQUENCY_RANGE = (0.8, 1.2)  # of drawn frequencies, multiples of the prescribed one
_DRAW_PROBABILITY = 0.35  # that a number of a pose is drawn; others are 0
_MAX_POSE_SPEED = 0.25  # at which a pose changes, standing heights or rad in a time of sqrt(h / g)
_MIN_POSE_SIZE = 0.1  # standing heights or rad; smaller poses are judged as strictly as one of this size
_CHANCE_IN_SCHEDULE = 0.7  # share of feet that follow a contact schedule by chance, in a walk in another gait
_DUTY_FACTORS = (0.05, 0.95)  # bounds
_MAX_ADVANCE = 0.25  # cycles a control step


@dataclasses.dataclass(frozen=True, eq=False)
class Choices:
    """Ranges of drawn poses and gaits.

    Attributes:
        room: (6, 2) bounds of the numbers of a pose.
        gaits: (n, legs + 2) in units of the clock.
        frequency_range: range of drawn frequencies, multiples of the prescribed one.
    """

    room: np.ndarray
    gaits: np.ndarray
    frequency_range: tuple[float, float]


class Reference(NamedTuple):
    """Reference of a body by which poses and gaits are measured.

    Attributes:
        ride_height: height of the torso at rest, standing heights.
        feet: (legs, 2) positions from the torso at rest, forward and left, m.
        angles: (joints,) at rest, relative to the default ones, rad.
        angle_jacobian: (joints, 6) derivatives of joint angles by the numbers of a pose, rad.
        glide: largest change of a pose in a control step, standing heights or rad.
        step: control step, s.
        gait: (legs + 2,) the prescribed gait, in units of the clock.
        choices: ranges of drawn poses and gaits.
    """

    ride_height: float
    feet: np.ndarray
    angles: np.ndarray
    angle_jacobian: np.ndarray
    glide: float
    step: float
    gait: np.ndarray
    choices: Choices


class GaitAndPoseMemory(NamedTuple):
    """Memory of `GaitAndPose`.

    Attributes:
        pose_ends: (..., COMMANDS) steps at which the poses of the schedule end.
        poses: (..., COMMANDS, 6); see `posture`.
        live_pose: (..., 6) set from outside; NaN for the pose of the schedule.
        gait_ends: (..., COMMANDS) steps at which the gaits of the schedule end.
        gaits: (..., COMMANDS, legs + 2) in units of the clock: offsets, duty factor, and advance in a control step.
        live_gait: (..., legs + 2) set from outside: offsets, cycles, duty factor, and frequency, Hz; NaN for that
            of the schedule.
        pose: (..., 6) the present one, which approaches the commanded one.
        gait: (..., legs + 2) the present one, in units of the clock.
        phase: (...) phase of the gait, in units of the clock.
        pose_error: (..., 6) error of the torso's pose, a leaky mean over a cycle of the prescribed gait.
        pose_tracking: (...) how well the latest step kept the pose, 0 to 1.
        all_pose_tracking: (...) sum of `pose_tracking` over the steps.
        feet_in_schedule: (...) share of the feet that follow the contact schedule, a leaky mean over the same cycle.
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
    pose_error: np.ndarray
    pose_tracking: np.ndarray
    all_pose_tracking: np.ndarray
    feet_in_schedule: np.ndarray


_FIELD_OF_COMMAND = {"pose": "live_pose", "gait": "live_gait"}


@dataclasses.dataclass(frozen=True)
class GaitAndPose:
    """A commanded gait and a commanded pose of the torso, in addition to a velocity; each holds for some seconds.

    Attributes:
        poses: share of the body's room from which poses are drawn; 0 for no poses.
        gaits: names of gaits that are drawn, with their frequencies; None for those of `DRAWN_GAITS` that fit, empty
            for the prescribed gait alone.
        settings: names of the fields that a caller may set.
        observed: names of the blocks of the present gait and pose.
        needs_feet: whether `after` takes the positions of the feet from the readings.
    """

    poses: float = 0.8
    gaits: tuple[str, ...] | None = None

    settings: ClassVar[tuple[str, ...]] = ("poses", "gaits")
    observed: ClassVar[tuple[str, ...]] = ("pose", "gait")
    needs_feet: ClassVar[bool] = True

    def with_settings(self, body: Body, overrides: Mapping[str, Any]) -> Self:
        """Return the value with checked settings in place of its own.

        Raises:
            ValueError: a value that does not fit.
        """
        poses = checks.number("poses", overrides.get("poses", self.poses), 0.0, 1.0)
        names = overrides.get("gaits", self.gaits)
        if names is not None:
            names = checks.names("gaits", names, gaits.fitting_gaits(body), "gait")
        return dataclasses.replace(self, poses=poses, gaits=names)

    def live(self, body: Body) -> dict[str, int]:
        """Return the sizes of what may be set from outside while an episode runs, by name."""
        return {"pose": 6, "gait": len(body.legs) + 2}

    def limits(self, body: Body, step: float) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Return the lowest and highest numbers of poses and gaits, by name, given a control step, s."""
        low_duty_factor, high_duty_factor = _DUTY_FACTORS
        lowest = np.append(-np.ones(len(body.legs)), (low_duty_factor, 1.0 / (CYCLE * step)))
        highest = np.append(np.ones(len(body.legs)), (high_duty_factor, _MAX_ADVANCE / step))
        return {"pose": (-np.ones(6), np.ones(6)), "gait": (lowest, highest)}

    def named_command(self, body: Body, name: str, value: str) -> np.ndarray | None:
        """Return the numbers of a gait by its name, at the frequency of the schedule; None for other commands.

        Raises:
            ValueError: no such gait, or one that does not fit the body.
        """
        if name != "gait":
            return None
        gait = gaits.gait(body, value)
        return np.array((*gait.offsets, gait.duty_factor, np.nan))

    def reference(self, scene, parameters) -> Reference:
        """Return the reference of a body, in a task with `parameters.Parameters`."""
        body = scene.body
        rest_pose = posture.find_pose_with_room(body)
        control_timestep = scene.control_timestep
        prescribed = np.append(parameters.phase_offsets / TWO_PI, (parameters.duty_factor, parameters.gait_frequency))
        choices = Choices(
            room=self.poses * posture.measure_room(body, planted=False),
            gaits=to_clock_units(self._drawn_gaits(body, prescribed), control_timestep),
            frequency_range=(1.0, 1.0) if self.gaits == () else _FREQUENCY_RANGE,
        )
        return Reference(
            ride_height=rest_pose.ride_height,
            feet=rest_pose.sole_positions[:, :2],
            angles=rest_pose.legs.by_joint(rest_pose.joint_angles),
            angle_jacobian=posture.linearize_joint_angles(body),
            glide=_MAX_POSE_SPEED * rate_unit(body.torso.standing_height) * control_timestep,
            step=control_timestep,
            gait=to_clock_units(prescribed, control_timestep),
            choices=choices,
        )

    def _drawn_gaits(self, body: Body, prescribed: np.ndarray) -> np.ndarray:
        """Return the gaits (n, legs + 2) that are drawn, at the prescribed frequency; else the prescribed one."""
        names = self.gaits
        if names is None:
            names = [name for name in DRAWN_GAITS if name in gaits.fitting_gaits(body)]
        if not names:
            return prescribed[None]
        frequency = prescribed[-1]
        drawn_gaits = [gaits.gait(body, name) for name in names]
        return np.array([(*gait.offsets, gait.duty_factor, frequency) for gait in drawn_gaits])

    def blocks(self, body: Body) -> dict[str, Block]:
        """Return the blocks that it adds: the clock, the pose, and the gait.

        The block of the gait has sine and cosine of the phase of each leg, duty factor, and frequency over sqrt(g / h).
        """
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
        choices = reference.choices
        low, high = choices.room.T
        pose_ends = random.randint(SHORTEST, LONGEST, COMMANDS).cumsum()
        gait_ends = random.randint(SHORTEST, LONGEST, COMMANDS).cumsum()
        poses = random.uniform(-1.0, 1.0, (COMMANDS, 6)) * (random.uniform(size=(COMMANDS, 6)) < _DRAW_PROBABILITY)
        # Numbers are not at their bounds all at once.
        poses /= abs(poses).sum(axis=-1, keepdims=True).clip(min=1.0)
        indices = (random.uniform(size=COMMANDS) * len(choices.gaits)).astype(int)
        lowest_factor, highest_factor = choices.frequency_range
        frequency_factors = random.uniform(lowest_factor, highest_factor, COMMANDS)
        drawn_gaits = choices.gaits[indices]
        drawn_gaits[:, -1] = np.rint(drawn_gaits[:, -1] * frequency_factors)
        zero = np.float64(0.0)
        return GaitAndPoseMemory(
            pose_ends=pose_ends,
            poses=np.where(poses < 0.0, -low, high) * poses,
            live_pose=np.full(6, np.nan),
            gait_ends=gait_ends,
            gaits=drawn_gaits,
            live_gait=np.full(len(reference.gait), np.nan),
            pose=np.zeros(6),
            gait=reference.gait,
            phase=np.int64(0),
            pose_error=np.zeros(6),
            pose_tracking=zero,
            all_pose_tracking=zero,
            feet_in_schedule=np.float64(1.0),
        )

    def advance(self, context: Context, memory: GaitAndPoseMemory, steps, is_going) -> GaitAndPoseMemory:
        """Return the memory with pose and gait a control step nearer to the command, and the clock advanced.

        Args:
            context: context of the task.
            memory: before the step.
            steps: (...) control steps since the start, this one included.
            is_going: (...) whether the commanded velocity is no stop; at a stop the clock stands still.
        """
        xp = memory.pose.__array_namespace__()
        reference = context.reference
        scheduled_pose = scheduled_value(memory.pose_ends, memory.poses, steps)
        commanded_pose = xp.where(xp.isnan(memory.live_pose), scheduled_pose, memory.live_pose)
        max_change = xp.asarray(reference.glide)[..., None]
        pose = memory.pose + xp.minimum(xp.maximum(commanded_pose - memory.pose, -max_change), max_change)
        live_gait = to_clock_units(memory.live_gait, xp.asarray(reference.step)[..., None])
        scheduled_gait = scheduled_value(memory.gait_ends, memory.gaits, steps)
        commanded_gait = xp.where(xp.isnan(memory.live_gait), scheduled_gait, live_gait)
        gait = glide_gait(memory.gait, commanded_gait)
        phase = (memory.phase + gait[..., -1] * is_going) % CYCLE
        return memory._replace(pose=pose, gait=gait, phase=phase)

    def after(self, context: Context, memory: GaitAndPoseMemory, readings, schedule_errors) -> GaitAndPoseMemory:
        """Return the memory with how well the torso keeps its pose, and the feet their schedule.

        Args:
            context: context of the task.
            memory: from `advance`.
            readings: after the step.
            schedule_errors: (...) number of contact schedule errors in the step.
        """
        xp = memory.pose.__array_namespace__()
        leak = context.leak
        leaks = xp.asarray(leak)[..., None]
        pose = memory.pose
        pose_error = (1.0 - leaks) * memory.pose_error + leaks * (measure_pose(context, readings) - pose)
        translation_tracking = tracking_of_pose(pose[..., :3], pose_error[..., :3])
        rotation_tracking = tracking_of_pose(pose[..., 3:], pose_error[..., 3:])
        pose_tracking = translation_tracking * rotation_tracking
        feet_in_schedule = compliance(schedule_errors, 1, readings.foot_heights.shape[-1])
        return memory._replace(
            pose_error=pose_error,
            pose_tracking=pose_tracking,
            all_pose_tracking=memory.all_pose_tracking + pose_tracking,
            feet_in_schedule=(1.0 - leak) * memory.feet_in_schedule + leak * feet_in_schedule,
        )

    def resampled(self, memory: GaitAndPoseMemory, steps) -> Any:
        """Return whether (...) another drawn pose or gait holds since step `steps`, unless a live one does."""
        begins_pose = begins_next(memory.pose_ends, memory.live_pose, steps)
        return begins_pose | begins_next(memory.gait_ends, memory.live_gait, steps)

    def with_command(self, memory: GaitAndPoseMemory, name: str, value) -> GaitAndPoseMemory:
        """Return the memory with a live pose or gait."""
        return memory._replace(**{_FIELD_OF_COMMAND[name]: value})

    # The phase is in the memory. A prescribed gait takes it from the tick of the task's clock.

    def phase(self, tick, memory: GaitAndPoseMemory):
        """Return the phase (...) of the gait, rad."""
        return memory.phase * (TWO_PI / CYCLE)

    def circle(self, tick, memory: GaitAndPoseMemory):
        """Return sine and cosine (..., 2) of the phase."""
        return _circle(memory.phase, memory.pose)

    def stance(self, tick, memory: GaitAndPoseMemory):
        """Return which feet (..., legs) the present gait has on the ground."""
        return _phases(memory) < memory.gait[..., -2:-1]

    def leg_phases(self, tick, memory: GaitAndPoseMemory) -> tuple[Any, Any]:
        """Return the phase (..., legs) of each leg, rad, and the duty factor (...) of the present gait."""
        return _phases(memory) * (TWO_PI / CYCLE), memory.gait[..., -2] / CYCLE

    def height_share(self, memory: GaitAndPoseMemory):
        """Return the commanded height (...) of the torso as a share of that at rest, at most 1."""
        return (1.0 + memory.pose[..., 0]).clip(max=1.0)

    def default_angles(self, context: Context, memory: GaitAndPoseMemory, default_angles):
        """Return the angles (..., joints) from which the posture is measured: those of the present pose, rad.

        Args:
            context: context of the task.
            memory: after the step.
            default_angles: (joints,) default angles of the task, rad.
        """
        reference = context.reference
        angles_in_pose = (reference.angle_jacobian * memory.pose[..., None, :]).sum(axis=-1)
        return default_angles + reference.angles + angles_in_pose

    def terms(self, memory: GaitAndPoseMemory, bonuses: Mapping[str, Any], step_tracking) -> dict:
        """Return the bonuses for the velocity, and that for following it in the pose and the gait.

        Args:
            memory: after the step.
            bonuses: bonuses of the command of the velocity, by name.
            step_tracking: (...) tracking of the step.
        """
        gait_tracking = ((memory.feet_in_schedule - _CHANCE_IN_SCHEDULE) / (1.0 - _CHANCE_IN_SCHEDULE)).clip(0.0)
        obedience = step_tracking * memory.pose_tracking * gait_tracking
        return {"progress": bonuses["progress"], "tracking": bonuses["tracking"], "obedience": obedience}

    def observe(self, context: Context, memory: GaitAndPoseMemory) -> dict:
        """Return the blocks of the present pose and gait."""
        xp = memory.pose.__array_namespace__()
        circles = _circle(_phases(memory), memory.pose)
        time_unit = xp.asarray(context.height / GRAVITY) ** 0.5 / xp.asarray(context.reference.step)  # control steps
        duty_factor = memory.gait[..., -2] / CYCLE
        advance = memory.gait[..., -1] / CYCLE
        numbers = xp.stack([duty_factor, advance * time_unit], axis=-1)
        return {
            "pose": memory.pose,
            "gait": xp.concatenate([circles[..., 0], circles[..., 1], numbers], axis=-1),
        }

    def progress(self, memory: GaitAndPoseMemory, judged_steps) -> dict:
        """Return the mean tracking of the pose over the steps (...) by which the episode is judged."""
        return {"pose_tracking": memory.all_pose_tracking / judged_steps}


def to_clock_units(gait, step) -> np.ndarray:
    """Return a gait (..., legs + 2) in units of the clock, integers; NaN becomes an arbitrary one.

    Args:
        gait: offsets, cycles, duty factor and frequency, Hz.
        step: control step, s.
    """
    xp = gait.__array_namespace__()
    gait = xp.where(xp.isnan(gait), 0.0, gait)
    offsets = gait[..., :-2] % 1.0
    duty_factor = gait[..., -2:-1].clip(*_DUTY_FACTORS)
    advance = (gait[..., -1:] * step).clip(1.0 / CYCLE, _MAX_ADVANCE)
    shares = xp.concatenate([offsets, duty_factor, advance], axis=-1)
    return xp.rint(CYCLE * shares).astype(int)


def glide_gait(gait, commanded_gait):
    """Return a gait (..., legs + 2) that is a control step nearer to the commanded one, which it reaches in a cycle.

    Offsets change in the direction that is shorter.
    """
    xp = gait.__array_namespace__()
    half_cycle = CYCLE // 2
    difference = commanded_gait - gait
    offset_difference = (difference[..., :-2] + half_cycle) % CYCLE - half_cycle
    difference = xp.concatenate([offset_difference, difference[..., -2:]], axis=-1)
    advance = gait[..., -1:]
    max_change = xp.maximum(advance // 2, 1)
    gait = gait + xp.minimum(xp.maximum(difference, -max_change), max_change)
    return xp.concatenate([gait[..., :-2] % CYCLE, gait[..., -2:]], axis=-1)


def measure_pose(context: Context, readings):
    """Return the pose (..., 6) of a torso relative to its feet."""
    xp = readings.posture.__array_namespace__()
    reference = context.reference
    height = context.height
    rest_feet = xp.asarray(reference.feet)
    feet = readings.feet
    shift = (rest_feet - feet).mean(axis=-2) / xp.asarray(height)[..., None]
    rest_x, rest_y = xp.moveaxis(rest_feet - rest_feet.mean(axis=-2, keepdims=True), -1, 0)
    feet_x, feet_y = xp.moveaxis(feet - feet.mean(axis=-2, keepdims=True), -1, 0)
    # The rotation that turns the feet onto those at rest, by least squares.
    sine = (feet_x * rest_y - feet_y * rest_x).sum(axis=-1)
    cosine = (feet_x * rest_x + feet_y * rest_y).sum(axis=-1)
    yaw = xp.arctan2(sine, cosine)
    rise = readings.torso_height / height - reference.ride_height
    tilt = posture.roll_and_pitch_of(rotations.matrix(readings.torso_quaternion)[..., 2, :])
    return xp.concatenate([rise[..., None], shift, tilt, yaw[..., None]], axis=-1)


def tracking_of_pose(pose, pose_error):
    """Return how well (...) some numbers (..., n) of a pose are kept, 0 to 1, given their errors (..., n)."""
    xp = pose.__array_namespace__()
    size = xp.sqrt((pose * pose).sum(axis=-1))
    error = xp.sqrt((pose_error * pose_error).sum(axis=-1))
    return terms.triangle(error, BAND * xp.maximum(size, _MIN_POSE_SIZE / BAND))


def _phases(memory: GaitAndPoseMemory):
    """Return the phase (..., legs) of each leg, in units of the clock."""
    return (memory.phase[..., None] + memory.gait[..., :-2]) % CYCLE


def _circle(phase, like):
    """Return sine and cosine (..., 2) of phases (...) in units of the clock, by the functions of an array `like`."""
    xp = like.__array_namespace__()
    angle = phase * (TWO_PI / CYCLE)
    return xp.stack([xp.sin(angle), xp.cos(angle)], axis=-1)
