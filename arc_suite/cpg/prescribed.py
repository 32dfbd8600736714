"""The published law by a preset: joints sweep and bend by angles in degrees, in the preset's own cycle."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple, Self

import numpy as np

from arc_suite import rotations
from arc_suite.cpg.gait import gait_of
from arc_suite.cpg.law import Clocked, Feedforward, Pattern, joint_targets, torques
from arc_suite.models.sizing import control_timestep
from arc_suite.robots.spec import Body
from arc_suite.tasks.contract import Task

# An angle in degrees for all legs, or one for each rank: front, (middle,) rear.
ByRank = float | tuple[float, ...]


class Bend(NamedTuple):
    """How far a joint departs from its center in mid-stance and in mid-swing, degrees."""

    stance: ByRank
    swing: ByRank


class Preset(NamedTuple):
    """One way to walk.

    Attributes:
        stiffness: action per rad of error (kp).
        damping: action per rad/s (kd).
        settle: number of control steps at the start in which the robot crouches.
        ramp: control steps over which the stiffness grows linearly to its full value.
        ramp_start: share of the stiffness at the first step.
        frequency: frequency of the cycle, Hz.
        duty_factor: share of the cycle in stance.
        phase_offsets: phase offsets of the legs, cycles.
        sweep: half of the hip's sweep, degrees.
        center: angles about which joints move, degrees, by joint; a hip's is positive forwards, and 0 by default.
        bends: bends of the other joints, by name.
        crouch: angles of the crouch, as `center`; None for the center. Legs drawn up catch a robot that a reset
            with its feet in the ground has thrown.
        torques: actions that are added to those of the PD control, by joint and for each rank: amplitudes of the
            cosines of the leg's phase and its multiples, then of their sines; a hip's are positive forwards. None for
            no such actions.
        steering: action of the hips per rad of yaw, times the cosine of the leg's phase. It has the same sign left
            and right: a negative value turns the robot back to its first heading.
    """

    stiffness: float
    damping: float
    settle: int
    ramp: float
    ramp_start: float
    frequency: float
    duty_factor: float
    phase_offsets: tuple[float, ...]
    sweep: ByRank
    center: Mapping[str, ByRank]
    bends: Mapping[str, Bend]
    crouch: Mapping[str, ByRank] | None = None
    torques: Mapping[str, tuple[tuple[float, ...], ...]] | None = None
    steering: float = 0.0


class Prescribed(NamedTuple):
    """Control by a preset's numbers: of one simulation, or with leading axes (environments, 1) of a batch.

    Attributes:
        pattern: pattern of the joints.
        feedforward: actions that are added to those of the PD control; None for none.
        crouch: (joints,) angles of the crouch, rad.
        control_timestep: s.
        stiffness, damping, settle, ramp, ramp_start: as in `Preset`.
    """

    pattern: Pattern
    feedforward: Feedforward | None
    crouch: np.ndarray
    control_timestep: float | np.ndarray
    stiffness: float | np.ndarray
    damping: float | np.ndarray
    settle: int | np.ndarray
    ramp: float | np.ndarray
    ramp_start: float | np.ndarray

    @classmethod
    def fit(cls, body: Body, preset: Preset) -> Self:
        """Return the control of a body by a preset.

        Raises:
            ValueError: the preset does not fit the body.
        """
        if body.source:
            raise ValueError(
                f"preset: gives torques, and {body.name} has servos, expected one such as medium or steered"
            )
        legs = len(body.legs)
        offsets = len(preset.phase_offsets)
        if legs != offsets:
            raise ValueError(f"preset: {body.name} has {legs} legs, and phase_offsets is for {offsets}")
        try:
            pattern = lay_out_pattern(body, preset)
            feedforward = lay_out_feedforward(body, preset)
            crouch = pattern.center
            if preset.crouch:
                crouch = lay_out_pattern(body, preset._replace(center=preset.crouch)).center
        except (AttributeError, LookupError, TypeError, ValueError) as error:
            raise ValueError(f"preset: does not fit {body.name}: {type(error).__name__}: {error}") from None
        return cls(
            pattern=pattern,
            feedforward=feedforward,
            crouch=crouch,
            control_timestep=control_timestep(body),
            stiffness=preset.stiffness,
            damping=preset.damping,
            settle=preset.settle,
            ramp=preset.ramp,
            ramp_start=preset.ramp_start,
        )

    @classmethod
    def stack(cls, controls: Sequence[Self]) -> Self:
        """Return several controls of one body as the control of a batch, with an environment for each."""

        def stack_values(values):
            return np.stack([np.atleast_1d(value) for value in values])

        patterns, feedforwards, *numbers = zip(*controls, strict=True)  # values of each field
        pattern = Pattern(*map(stack_values, zip(*patterns, strict=True)))
        feedforward = None
        first_feedforward = next((value for value in feedforwards if value is not None), None)
        if first_feedforward is not None:
            zeros = Feedforward(*map(np.zeros_like, first_feedforward))
            complete_feedforwards = [zeros if value is None else value for value in feedforwards]
            feedforward = Feedforward(*map(stack_values, zip(*complete_feedforwards, strict=True)))
        return cls(pattern, feedforward, *map(stack_values, numbers))

    def __call__(self, clock, quaternion, angles, velocities):
        """Return the actions (..., joints) after `clock` (...) control steps; few presets read the quaternion."""
        xp = clock.__array_namespace__()
        steps = clock[..., None]
        time = (self.control_timestep * steps)[..., 0]
        targets = xp.where(steps < self.settle, self.crouch, joint_targets(self.pattern, time))
        ramp = (self.ramp_start + (1.0 - self.ramp_start) * steps / self.ramp).clip(max=1.0)
        feedforward = 0.0
        if self.feedforward is not None:
            feedforward = self.feedforward(self.pattern, time, rotations.yaw(quaternion))
        return torques(targets, angles, velocities, ramp * self.stiffness, self.damping, feedforward)


class PrescribedLaw(Clocked):
    """The law by a preset, at the frequency and target velocity of a task.

    A preset's numbers are for walk with default settings. Its frequency and sweep scale with those of the task.
    Duty factor and offsets stay: a preset that was searched for in another gait walks at a fifth of the speed, and has
    a lower return; see docs/demonstrators.md.
    """

    def __init__(self, task: Task, preset: Preset):
        """Fit a preset to a task.

        Raises:
            ValueError: the preset does not fit the body.
        """
        gait = gait_of(task)
        control = Prescribed.fit(task.scene.body, preset)
        pattern = control.pattern._replace(
            frequency=gait.tempo * control.pattern.frequency, sweep=gait.pace * control.pattern.sweep
        )
        super().__init__(control._replace(pattern=pattern, control_timestep=task.scene.control_timestep))


def lay_out_pattern(body: Body, preset: Preset) -> Pattern:
    """Return the pattern of a body's joints by a preset."""

    def radians(angle: ByRank, rank: int) -> float:
        return math.radians(angle[rank] if isinstance(angle, tuple) else angle)

    rows = []  # offset, sweep, center, stance, swing of each joint
    for leg, rank, offset in zip(body.legs, body.ranks, preset.phase_offsets, strict=True):
        forward_sign = -1.0 if leg.side == "left" else 1.0  # of a hip's angle
        for joint in leg.joints:
            if joint.name == "hip":
                sweep = forward_sign * radians(preset.sweep, rank)
                center = forward_sign * radians(preset.center.get("hip", 0.0), rank)
                rows.append((offset, sweep, center, 0.0, 0.0))
            else:
                center = radians(preset.center[joint.name], rank)
                bend = preset.bends[joint.name]
                rows.append((offset, 0.0, center, radians(bend.stance, rank), radians(bend.swing, rank)))
    offsets, sweeps, centers, stances, swings = np.array(rows).T
    return Pattern(preset.frequency, preset.duty_factor, offsets, sweeps, centers, stances, swings)


def lay_out_feedforward(body: Body, preset: Preset) -> Feedforward | None:
    """Return the actions that a preset adds to those of the PD control, by a body's joints; None for none."""
    if preset.torques is None and not preset.steering:
        return None
    amplitudes = []  # of cosines, then of sines, of each joint
    steering = []
    for leg, rank in zip(body.legs, body.ranks, strict=True):
        for joint in leg.joints:
            is_hip = joint.name == "hip"
            sign = -1.0 if is_hip and leg.side == "left" else 1.0
            amplitudes.append(sign * np.array(preset.torques[joint.name][rank]) if preset.torques else (0.0, 0.0))
            steering.append(preset.steering if is_hip else 0.0)
    cosines, sines = np.split(np.array(amplitudes), 2, axis=-1)
    return Feedforward(cosines, sines, np.array(steering))
