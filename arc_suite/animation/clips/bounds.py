"""Bounds that every clip keeps to, in a table. A clip that breaks one is left out, with the line that says which."""

import functools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips.bones import pose_parts
from arc_suite.animation.clips.catalog import Acted, BlowClip, Difference, Kind, Turn
from arc_suite.animation.clips.meshes import body_meshes
from arc_suite.animation.clips.root_motion import ClipMotion, Pose
from arc_suite.animation.clips.standing_legs import has_free_feet
from arc_suite.animation.parts import Part, describe_body, part_frames
from arc_suite.robots.spec import Body

_CHECKED_TIME_STEP = 1.0 / 240.0  # s between the samples that are checked
_FOOT_SIZE = 2.0  # radii of a foot about its center, in which the end of its leg is a part of it
_STANCE_HEIGHT = 0.01  # standing heights: a lower sole stands
_FLIGHT_HEIGHT = 0.02  # standing heights: while all soles are higher, a body flies


class Measures(NamedTuple):
    """What a motion does over all its samples; lengths in standing heights.

    Attributes:
        part_depth: how deep torso or links are in the ground, as they are drawn; negative above it.
        sole_depth: how deep feet are in the ground.
        slide: largest diagonal of the way of a foot in one stance.
        last_speed: speed of the fastest joint at the end, degrees/s.
        seconds: duration, s.
    """

    part_depth: float
    sole_depth: float
    slide: float
    last_speed: float
    seconds: float


class Bound(NamedTuple):
    """A bound of a measure.

    Attributes:
        measure: name of `Measures`.
        limit: largest value.
        excess: what is wrong with a clip beyond it, with the value and the limit.
    """

    measure: str
    limit: float
    excess: str


PART_DEPTH = Bound(
    "part_depth", 0.01, "torso or legs are {value:.3f} standing heights in the ground, more than {limit}"
)
SOLE_DEPTH = Bound("sole_depth", 0.03, "a sole is {value:.3f} standing heights in the ground, more than {limit}")
SLIDE = Bound("slide", 0.05, "a standing foot slides by {value:.3f} standing heights, more than {limit}")
LAST_SPEED = Bound("last_speed", 2.0, "a joint turns at {value:.1f} degrees/s in the end, more than {limit}")
SECONDS_OF_TURN = Bound("seconds", 2.0, "it lasts {value:.1f} s, more than {limit}")


def bounds_of(body: Body, clip: Kind) -> tuple[Bound, ...]:
    """Return the bounds of a clip of a body."""
    if isinstance(clip, Difference):
        return ()  # is no motion of its own; the metadata say over which clips it keeps to the bounds
    bounds = [PART_DEPTH, SOLE_DEPTH]
    if is_planted(clip) and has_free_feet(body):
        bounds.append(SLIDE)
    if isinstance(clip, Acted) and not clip.loops and -1 not in clip.ends:
        bounds.append(LAST_SPEED)
    if isinstance(clip, Turn):
        bounds.append(SECONDS_OF_TURN)
    return tuple(bounds)


def is_planted(clip: Kind) -> bool:
    """Return whether standing feet are to stay in place in a clip."""
    match clip:
        case Acted():
            return clip.planted
        case BlowClip():
            return clip.cycles == 0
        case _:
            return isinstance(clip, Turn)


def find_excess(body: Body, clip: Kind, motion: ClipMotion) -> str:
    """Return what is wrong with a motion of a clip by the first bound that it breaks; "" if it keeps to all of them."""
    measures = measure(body, motion)
    for bound in bounds_of(body, clip):
        value = getattr(measures, bound.measure)
        if value > bound.limit:
            return bound.excess.format(value=value, limit=bound.limit)
    return ""


def measure(body: Body, motion: ClipMotion) -> Measures:
    """Return the measures of a motion."""
    last_changes = motion.joints[-1] - motion.joints[-2]
    seconds = motion.seconds
    last_speed = abs(np.degrees(last_changes)).max() / motion.time_step
    motion = _thin_out(motion)
    height = body.torso.standing_height
    ground = measure_ground(body, motion)
    return Measures(
        part_depth=float(-ground.lowest_part.min() / height),
        sole_depth=float(-ground.soles.min() / height),
        slide=float(measure_slide(body, ground) / height),
        last_speed=float(last_speed),
        seconds=seconds,
    )


class Ground(NamedTuple):
    """Where the drawn body is over the ground.

    Attributes:
        lowest_part: (samples,) height of the lowest point of torso and links, m.
        soles: (samples, feet) heights of the lowest points of feet, m.
        feet: (samples, feet, 2) horizontal positions of feet in the world, m.
    """

    lowest_part: np.ndarray
    soles: np.ndarray
    feet: np.ndarray


def measure_ground(body: Body, motion: ClipMotion) -> Ground:
    """Return where the drawn body is over the ground.

    The end of a leg next to its foot is a part of the foot.
    """
    parts, points_of_parts = _drawn_points(body)
    radius_of_foot = {name: leg.foot.radius for name, leg in zip(body.foot_names, body.legs, strict=True)}
    poses = Pose(motion.positions, motion.quaternions, motion.joints)
    positions, orientations = part_frames(pose_parts(parts, poses))
    lowest_part = np.full(len(motion.joints), np.inf)
    soles = []
    feet = []
    for part, position in zip(parts, positions, strict=True):
        if part.name in radius_of_foot:
            soles.append(position[:, 2] - radius_of_foot[part.name])
            feet.append(position[:, :2])
    for index, points in enumerate(points_of_parts):
        swing = parts[index].swing
        if swing is not None:  # its tip stays above the ground
            lowest_part = np.minimum(lowest_part, positions[index][:, 2] - swing.pivot_radius)
            continue
        if len(points) and parts[index].name not in radius_of_foot:
            heights = positions[index][:, 2] + (orientations[index][:, 2] @ points.T).min(axis=-1)
            lowest_part = np.minimum(lowest_part, heights)
    yaw = motion.root[:, None, 2]
    offsets = rotations.to_heading_frame(np.stack(feet, axis=1), -yaw)
    return Ground(lowest_part, np.stack(soles, axis=1), motion.root[:, None, :2] + offsets)


def find_flight(body: Body, motion: ClipMotion) -> np.ndarray:
    """Return the indices of the samples in which no foot is near the ground."""
    soles = measure_ground(body, motion).soles
    return np.flatnonzero((soles > _FLIGHT_HEIGHT * body.torso.standing_height).all(axis=-1))


def measure_slide(body: Body, ground: Ground) -> float:
    """Return the largest diagonal of the way of a foot while its sole is low, m."""
    is_low = ground.soles < _STANCE_HEIGHT * body.torso.standing_height
    largest = 0.0
    for foot_is_low, ways in zip(is_low.T, ground.feet.swapaxes(0, 1), strict=True):
        edges = np.flatnonzero(np.diff(foot_is_low.astype(int), prepend=0, append=0)).reshape(-1, 2)
        for start, end in edges:
            largest = max(largest, float(np.linalg.norm(np.ptp(ways[start:end], axis=0))))
    return largest


def _thin_out(motion: ClipMotion) -> ClipMotion:
    """Return the motion with fewer samples, both ends among them."""
    intervals = max(1, round(motion.seconds / max(_CHECKED_TIME_STEP, motion.time_step)))
    return motion.sample_at(np.linspace(0.0, motion.seconds, intervals + 1))


@functools.lru_cache(maxsize=8)
def _drawn_points(body: Body) -> tuple[Sequence[Part], list[np.ndarray]]:
    """Return the parts of a body, and the points (n, 3) of their meshes in their frames, m; without ends at feet."""
    parts, _ = describe_body(body)
    points_of_parts = []
    for meshes in body_meshes(parts, body.torso.standing_height):
        points = np.concatenate([np.zeros((0, 3)), *(mesh.points for mesh in meshes.values())])
        points_of_parts.append(np.unique(points.round(6), axis=0))
    for name, leg in zip(body.foot_names, body.legs, strict=True):
        (foot,) = (part for part in parts if part.name == name)
        distances = np.linalg.norm(points_of_parts[foot.parent] - foot.place, axis=-1)
        points_of_parts[foot.parent] = points_of_parts[foot.parent][distances > _FOOT_SIZE * leg.foot.radius]
    return parts, points_of_parts
