"""The published law of all demonstrators (the paper's Section 5), as pure functions of arrays of NumPy or JAX.

A leg's hip sweeps linearly, back in stance and forth in swing; its other joints add a half-sine
bell to their center. A PD loop turns the distance to these targets into torques. Beyond the paper,
a preset may add feedforward torques: harmonics of the leg's phase, and steering by yaw.

A law of a demonstrator is a pure function `(state, observation) -> (state, actions)`; see `Law`.
"""

from collections.abc import Iterable, Mapping
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np


class Law(Protocol):
    """A law of a demonstrator: a pure function of arrays with a leading axis of environments.

    Attributes:
        preset: parameters that suit any body, an instance of a class of their own, where the law has a name; see
            `arc_suite.register`.
        reads: names of the blocks of the observation that it needs, `posture` and `velocities` among them.
    """

    preset: ClassVar[Any]
    reads: tuple[str, ...]

    def __init__(self, task, preset):
        """Fit the law to a task.

        Args:
            task: of the contract; `task.scene.body` is the body, `cpg.gait.gait_of(task)` the gait.
            preset: parameters, such as `preset` of the class.

        Raises:
            ValueError: the parameters do not fit.
        """

    def initial(self, count: int) -> Any:
        """Return the state at the start of episodes: a NamedTuple of arrays (environments, ...)."""

    def __call__(self, state, observation: Mapping[str, np.ndarray]) -> tuple:
        """Return the next state and the actions (environments, joints) in [-1, 1].

        Args:
            state: before.
            observation: blocks by name, (environments, size) each, float64.
        """


class Pattern(NamedTuple):
    """One preset on one body, per joint: angles in rad, arrays (joints,).

    Attributes:
        frequency: of the cycle, Hz.
        duty_factor: share of the cycle spent in stance.
        offset: of the joint's leg, cycles.
        sweep: hips: half of the sweep, signed so that the foot moves back in stance; else 0.
        center: about which the joint bends; for a hip 0.
        stance: departure from the center in mid-stance.
        swing: departure from the center in mid-swing.
    """

    frequency: float
    duty_factor: float
    offset: np.ndarray
    sweep: np.ndarray
    center: np.ndarray
    stance: np.ndarray
    swing: np.ndarray


def joint_targets(pattern: Pattern, time):
    """Return the target angles (..., joints) at a time (...) in s, in rad."""
    numpy = time.__array_namespace__()
    cycle = (pattern.frequency * time[..., None] + pattern.offset) % 1.0
    duty = pattern.duty_factor
    in_stance = cycle < duty
    progress = numpy.where(in_stance, cycle / duty, (cycle - duty) / (1.0 - duty))
    sweep = numpy.where(in_stance, 1.0 - 2.0 * progress, 2.0 * progress - 1.0)
    bend = numpy.where(in_stance, pattern.stance, pattern.swing)
    return pattern.center + pattern.sweep * sweep + bend * numpy.sin(np.pi * progress)


class Drive(NamedTuple):
    """How actions move the joints of a body: by torques of motors, or by angles that servos hold.

    Attributes:
        stiffness: (joints,) action of a motor per rad, or torque of a servo per rad by its largest.
        damping: (joints,) the same per rad/s.
        reach: (joints,) angles that actions of 1 ask of servos, rad; None for motors.
    """

    stiffness: np.ndarray
    damping: np.ndarray
    reach: np.ndarray | None = None

    def actions(self, targets, speeds, angles, velocities, feedforward=0.0):
        """Return the actions (..., joints) in [-1, 1] by which joints follow targets.

        Args:
            targets: (..., joints) rad.
            speeds: (..., joints) of the targets, rad/s.
            angles: (..., joints) of the joints, rad.
            velocities: (..., joints) of the joints, rad/s.
            feedforward: (..., joints) torques that are added, shares of the largest.
        """
        if self.reach is None:
            return torques(targets, angles, velocities - speeds, self.stiffness, self.damping, feedforward)
        # The servo damps the joint's own velocity: its angle is further on by what the target's velocity lacks.
        ahead = (self.damping * speeds + feedforward) / self.stiffness
        return ((targets + ahead) / self.reach).clip(-1.0, 1.0)


def torques(targets, angles, velocities, stiffness, damping, feedforward=0.0):
    """Return actions (..., joints) in [-1, 1] that pull angles (rad) to their targets against velocities (rad/s).

    Args:
        targets: (..., joints) rad.
        angles: (..., joints) rad.
        velocities: (..., joints) rad/s.
        stiffness: action per rad.
        damping: action per rad/s.
        feedforward: (..., joints) actions that are added, whatever the error is.
    """
    return (stiffness * (targets - angles) - damping * velocities + feedforward).clip(-1.0, 1.0)


class Feedforward(NamedTuple):
    """Actions that a preset adds whatever the error is, per joint.

    Attributes:
        cosines: (joints, harmonics) of the leg's phase and its multiples.
        sines: the same.
        steering: (joints,) per rad of yaw, times the cosine of the leg's phase.
    """

    cosines: np.ndarray
    sines: np.ndarray
    steering: np.ndarray

    def __call__(self, pattern: Pattern, time, yaw):
        """Return the actions (..., joints) at a time (...) in s, with the torso turned by a yaw (...), rad."""
        numpy = yaw.__array_namespace__()
        phase = 2.0 * np.pi * (pattern.frequency * time[..., None] + pattern.offset)
        multiples = phase[..., None] * np.arange(1, 1 + self.cosines.shape[-1])
        waves = (self.cosines * numpy.cos(multiples) + self.sines * numpy.sin(multiples)).sum(axis=-1)
        return waves + self.steering * yaw[..., None] * numpy.cos(phase)


class Clock(NamedTuple):
    """The state of a law with a clock of its own.

    Attributes:
        steps: (environments,) control steps since the start of the episode.
    """

    steps: np.ndarray


class Clocked:
    """A law with a clock of its own."""

    reads: tuple[str, ...] = ("posture", "velocities")

    def __init__(self, control):
        """Take a function of control steps (...), quaternion (..., 4), joint angles and velocities (..., joints)."""
        self.control = control

    def initial(self, count: int) -> Clock:
        """Return the state at the start of episodes in a number of environments."""
        return Clock(np.zeros(count, int))

    def __call__(self, state: Clock, observation: Mapping) -> tuple:
        """Return the next state and the actions (environments, joints)."""
        return Clock(state.steps + 1), self.control(state.steps, *proprioception(observation))


def restart_where(state, initial, mask):
    """Return a state, an array or a NamedTuple of states, that is `initial` where a mask (environments,) holds."""
    if isinstance(state, tuple):
        return type(state)(*(restart_where(*fields, mask) for fields in zip(state, initial, strict=True)))
    return mask.__array_namespace__().where(mask.reshape(-1, *[1] * (state.ndim - 1)), initial, state)


def proprioception(observation: Mapping) -> tuple:
    """Return the torso's quaternion (..., 4), joint angles and joint velocities (..., joints) of named blocks."""
    posture, velocities = observation["posture"], observation["velocities"]
    return posture[..., 1:5], posture[..., 5:], velocities[..., 6:]


# A task that has a block, which an error names.
_EXAMPLES = {"scan": "rough", "goal": "navigate", "ranges": "navigate"}


def read_blocks(observation, names: Iterable[str], joints: int, parts: int | None = None) -> dict[str, np.ndarray]:
    """Return blocks of an observation as float64.

    Args:
        observation: blocks by name, each (..., size).
        names: of the blocks; `posture` and `velocities` among them.
        joints: of the body.
        parts: rigid bodies of the body, to compare with contact forces where those are observed; None to
            compare nothing.

    Raises:
        ValueError: not named blocks, one is missing, or those of a body with another number of joints or
            parts.
    """
    if not (isinstance(observation, Mapping) and {"posture", "velocities"} <= observation.keys()):
        raise ValueError(
            "observation: expected blocks posture and velocities by name, as `split` of a task gives them, "
            f"got {type(observation).__name__}"
        )
    sizes = np.shape(observation["posture"])[-1] - 5, np.shape(observation["velocities"])[-1] - 6
    if sizes != (joints, joints):
        found = f"{sizes[0]} angles and {sizes[1]} velocities"
        raise ValueError(f"observation: expected those of {joints} joints, got {found}")
    forces = np.shape(observation.get("contact_forces"))
    if parts is not None and forces and forces[-1] != 6 * parts:
        raise ValueError(f"observation: expected contact forces of {parts} rigid bodies, got {forces[-1] / 6:g}")
    for name in names:
        if name not in observation:
            raise ValueError(f"observation: expected a block {name}, as the task {_EXAMPLES.get(name, 'steer')} has")
    return {name: np.asarray(observation[name], dtype=float) for name in names}
