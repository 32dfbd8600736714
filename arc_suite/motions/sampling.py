"""Other rates of motions, loops over several cycles, and velocities."""

from typing import NamedTuple

import numpy as np

from arc_suite import checks, rotations
from arc_suite.motions.ground_poses import compose, place_points, relative_pose
from arc_suite.motions.motion import Motion

_MIN_RATE = 1e-9  # Hz: any above 0


class Velocities(NamedTuple):
    """Velocities in the frames of a motion, by central differences; in the simulation's convention.

    Attributes:
        linear: (frames, 3) of the torso in the world, m/s.
        angular: (frames, 3) of the torso in its own frame, rad/s.
        joints: (frames, joints) rad/s.
    """

    linear: np.ndarray
    angular: np.ndarray
    joints: np.ndarray


def resample(motion: Motion, rate: float) -> Motion:
    """Return a motion with frames at another rate, such as that of control steps.

    A motion lasts a whole number of frames; its duration changes by up to half a frame. Positions, angles and
    quaternions are cubic between frames, and go through them.

    Args:
        motion: the motion.
        rate: Hz.

    Raises:
        ValueError: a rate that is not above 0.
    """
    checks.number("rate", rate, _MIN_RATE)
    frames = max(1, round(motion.seconds * rate)) + 1
    places = np.linspace(0.0, motion.frames - 1, frames)  # in frames of the motion
    longer = repeat(motion, -1, motion.frames + 1)
    previous = np.minimum(places.astype(int), motion.frames - 2)
    share = places - previous

    def interpolate(values):
        return _interpolate(values, previous + 1, share)

    quaternions = interpolate(longer.quaternions)
    return motion._replace(
        frame_rate=float(rate),
        positions=interpolate(longer.positions),
        quaternions=quaternions / np.linalg.norm(quaternions, axis=-1, keepdims=True),
        angles=interpolate(longer.angles),
        planted=motion.planted[np.rint(places).astype(int)],
        soles=interpolate(longer.soles),
    )


def repeat(motion: Motion, first: int, stop: int) -> Motion:
    """Return the frames from `first` to `stop`, exclusive, which may lie before or behind the motion.

    A loop goes on over the ground, cycle after cycle. Another motion holds its first and last frames.

    Args:
        motion: the motion.
        first: index of the first frame; it may be negative.
        stop: index of the frame behind the last.

    Raises:
        ValueError: no frame lies between them.
    """
    checks.integer("stop", stop, first + 1)
    indices = np.arange(first, stop)
    last = motion.frames - 1
    if not motion.loops:
        return _select(motion, indices.clip(0, last))
    cycles = indices // last
    starts = {0: np.zeros(3)}  # ground poses in which cycles begin
    for cycle in range(1, cycles.max(initial=0) + 1):
        starts[cycle] = compose(starts[cycle - 1], motion.displacement)
    back = relative_pose(motion.displacement, np.zeros(3))
    for cycle in range(-1, cycles.min(initial=0) - 1, -1):
        starts[cycle] = compose(starts[cycle + 1], back)
    start = np.array([starts[cycle] for cycle in cycles.tolist()])
    frames = _select(motion, indices % last)
    start_of_soles = start[:, None] / (motion.standing_height, motion.standing_height, 1.0)
    return frames._replace(
        positions=place_points(start, frames.positions),
        quaternions=rotations.turn_about_z(frames.quaternions, start[:, 2]) * _signs_of_cycles(motion, cycles)[:, None],
        soles=place_points(start_of_soles, frames.soles),
    )


def _signs_of_cycles(motion: Motion, cycles: np.ndarray) -> np.ndarray:
    """Return the signs (n,) of quaternions in cycles (n,) of a loop, with which they do not jump between cycles.

    They alternate if the torso turns over once in a cycle: then its quaternion comes back as the negative one.
    """
    first_of_next = rotations.turn_about_z(motion.quaternions[0], motion.displacement[2])
    turns_over = first_of_next @ motion.quaternions[-1] < 0.0
    return np.where(turns_over & (cycles % 2 == 1), -1.0, 1.0)


def velocities(motion: Motion) -> Velocities:
    """Return the velocities of a motion in its frames. A loop moves through its ends; another one starts at rest."""
    longer = repeat(motion, -1, motion.frames + 1)
    rate = 0.5 * motion.frame_rate
    before = longer.quaternions[:-2]
    after = longer.quaternions[2:]
    turns = rotations.product(rotations.inverse(before), after)  # in the torso's frame
    turns = np.where(turns[:, :1] < 0.0, -turns, turns)
    sines = np.linalg.norm(turns[:, 1:], axis=-1, keepdims=True)
    angles = 2.0 * np.arctan2(sines, turns[:, :1])
    return Velocities(
        linear=rate * (longer.positions[2:] - longer.positions[:-2]),
        angular=rate * angles * turns[:, 1:] / np.maximum(sines, 1e-12),
        joints=rate * (longer.angles[2:] - longer.angles[:-2]),
    )


def sample_linearly(values: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return values (n, components) on straight lines between frames.

    Args:
        values: (frames, components)
        places: (n,) fractions of frames, from 0 to the last one.
    """
    previous = np.minimum(places.astype(int), len(values) - 2)
    share = (places - previous)[:, None]
    return (1.0 - share) * values[previous] + share * values[previous + 1]


def _select(motion: Motion, indices: np.ndarray) -> Motion:
    return motion._replace(
        positions=motion.positions[indices],
        quaternions=motion.quaternions[indices],
        angles=motion.angles[indices],
        planted=motion.planted[indices],
        soles=motion.soles[indices],
    )


def _interpolate(values: np.ndarray, previous: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Return cubic interpolations between values, by Catmull and Rom.

    Args:
        values: (frames, ...)
        previous: (n,) frame before each place; there are a frame before it and two behind it.
        share: (n,) from the frame before the place, 0, to the frame behind it, 1.
    """
    s = share.reshape(-1, *[1] * (values.ndim - 1))
    before, start, end, after = (values[previous + offset] for offset in (-1, 0, 1, 2))
    start_slope = 0.5 * (end - before)
    end_slope = 0.5 * (after - start)
    change = end - start
    return start + s * (
        start_slope + s * (3.0 * change - 2.0 * start_slope - end_slope + s * (start_slope + end_slope - 2.0 * change))
    )
