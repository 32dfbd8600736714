"""The published law by a preset: joints bend and sweep by angles in degrees, about a cycle of the preset's own."""

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
        settle: first control steps, in which the robot crouches.
        ramp: control steps over which the stiffness grows linearly to its full value.
        ramp_start: share of the stiffness at the first step.
        frequency: of the cycle, Hz.
        duty_factor: share of the cycle spent in stance.
        phase_offsets: of the legs, cycles.
        sweep: half of the hip's sweep, degrees.
        center: angles about which joints move, degrees, by joint; a hip's is positive forwards and
            0 if it is not there.
        bends: of the other joints, by name.
        crouch: angles held while settling, as `center`; None for the center. Legs drawn up catch a
            robot that a reset with its feet in the ground has thrown.
        torques: actions that are added whatever the error is, by joint and for each rank: amplitudes of
            the cosines of the leg's phase and its multiples, then of their sines; a hip's positive
            forwards. None for none.
        steering: action of the hips per rad of yaw, times the cosine of the leg's phase; the same sign
            left and right, so that a negative one turns back to where the robot started.
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
        pattern: of the joints.
        feedforward: added to the PD loop's actions; None for nothing.
        crouch: (joints,) angles held while settling, rad.
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
        """Return a preset, laid out over a body's joints.

        Raises:
            ValueError: it does not fit the body.
        """
        if body.source:
            raise ValueError(
                f"preset: gives torques, and {body.name} has servos, expected one such as medium or steered"
            )
        legs, offsets = len(body.legs), len(preset.phase_offsets)
        if legs != offsets:
            raise ValueError(f"preset: {body.name} has {legs} legs, and phase_offsets is for {offsets}")
        try:
            laid, added = lay_out_pattern(body, preset), lay_out_feedforward(body, preset)
            crouch = (
                lay_out_pattern(body, preset._replace(center=preset.crouch)).center if preset.crouch else laid.center
            )
        except (AttributeError, LookupError, TypeError, ValueError) as error:
            raise ValueError(f"preset: does not fit {body.name}: {type(error).__name__}: {error}") from None
        return cls(laid, added, crouch, control_timestep(body), *(getattr(preset, name) for name in cls._fields[4:]))

    @classmethod
    def stack(cls, controls: Sequence[Self]) -> Self:
        """Return several controls of one body as one, of a batch with an environment for each."""

        def stack_values(values):
            return np.stack([np.atleast_1d(value) for value in values])

        patterns, feedforwards, *numbers = zip(*controls, strict=True)
        added = next(filter(None, feedforwards), None)
        if added is not None:
            none = Feedforward(*map(np.zeros_like, added))
            added = Feedforward(*map(stack_values, zip(*(each or none for each in feedforwards), strict=True)))
        return cls(Pattern(*map(stack_values, zip(*patterns, strict=True))), added, *map(stack_values, numbers))

    def __call__(self, clock, quaternion, angles, velocities):
        """Return the actions (..., joints) after `clock` (...) control steps; few presets read the quaternion."""
        numpy, steps = clock.__array_namespace__(), clock[..., None]
        time = (self.control_timestep * steps)[..., 0]
        walking = joint_targets(self.pattern, time)
        targets = numpy.where(steps < self.settle, self.crouch, walking)
        ramp = (self.ramp_start + (1.0 - self.ramp_start) * steps / self.ramp).clip(max=1.0)
        added = 0.0 if self.feedforward is None else self.feedforward(self.pattern, time, rotations.yaw(quaternion))
        return torques(targets, angles, velocities, ramp * self.stiffness, self.damping, added)


class PrescribedLaw(Clocked):
    """The law by a preset, at the frequency and target velocity of a task.

    A preset's numbers are for walk with default settings. Its frequency and sweep scale with those of the task,
    but duty factor and offsets stay: a preset that was searched for in another gait walks at a fifth of the speed,
    and earns less; see docs/demonstrators.md.
    """

    def __init__(self, task: Task, preset: Preset):
        """Fit a preset to a task.

        Raises:
            ValueError: the preset does not fit the body.
        """
        gait, control = gait_of(task), Prescribed.fit(task.scene.body, preset)
        laid = control.pattern
        laid = laid._replace(frequency=gait.tempo * laid.frequency, sweep=gait.pace * laid.sweep)
        super().__init__(control._replace(pattern=laid, control_timestep=task.scene.control_timestep))


def lay_out_pattern(body: Body, preset: Preset) -> Pattern:
    """Return a preset, laid out over a body's joints."""

    def by_rank(angle: ByRank, rank: int) -> float:
        return math.radians(angle[rank] if isinstance(angle, tuple) else angle)

    rows = []
    for leg, rank, offset in zip(body.legs, body.ranks, preset.phase_offsets, strict=True):
        forwards = -1.0 if leg.side == "left" else 1.0
        for joint in leg.joints:
            if joint.name == "hip":
                angles = (preset.sweep, preset.center.get("hip", 0.0))
                rows.append((offset, *(forwards * by_rank(angle, rank) for angle in angles), 0.0, 0.0))
            else:
                bend = preset.bends[joint.name]
                angles = (preset.center[joint.name], bend.stance, bend.swing)
                rows.append((offset, 0.0, *(by_rank(angle, rank) for angle in angles)))
    return Pattern(preset.frequency, preset.duty_factor, *np.array(rows).T)


def lay_out_feedforward(body: Body, preset: Preset) -> Feedforward | None:
    """Return the torques that a preset adds to the PD loop's, laid out over a body's joints; None for none."""
    if preset.torques is None and not preset.steering:
        return None
    amplitudes, steering = [], []
    for leg, rank in zip(body.legs, body.ranks, strict=True):
        for joint in leg.joints:
            hip = joint.name == "hip"
            sign = -1.0 if hip and leg.side == "left" else 1.0
            amplitudes.append(sign * np.array(preset.torques[joint.name][rank]) if preset.torques else (0.0, 0.0))
            steering.append(preset.steering if hip else 0.0)
    cosines, sines = np.split(np.array(amplitudes), 2, axis=-1)
    return Feedforward(cosines, sines, np.array(steering))
