"""The one law of all demonstrators (the paper's Section 5), as pure functions of arrays.

A leg's hip sweeps linearly, back in stance and forth in swing; its other joints add a half-sine
bell to their centre. A PD loop turns the distance to these targets into torques. Beyond the paper,
a preset may add torques ahead of any error: harmonics of the leg's phase, and steering by yaw.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np


class Pattern(NamedTuple):
    """One preset on one body, per joint: angles in rad, arrays (joints,).

    Attributes:
        frequency: of the cycle, Hz.
        duty_factor: share of the cycle spent in stance.
        offset: of the joint's leg, cycles.
        sweep: hips: half of the sweep, signed so that the foot moves back in stance; else 0.
        centre: about which the joint bends; for a hip 0.
        stance: departure from the centre in mid-stance.
        swing: departure from the centre in mid-swing.
    """

    frequency: float
    duty_factor: float
    offset: np.ndarray
    sweep: np.ndarray
    centre: np.ndarray
    stance: np.ndarray
    swing: np.ndarray


def joint_targets(pattern: Pattern, time) -> np.ndarray:
    """Return the joint angles (..., joints) wanted at a time (...) in s, in rad."""
    cycle = (pattern.frequency * time[..., None] + pattern.offset) % 1.0
    duty = pattern.duty_factor
    in_stance = cycle < duty
    progress = np.where(in_stance, cycle / duty, (cycle - duty) / (1.0 - duty))
    sweep = np.where(in_stance, 1.0 - 2.0 * progress, 2.0 * progress - 1.0)
    bend = np.where(in_stance, pattern.stance, pattern.swing)
    return pattern.centre + pattern.sweep * sweep + bend * np.sin(np.pi * progress)


def torques(targets, angles, velocities, stiffness, damping, ahead=0.0) -> np.ndarray:
    """Return actions (..., joints) in [-1, 1] that pull angles (rad) to their targets against velocities (rad/s).

    Args:
        targets: (..., joints) rad.
        angles: (..., joints) rad.
        velocities: (..., joints) rad/s.
        stiffness: action per rad.
        damping: action per rad/s.
        ahead: (..., joints) actions that are added, whatever the error is.
    """
    return (stiffness * (targets - angles) - damping * velocities + ahead).clip(-1.0, 1.0)


class Ahead(NamedTuple):
    """Actions that a preset adds whatever the error is, per joint.

    Attributes:
        cosines: (joints, harmonics) of the leg's phase and its multiples.
        sines: the same.
        steering: (joints,) per rad of yaw, times the cosine of the leg's phase.
    """

    cosines: np.ndarray
    sines: np.ndarray
    steering: np.ndarray

    def __call__(self, pattern: Pattern, time, yaw) -> np.ndarray:
        """Return the actions (..., joints) at a time (...) in s, with the torso turned by a yaw (...), rad."""
        phase = 2.0 * np.pi * (pattern.frequency * time[..., None] + pattern.offset)
        multiples = phase[..., None] * np.arange(1, 1 + self.cosines.shape[-1])
        waves = (self.cosines * np.cos(multiples) + self.sines * np.sin(multiples)).sum(axis=-1)
        return waves + self.steering * yaw[..., None] * np.cos(phase)


def felt(
    observation: Mapping[str, np.ndarray], joints: int, parts: int | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return what a demonstrator feels of named blocks: the torso's quaternion, joint angles and joint velocities.

    Args:
        observation: blocks by name, each (..., size).
        joints: of the body.
        parts: rigid bodies of the body, to compare with contact forces where those are observed; None to
            compare nothing.

    Raises:
        ValueError: not named blocks, or those of a body with another number of joints or parts; one line.
    """
    if not (isinstance(observation, Mapping) and {"posture", "velocities"} <= observation.keys()):
        raise ValueError(
            "observation: expected blocks posture and velocities by name, as `split` of a task gives them, "
            f"got {type(observation).__name__}"
        )
    posture, velocities = (np.asarray(observation[name], dtype=float) for name in ("posture", "velocities"))
    quaternion, angles, speeds = posture[..., 1:5], posture[..., 5:], velocities[..., 6:]
    if (angles.shape[-1], speeds.shape[-1]) != (joints, joints):
        found = f"{angles.shape[-1]} angles and {speeds.shape[-1]} velocities"
        raise ValueError(f"observation: expected those of {joints} joints, got {found}")
    forces = np.shape(observation.get("contact_forces"))
    if parts is not None and forces and forces[-1] != 6 * parts:
        raise ValueError(f"observation: expected contact forces of {parts} rigid bodies, got {forces[-1] / 6:g}")
    return quaternion, angles, speeds


def blocks(observation: Mapping[str, np.ndarray], task: str, *names: str) -> tuple[np.ndarray, ...]:
    """Return named blocks of an observation, (..., size) float64 each.

    Args:
        observation: blocks by name, each (..., size).
        task: one that has them, which an error names.
        names: of the blocks.

    Raises:
        ValueError: one of them is missing; one line.
    """
    for name in names:
        if name not in observation:
            raise ValueError(f"observation: expected a block {name}, as the task {task} has")
    return tuple(np.asarray(observation[name], dtype=float) for name in names)
