"""Overlaps of a body's parts, which no contact keeps apart, standing and in the strides of its gait."""

import functools
import math
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite.models import foot_paths
from arc_suite.models.kinematics import point_velocities
from arc_suite.models.posture import find_rest_pose
from arc_suite.models.standing import compile_body
from arc_suite.models.stride import fitted_gait, half_stroke, strokes
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Body

_FAR = 1e6  # m, of distances that are measured
_MAX_DEPTH = 0.01  # standing heights, of an overlap that does not count

# Demonstrators lengthen strides to keep their course, and as they start. They stretch strides by this factor at least,
# and further where legs have room; see `find_largest_stretch`.
_MIN_STRETCH = 1.25
# Demonstrators also step aside and turn, to follow commands and to keep their course: forward, left and turning.
_MOTIONS = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0))
_STRETCH_STEP = 0.125  # between stretches that are tried, and to spare, as balance shifts feet
_DELAY = 0.5  # poses of a cycle by which every other leg of a side may come later than its neighbors

# Owners of geoms that are no legs.
_TORSO = -1
_BALLAST = -2


class Overlap(NamedTuple):
    """Two parts of a body that overlap.

    Attributes:
        names: names of a solid of the torso and a part of a leg, or of parts of two legs.
        depth: m.
        pose: pose in which they overlap, "the standing pose" or "a stride".
    """

    names: tuple[str, str]
    depth: float
    pose: str


def overlaps(body: Body) -> Iterator[Overlap]:
    """Yield the overlaps of a body: between torso and legs beyond their hips, and between legs.

    Hips lie in the torso, and side by side. Ballast touches nothing, and may overlap.
    """
    if body.source:  # the legs of an imported body are only a sketch of its colliders
        return
    yield from overlaps_in_poses(body, _poses(body))


def find_largest_stretch(body: Body, stretch_steps: Callable[[float], np.ndarray], largest: float) -> float:
    """Return the largest factor of the length of strides at which legs pass each other and the torso.

    Args:
        body: any body.
        stretch_steps: returns joint angles (n, joints) in a cycle of strides that are longer by a factor, rad.
        largest: largest factor that matters.

    Returns:
        The factor, 1.25 or more, as legs of sound bodies pass each other at 1.25; infinity if legs have room at the
        largest one. Robots of the suite and imported bodies have infinity, as `overlaps` finds none in their strides.
    """
    if body.source or body.name in ROBOTS:
        return math.inf

    ranks = [np.full(len(leg.joints), rank) for leg, rank in zip(body.legs, body.ranks, strict=True)]
    is_even = np.concatenate(ranks) % 2 == 0  # (joints,) whether they belong to every other leg of a side

    def passes(stretch: float) -> bool:
        angles = stretch_steps(stretch)
        late_angles = angles + _DELAY * (np.roll(angles, 1, axis=0) - angles)
        cycles = (angles, np.where(is_even, late_angles, angles), np.where(is_even, angles, late_angles))
        poses = (("a stride", pose) for pose in np.concatenate(cycles))
        return not any(overlaps_in_poses(body, poses))

    if passes(largest + _STRETCH_STEP):
        return math.inf
    stretch = _MIN_STRETCH
    while stretch < largest and passes(stretch + _STRETCH_STEP):
        stretch += _STRETCH_STEP
    return stretch


def overlaps_in_poses(body: Body, poses: Iterable[tuple[str, np.ndarray]]) -> Iterator[Overlap]:
    """Yield the overlaps of a body in poses by name, (joints,) rad; see `overlaps`."""
    names = _geom_names(body)
    pairs = _separate_pairs(body)
    model = compile_body(body)
    data = mujoco.MjData(model)
    max_distances = model.geom_rbound[pairs].sum(axis=1)  # between centers of geoms that can overlap, m
    for pose, angles in poses:
        data.qpos[7:] = angles
        mujoco.mj_kinematics(model, data)
        first_centers = data.geom_xpos[pairs[:, 0]]
        second_centers = data.geom_xpos[pairs[:, 1]]
        distances = np.linalg.norm(first_centers - second_centers, axis=1)
        for first, second in pairs[distances < max_distances]:
            depth = -mujoco.mj_geomDistance(model, data, first, second, 0.0, None)
            if depth > _MAX_DEPTH * body.torso.standing_height:
                yield Overlap((names[first], names[second]), depth, pose)


def measure_gaps(body: Body) -> np.ndarray:
    """Return the distances (legs,) from the torso to the first link of each leg, m; at most 0 where they touch.

    Those of an imported body are 0: its solids are only a sketch of its colliders.
    """
    if body.source:
        return np.zeros(len(body.legs))
    model = compile_body(body)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    solids = range(len(body.torso.solids))
    names = _geom_names(body)
    first_links = [names.index(leg.part_names[0]) for leg in body.legs]
    return np.array(
        [min(mujoco.mj_geomDistance(model, data, solid, link, _FAR, None) for solid in solids) for link in first_links]
    )


def _poses(body: Body) -> Iterator[tuple[str, np.ndarray]]:
    """Yield poses by name, (joints,) rad: the standing one, and those of a stride at which legs are nearest."""
    yield "the standing pose", np.zeros(len(body.joint_names))
    if body.name in ROBOTS:  # has a gait of its own
        return
    gait = fitted_gait(body)
    strokes_of_legs = strokes(body, _MIN_STRETCH * half_stroke(body, gait))
    offsets = np.array(gait.offsets)  # (legs,) cycles
    # Neighbors reach the ends of their strides at different times. All legs sweep at constant speed between the
    # moments at which one of them touches down or takes off, so that two are nearest at such a moment.
    event_times = np.concatenate([-offsets, gait.duty_factor - offsets]).round(9) % 1.0
    for time in np.unique(event_times):
        phases = (time + offsets) % 1.0
        # From the front end of the stride, 1, to its rear end in stance, and back in swing.
        sweep_shares = np.interp(phases, (0.0, gait.duty_factor, 1.0), (1.0, -1.0, 1.0))
        angles = [share * sweep for share, (sweep, _) in zip(sweep_shares, strokes_of_legs, strict=True)]
        yield "a stride", np.concatenate(angles)
    # Demonstrators that follow a command step along paths in space, where legs sweep otherwise.
    for angles in _step_angles(body):
        yield "a stride", angles


@functools.lru_cache(maxsize=16)
def _step_angles(body: Body) -> np.ndarray:
    """Return the joint angles (n, joints), rad, of steps along paths in a cycle of the fitted gait, in all `_MOTIONS`.

    The foot that steps furthest steps as far in all of them.
    """
    gait = fitted_gait(body)
    standing_height = body.torso.standing_height
    rest_pose = find_rest_pose(body)
    directions = point_velocities(np.array(_MOTIONS), rest_pose.sole_positions[None])  # (motions, legs, 2)
    longest = np.hypot(directions[..., 0], directions[..., 1]).max(axis=-1)
    angles = foot_paths.cycle_angles(
        rest_pose,
        np.array(gait.offsets),
        gait.duty_factor,
        half_path=_MIN_STRETCH * half_stroke(body, gait) / longest[:, None, None] * directions,
        foot_clearance=foot_paths.FOOT_CLEARANCE * standing_height,
        damping=foot_paths.IK_DAMPING * standing_height,
    )
    return angles.reshape(-1, angles.shape[-1])


def _separate_pairs(body: Body) -> np.ndarray:
    """Return the pairs of geoms that are to be apart, (pairs, 2).

    They belong to two legs, or to the torso and a leg, and are not both close to the torso.
    """
    owners = [_TORSO] * len(body.torso.solids) + [_BALLAST] * len(body.ballast)
    is_close = [True] * len(body.torso.solids) + [False] * len(body.ballast)  # to the torso
    for leg_index, leg in enumerate(body.legs):
        links_with_joint = [link_index for link_index, link in enumerate(leg.links) if link.joint]
        hip = links_with_joint[0]
        owners += [leg_index] * len(leg.parts)
        is_close += [part_index <= hip for part_index in range(len(leg.parts))]
    owners = np.array(owners)
    is_close = np.array(is_close)
    first, second = np.triu_indices(len(owners), 1)
    is_ballast = (owners[first] == _BALLAST) | (owners[second] == _BALLAST)
    is_separate = (owners[first] != owners[second]) & ~(is_close[first] & is_close[second]) & ~is_ballast
    return np.stack([first, second], axis=1)[is_separate]


def _geom_names(body: Body) -> list[str]:
    """Return the names of the parts of geoms, in the order of the model."""
    solids = [solid.name for solid in (*body.torso.solids, *body.ballast)]
    parts_of_legs = [name for leg in body.legs for name in leg.part_names]
    return solids + parts_of_legs
