"""A demonstrator's pattern for any body, from the Jacobians of its feet in the standing pose.

In stance every foot moves straight back, at the speed at which the body shall move forward. In swing it returns, and
is lifted. Both are directions in a leg's joint space, by damped least squares: no search and no inverse kinematics is
needed.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple, Self

import numpy as np

from arc_suite import checks, rotations
from arc_suite.cpg.drives import drive
from arc_suite.cpg.gait import gait_of
from arc_suite.cpg.law import Drive, Pattern, joint_targets, proprioception
from arc_suite.models.overlap import find_largest_stretch
from arc_suite.models.sizing import size_body
from arc_suite.models.standing import PoseMechanics, measure_standing, speed_unit
from arc_suite.models.stride import FOOT_LIFT, cycle_angles, strokes
from arc_suite.tasks.contract import Task

_MIN_FROUDE = 1e-3

# A leg that cannot sweep, such as a radial one in front, would brake. It stays this share of the standing height off
# the ground in stance too, and carries weight only when other legs sink or the body tilts.
UNLOADED_HEIGHT = 0.1

_SAMPLES = np.arange(24) / 24  # of a cycle, at which legs must pass each other

ONSET_CYCLES = 1.0  # over which the gait grows to its full size
STEERING = 1.5  # share of the sweep per rad of yaw, for the outermost feet
MAX_YAW = 0.5  # rad, beyond which steering does not grow

# Strides of motors grow by as much as the body is too slow, as a share of its speed, within bounds. Servos follow
# their targets closely: of nine robots with servos three fall with this feedback, and one without it.
STRETCH_BOUNDS = (0.5, 1.8)
SMOOTHING_CYCLES = 0.4  # over which the speed is averaged


class Stride(NamedTuple):
    """Control of a body by position: each joint follows its target and the target's velocity.

    Attributes:
        pattern: pattern of the joints.
        speed: target speed along world x, m/s.
        control_timestep: s.
        drive: actuators of the joints.
        held: (joints,) action of a standing leg that carries its share of the weight.
        steering: (joints,) share by which the sweep of the joint's leg grows for a yaw of 1 rad.
        longest: largest factor of sweeps; further, legs would pass through each other.
    """

    pattern: Pattern
    speed: float
    control_timestep: float
    drive: Drive
    held: np.ndarray
    steering: np.ndarray
    longest: float

    @classmethod
    def fit(cls, task: Task, froude: float) -> Self:
        """Return the stride that suits a body, in the gait of a task.

        Args:
            task: task with the body and the gait.
            froude: speed at the task's default target velocity, as a share of sqrt(g h), from -1 to 1 and not 0; it
                scales with the target velocity. Legs that are too short for it sweep as far as they reach. A negative
                speed is backwards.

        Raises:
            ValueError: the speed or the gait does not fit.
        """
        if abs(checks.number("froude", froude, -1.0, 1.0)) < _MIN_FROUDE:
            raise ValueError(
                f"froude: expected {_MIN_FROUDE:g} or more, forwards or backwards, got {checks.preview(froude)}"
            )
        gait = gait_of(task)
        pose = measure_standing(task.scene.body)  # the task has measured this body, so the result is in a cache
        body = size_body(task.scene.body)
        speed = gait.pace * froude * speed_unit(pose.height)
        # A foot on the ground moves from +reach to -reach during its stance, m.
        reach = 0.5 * speed * gait.duty_factor / gait.frequency
        if reach == 0.0:
            reach = 1e-6 * pose.height
        joint_counts = [len(leg.joints) for leg in body.legs]
        leg_strokes = strokes(task.scene.body, reach)  # sweep and lift of each leg, (joints of the leg,), rad
        sweep = np.concatenate([sweep for sweep, _ in leg_strokes])
        lift = np.concatenate([lift for _, lift in leg_strokes])
        center = np.concatenate(_lift_centers(pose, leg_strokes, reach))
        offset = np.repeat(gait.offsets, joint_counts)

        def stretch_strides(stretch: float) -> np.ndarray:
            cycles = (_SAMPLES[:, None] + offset) % 1.0
            return center + cycle_angles(cycles, gait.duty_factor, stretch * sweep, lift)

        pattern = Pattern(
            frequency=gait.frequency,
            duty_factor=gait.duty_factor,
            offset=offset,
            sweep=sweep,
            center=center,
            stance=np.zeros(len(body.joints)),
            swing=lift,
        )
        largest_torques = np.array([joint.torque for joint in body.joints])
        # Positions of feet to the left of the torso, from -1 to 1.
        lateral_positions = pose.soles[:, 1] / max(abs(pose.soles[:, 1]).max(), 1e-9)
        return cls(
            pattern=pattern,
            speed=speed,
            control_timestep=task.scene.control_timestep,
            drive=drive(body, pose.inertias),
            held=pose.loads / (gait.duty_factor * largest_torques),
            steering=math.copysign(STEERING, speed) * np.repeat(lateral_positions, joint_counts),
            longest=find_largest_stretch(task.scene.body, stretch_strides, STRETCH_BOUNDS[1]),
        )

    def __call__(self, clock, speed, quaternion, angles, velocities):
        """Return the actions (..., joints) after `clock` (...) control steps, at a speed (...) along world x, m/s."""
        yaw = rotations.yaw(quaternion)[..., None]
        # If the body has turned to the left, legs on the left take longer strides.
        stretch = 1.0 + self.steering * yaw.clip(-MAX_YAW, MAX_YAW)
        has_motors = self.drive.reach is None
        if has_motors:
            shortest, longest = STRETCH_BOUNDS
            stretch = (2.0 - speed / self.speed).clip(shortest, longest)[..., None] * stretch
        pattern = self.pattern._replace(sweep=self.pattern.sweep * stretch.clip(max=self.longest))
        time = self.control_timestep * clock
        onset = (pattern.frequency * time[..., None] / ONSET_CYCLES).clip(max=1.0)
        targets = onset * joint_targets(pattern, time)
        next_targets = onset * joint_targets(pattern, time + self.control_timestep)
        target_velocities = (next_targets - targets) / self.control_timestep
        phase = (pattern.frequency * time[..., None] + pattern.offset) % 1.0  # cycles
        in_stance = phase < pattern.duty_factor
        return self.drive.actions(targets, target_velocities, angles, velocities, self.held * in_stance)


def _lift_centers(
    pose: PoseMechanics, leg_strokes: list[tuple[np.ndarray, np.ndarray]], reach: float
) -> list[np.ndarray]:
    """Return for each leg the angles (joints of the leg,), rad, about which it moves: the less it sweeps, the higher.

    Args:
        pose: the standing pose.
        leg_strokes: sweep and lift of each leg, (joints of the leg,), rad.
        reach: half of the way of a foot in stance, m.
    """
    centers = []
    for jacobian, (sweep, lift) in zip(pose.jacobians, leg_strokes, strict=True):
        sweep_share = np.clip(jacobian[0] @ sweep / reach, 0.0, 1.0)  # of the reach that the leg can sweep
        centers.append((1.0 - sweep_share) * UNLOADED_HEIGHT / FOOT_LIFT * lift)
    return centers


class StrideState(NamedTuple):
    """The state of a law by a stride.

    Attributes:
        steps: (environments,) control steps since the start of the episode.
        speed: (environments,) smoothed speed along world x, m/s.
    """

    steps: np.ndarray
    speed: np.ndarray


class StrideLaw:
    """The law by a stride, in the gait of a task."""

    reads: tuple[str, ...] = ("posture", "velocities")

    def __init__(self, task: Task, froude: float):
        """Fit a stride; see `Stride.fit`."""
        self.stride = Stride.fit(task, froude)
        cycles_per_step = self.stride.pattern.frequency * self.stride.control_timestep
        self.smoothing = min(1.0, cycles_per_step / SMOOTHING_CYCLES)

    def initial(self, count: int) -> StrideState:
        """Return the state at the start of episodes in a number of environments."""
        return StrideState(np.zeros(count, int), np.full(count, self.stride.speed))

    def __call__(self, state: StrideState, observation: Mapping) -> tuple:
        """Return the next state and the actions (environments, joints)."""
        speed = state.speed + self.smoothing * (observation["velocities"][..., 0] - state.speed)
        quaternion, angles, velocities = proprioception(observation)
        actions = self.stride(state.steps, speed, quaternion, angles, velocities)
        return StrideState(state.steps + 1, speed), actions
