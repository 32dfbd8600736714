"""Where a drawn body is over the ground in a motion: heights, flights, slides of feet; and motions raised out of it."""

import functools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from arc_suite import rotations
from arc_suite.animation.clips.bones import pose_parts
from arc_suite.animation.clips.meshes import body_meshes
from arc_suite.animation.clips.root_motion import ClipMotion, Pose, fade_out
from arc_suite.animation.parts import Part, describe_body, part_frames
from arc_suite.models import visuals
from arc_suite.models.standing import time_unit
from arc_suite.motions.runs import find_runs
from arc_suite.robots.spec import Body

MAX_SLIDE = 0.05  # standing heights, of a standing foot of a leg with three joints or more
_FOOT_SIZE = 2.0  # radii of a foot about its center, in which the end of its leg is a part of it
_STANCE_HEIGHT = 0.01  # standing heights: a lower sole stands
_FLIGHT_HEIGHT = 0.02  # standing heights: while all soles are higher, a body flies
_MAX_SOLE_DEPTH = 0.025  # standing heights: a body with soles that are deeper in the ground is raised
_RAISING_DURATION = 0.5  # sqrt(h / g), to either side of a sample in which a body is raised


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
    parts, points_of_parts = _drawn_points(body, visuals.key_of(body))
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
        for start, end in find_runs(foot_is_low):
            largest = max(largest, float(np.linalg.norm(np.ptp(ways[start:end], axis=0))))
    return largest


def raise_out_of_ground(body: Body, motion: ClipMotion, fixed_ends: Sequence[int]) -> ClipMotion:
    """Return a motion whose torso is higher where, drawn, the body is in the ground, and smoothly so before and after.

    Contacts of the physics are soft, and recordings of policies have no contacts of what is drawn around colliders.

    Args:
        body: the spec.
        motion: any.
        fixed_ends: ends whose poses stay: 0, -1 or both.
    """
    height = body.torso.standing_height
    ground = measure_ground(body, motion)
    depths = np.maximum(-ground.lowest_part, -ground.soles.min(axis=-1) - _MAX_SOLE_DEPTH * height)
    if depths.max() <= 0.0:
        return motion
    width = round(_RAISING_DURATION * time_unit(body) / motion.time_step)  # samples to either side
    padded_depths = np.pad(depths.clip(0.0), 2 * width, mode="edge")
    largest_depths = sliding_window_view(padded_depths, 2 * width + 1).max(axis=-1)
    window = np.hanning(2 * width + 3)[1:-1]
    raises = np.convolve(largest_depths, window / window.sum(), "valid")
    growth = fade_out(1.0 - np.arange(len(raises)) / width)  # from 0 at the first sample
    for end in fixed_ends:
        raises = raises * (growth if end == 0 else growth[::-1])
    return motion._replace(positions=motion.positions + raises[:, None] * (0.0, 0.0, 1.0))


@functools.lru_cache(maxsize=8)
def _drawn_points(body: Body, visuals_key: str) -> tuple[Sequence[Part], list[np.ndarray]]:
    """Return the parts of a body, and the points (n, 3) of their meshes in their frames, m; without ends at feet.

    Args:
        body: any body.
        visuals_key: of `visuals.key_of`, for the cache.
    """
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
