"""The published law of all demonstrators (the paper's Section 5), as pure functions of arrays of NumPy or JAX.

A leg's hip sweeps linearly, back in stance and forth in swing; its other joints add a half-sine
bell to their center. A PD loop turns the distance to these targets into torques. Beyond the paper,
a preset may add feedforward torques: harmonics of the leg's phase, and steering by yaw.

A law of a demonstrator is a pure function `(state, observation) -> (state, actions)`; see `Law`.
"""

from collections.abc import Container, Iterable, Mapping
from typing import Any, NamedTuple, Protocol

import numpy as np


class Law(Protocol):
    """A law of a demonstrator: a pure function of arrays with a leading axis of environments.

    Attributes:
        preset: parameters that suit any body, an instance of a class of their own, where the law has a name; see
            `arc_suite.register`.
        reads: names of the blocks of the observation that it needs, `posture` and `velocities` among them.
    """

    @property
    def preset(self) -> Any: ...
    @property
    def reads(self) -> tuple[str, ...]: ...

    def __init__(self, task, preset):
        """Fit the law to a task.

        Args:
            task: task of the contract; `task.scene.body` is the body, `cpg.gait.gait_of(task)` the gait.
            preset: parameters, such as `preset` of the class.

        Raises:
            ValueError: the parameters do not fit the task.
        """

    def initial(self, count: int) -> Any:
        """Return the state at the start of episodes: a NamedTuple of arrays (environments, ...)."""

    def __call__(self, state, observation: Mapping[str, np.ndarray]) -> tuple:
        """Return the next state and the actions (environments, joints) in [-1, 1].

        Args:
            state: state before the control step.
            observation: blocks by name, (environments, size) each, float64.
        """


class Pattern(NamedTuple):
    """One preset on one body, per joint: angles in rad, arrays (joints,).

    Attributes:
        frequency: frequency of the cycle, Hz.
        duty_factor: share of the cycle in stance.
        offset: phase offset of the joint's leg, cycles.
        sweep: half of a hip's sweep, signed so that the foot moves back in stance; 0 for other joints.
        center: angle about which the joint moves.
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
    xp = time.__array_namespace__()
    phase = (pattern.frequency * time[..., None] + pattern.offset) % 1.0  # cycles
    duty = pattern.duty_factor
    in_stance = phase < duty
    progress = xp.where(in_stance, phase / duty, (phase - duty) / (1.0 - duty))  # of stance or swing, from 0 to 1
    sweep_share = xp.where(in_stance, 1.0 - 2.0 * progress, 2.0 * progress - 1.0)  # back in stance, forth in swing
    bend = xp.where(in_stance, pattern.stance, pattern.swing)
    return pattern.center + pattern.sweep * sweep_share + bend * xp.sin(np.pi * progress)


class Drive(NamedTuple):
    """Actuators of a body: motors, whose actions are torques, or servos, whose actions are angles.

    Attributes:
        stiffness: (joints,) action of a motor per rad, or share of a servo's largest torque per rad.
        damping: (joints,) the same per rad/s.
        reach: (joints,) target angles of servos for actions of 1, rad; None for motors.
    """

    stiffness: np.ndarray
    damping: np.ndarray
    reach: np.ndarray | None = None

    def stiffen(self, multiple: float) -> "Drive":
        """Return the drive with a multiple of the stiffness; critical damping stays critical."""
        return self._replace(stiffness=multiple * self.stiffness, damping=np.sqrt(multiple) * self.damping)

    def actions(self, targets, speeds, angles, velocities, feedforward=0.0):
        """Return the actions (..., joints) in [-1, 1] by which joints follow targets.

        Args:
            targets: (..., joints) target angles, rad.
            speeds: (..., joints) velocities of the targets, rad/s.
            angles: (..., joints) angles of the joints, rad.
            velocities: (..., joints) velocities of the joints, rad/s.
            feedforward: (..., joints) torques that are added, shares of the largest.
        """
        if self.reach is None:
            return torques(targets, angles, velocities - speeds, self.stiffness, self.damping, feedforward)
        # A servo damps the joint's velocity, not the difference from the target's. An angle further ahead makes up
        # for that, and for the feedforward, which a servo does not take.
        compensation = (self.damping * speeds + feedforward) / self.stiffness
        return ((targets + compensation) / self.reach).clip(-1.0, 1.0)


def torques(targets, angles, velocities, stiffness, damping, feedforward=0.0):
    """Return the actions (..., joints) in [-1, 1] of proportional and derivative (PD) control.

    Args:
        targets: (..., joints) target angles, rad.
        angles: (..., joints) rad.
        velocities: (..., joints) rad/s; the control damps them.
        stiffness: action per rad.
        damping: action per rad/s.
        feedforward: (..., joints) actions that are added.
    """
    return (stiffness * (targets - angles) - damping * velocities + feedforward).clip(-1.0, 1.0)


class Feedforward(NamedTuple):
    """Actions of joints that a preset adds to those of the PD control.

    Attributes:
        cosines: (joints, harmonics) amplitudes of the cosines of the leg's phase and its multiples.
        sines: (joints, harmonics) amplitudes of the sines.
        steering: (joints,) action per rad of yaw, times the cosine of the leg's phase.
    """

    cosines: np.ndarray
    sines: np.ndarray
    steering: np.ndarray

    def __call__(self, pattern: Pattern, time, yaw):
        """Return the actions (..., joints) at a time (...) in s, with the torso turned by a yaw (...), rad."""
        xp = yaw.__array_namespace__()
        phase = 2.0 * np.pi * (pattern.frequency * time[..., None] + pattern.offset)  # rad
        harmonics = np.arange(1, 1 + self.cosines.shape[-1])
        multiples = phase[..., None] * harmonics  # (..., joints, harmonics)
        waves = (self.cosines * xp.cos(multiples) + self.sines * xp.sin(multiples)).sum(axis=-1)
        return waves + self.steering * yaw[..., None] * xp.cos(phase)


class Clock(NamedTuple):
    """The state of a `Clocked` law.

    Attributes:
        steps: (environments,) control steps since the start of the episode.
    """

    steps: np.ndarray


class Clocked:
    """A law with its own clock: it counts control steps."""

    reads: tuple[str, ...] = ("posture", "velocities")

    def __init__(self, control):
        """Set the function that returns actions (..., joints).

        Args:
            control: function of the number of control steps (...), the torso's quaternion (..., 4), and the angles and
                velocities of joints (..., joints).
        """
        self.control = control

    def initial(self, count: int) -> Clock:
        """Return the state at the start of episodes in a number of environments."""
        return Clock(np.zeros(count, int))

    def __call__(self, state: Clock, observation: Mapping) -> tuple:
        """Return the next state and the actions (environments, joints)."""
        quaternion, angles, velocities = proprioception(observation)
        return Clock(state.steps + 1), self.control(state.steps, quaternion, angles, velocities)


def restart_where(state, initial, mask):
    """Return a state with the environments of a mask replaced by those of an initial state.

    Args:
        state: an array (environments, ...), or a NamedTuple of states.
        initial: state of the same structure.
        mask: (environments,).
    """
    if isinstance(state, tuple):
        fields = [restart_where(field, start, mask) for field, start in zip(state, initial, strict=True)]
        return type(state)(*fields)
    xp = mask.__array_namespace__()
    extra_axes = [1] * (state.ndim - 1)
    return xp.where(mask.reshape(-1, *extra_axes), initial, state)


def proprioception(observation: Mapping) -> tuple:
    """Return the torso's quaternion (..., 4), joint angles and joint velocities (..., joints) of named blocks."""
    posture = observation["posture"]
    velocities = observation["velocities"]
    return posture[..., 1:5], posture[..., 5:], velocities[..., 6:]


# By block, a task that has it; errors name it.
_EXAMPLES = {"scan": "rough", "goal": "navigate", "ranges": "navigate"}


def read_blocks(observation, names: Iterable[str], joints: int, parts: int | None = None) -> dict[str, np.ndarray]:
    """Return blocks of an observation as float64.

    Args:
        observation: blocks by name, each (..., size).
        names: names of the blocks; they include `posture` and `velocities`.
        joints: number of the body's joints.
        parts: number of the body's rigid bodies, to compare with observed contact forces; None for no comparison.

    Raises:
        ValueError: an observation without named blocks, without one of `names`, or of a body with another number of
            joints or parts.
    """
    if not (isinstance(observation, Mapping) and {"posture", "velocities"} <= observation.keys()):
        raise ValueError(
            "observation: expected blocks posture and velocities by name, as `split` of a task gives them, "
            f"got {type(observation).__name__}"
        )
    angle_count = np.shape(observation["posture"])[-1] - 5
    velocity_count = np.shape(observation["velocities"])[-1] - 6
    if angle_count != joints or velocity_count != joints:
        sizes = f"{angle_count} angles and {velocity_count} velocities"
        raise ValueError(f"observation: expected those of {joints} joints, got {sizes}")
    forces_shape = np.shape(observation.get("contact_forces"))
    if parts is not None and forces_shape and forces_shape[-1] != 6 * parts:
        forces = f"{forces_shape[-1] / 6:g}"
        raise ValueError(f"observation: expected contact forces of {parts} rigid bodies, got {forces}")
    check_blocks(observation, names)
    return {name: np.asarray(observation[name], dtype=float) for name in names}


def check_blocks(blocks: Container[str], names: Iterable[str]) -> None:
    """Check that the names of an observation's blocks include `names`.

    Raises:
        ValueError: a name is missing.
    """
    missing_names = [name for name in names if name not in blocks]
    if missing_names:
        name = max(missing_names, key=lambda name: name in _EXAMPLES)  # its task has commands, too
        example = _EXAMPLES.get(name, "steer")
        raise ValueError(f"observation: expected a block {name}, as the task {example} has (--task {example})")
