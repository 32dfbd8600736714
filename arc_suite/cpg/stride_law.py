"""A demonstrator's pattern for any body, from the Jacobians of its feet in the standing pose.

In stance every foot is to move straight back as fast as the body is to move forward; in swing it
returns and is lifted. Both are directions in a leg's joint space, found by damped least squares,
so that neither search nor inverse kinematics is needed.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple, Self

import numpy as np

from arc_suite import checks, rotations
from arc_suite.cpg.drives import drive
from arc_suite.cpg.gait import gait_of
from arc_suite.cpg.law import Drive, Pattern, joint_targets, proprioception
from arc_suite.models.sizing import size_body
from arc_suite.models.standing import GRAVITY, measure_standing
from arc_suite.models.stride import FOOT_LIFT, strokes
from arc_suite.tasks.contract import Task

_LEAST_FROUDE = 1e-3

# A leg that cannot sweep, such as a radial one in front, would brake: it is held this share of the
# standing height off the ground in stance too, and carries only when the others sink or tilt.
UNLOAD = 0.1

ONSET = 1.0  # cycles over which the gait grows to its full size
STEERING = 1.5  # share of the sweep per rad of yaw, for the outermost feet
LARGEST_YAW = 0.5  # rad, that is answered to

# Strides grow by as much as the body is too slow, in shares of its speed, and within bounds. Servos follow their
# targets closely; with feedback three of nine of their robots fall, and without it one.
STRETCH = (0.5, 1.8)
SMOOTHING = 0.4  # cycles over which the speed is averaged


class Stride(NamedTuple):
    """Control of a body by position: each joint follows its target and the target's velocity.

    Attributes:
        pattern: of the joints.
        speed: along world x that is asked for, m/s.
        control_timestep: s.
        drive: of the joints.
        held: (joints,) action that a standing leg adds, by which it holds its share of the weight.
        steering: (joints,) by which share the sweep of the joint's leg answers to a yaw of 1 rad.
    """

    pattern: Pattern
    speed: float
    control_timestep: float
    drive: Drive
    held: np.ndarray
    steering: np.ndarray

    @classmethod
    def fit(cls, task: Task, froude: float) -> Self:
        """Return the stride that suits a body, in the gait of a task.

        Args:
            task: whose body is to walk, and whose gait it walks in.
            froude: speed as a share of sqrt(g h), from -1 to 1 and not 0, at the default target velocity, with
                which it scales; where legs are too short for it, they sweep as far as they reach. A negative
                one walks backwards.

        Raises:
            ValueError: the speed or the gait does not fit.
        """
        if abs(checks.number("froude", froude, -1.0, 1.0)) < _LEAST_FROUDE:
            raise ValueError(
                f"froude: expected {_LEAST_FROUDE:g} or more, forwards or backwards, got {checks.preview(froude)}"
            )
        body, gait = task.scene.body, gait_of(task)
        pose = measure_standing(body)  # of the body as it came, for which the task has it at hand
        body = size_body(body)
        speed = gait.pace * froude * math.sqrt(GRAVITY * pose.height)
        # A foot on the ground covers from +reach to -reach while its stance lasts.
        reach = 0.5 * speed * gait.duty_factor / gait.frequency or 1e-6 * pose.height
        counts = [len(leg.joints) for leg in body.legs]
        moves, raised = strokes(task.scene.body, reach), []
        for jacobian, (sweep, lift) in zip(pose.jacobians, moves, strict=True):
            able = np.clip(jacobian[0] @ sweep / reach, 0.0, 1.0)
            raised.append((1.0 - able) * UNLOAD / FOOT_LIFT * lift)
        sweeps, lifts = map(np.concatenate, zip(*moves, strict=True))
        lateral = pose.soles[:, 1] / max(abs(pose.soles[:, 1]).max(), 1e-9)
        return cls(
            pattern=Pattern(
                frequency=gait.frequency,
                duty_factor=gait.duty_factor,
                offset=np.repeat(gait.offsets, counts),
                sweep=sweeps,
                center=np.concatenate(raised),
                stance=np.zeros(len(body.joints)),
                swing=lifts,
            ),
            speed=speed,
            control_timestep=task.scene.control_timestep,
            drive=drive(body, pose.inertias),
            held=pose.loads / (gait.duty_factor * np.array([joint.torque for joint in body.joints])),
            steering=math.copysign(STEERING, speed) * np.repeat(lateral, counts),
        )

    def __call__(self, clock, speed, quaternion, angles, velocities):
        """Return the actions (..., joints) after `clock` (...) control steps, at a speed (...) along world x, m/s."""
        yaw = rotations.yaw(quaternion)[..., None]
        # Turned to the left, legs on the left take longer strides.
        steered = 1.0 + self.steering * yaw.clip(-LARGEST_YAW, LARGEST_YAW)
        if self.drive.reach is None:
            steered = (2.0 - speed / self.speed).clip(*STRETCH)[..., None] * steered
        pattern = self.pattern._replace(sweep=self.pattern.sweep * steered)
        time = self.control_timestep * clock
        onset = (pattern.frequency * time[..., None] / ONSET).clip(max=1.0)
        targets = onset * joint_targets(pattern, time)
        following = onset * joint_targets(pattern, time + self.control_timestep)
        target_velocities = (following - targets) / self.control_timestep
        cycle = (pattern.frequency * time[..., None] + pattern.offset) % 1.0
        held = self.held * (cycle < pattern.duty_factor)
        return self.drive.actions(targets, target_velocities, angles, velocities, held)


class StrideState(NamedTuple):
    """The state of a law by a stride.

    Attributes:
        steps: (environments,) control steps since the start of the episode.
        speed: (environments,) smoothed, along world x, m/s.
    """

    steps: np.ndarray
    speed: np.ndarray


class StrideLaw:
    """The law by a stride, in the gait of a task."""

    reads: tuple[str, ...] = ("posture", "velocities")

    def __init__(self, task: Task, froude: float):
        """Fit a stride; see `Stride.fit`."""
        self.stride = Stride.fit(task, froude)
        cycles = self.stride.pattern.frequency * self.stride.control_timestep
        self.smoothing = min(1.0, cycles / SMOOTHING)

    def initial(self, count: int) -> StrideState:
        """Return the state at the start of episodes in a number of environments."""
        return StrideState(np.zeros(count, int), np.full(count, self.stride.speed))

    def __call__(self, state: StrideState, observation: Mapping) -> tuple:
        """Return the next state and the actions (environments, joints)."""
        speed = state.speed + self.smoothing * (observation["velocities"][..., 0] - state.speed)
        actions = self.stride(state.steps, speed, *proprioception(observation))
        return StrideState(state.steps + 1, speed), actions
