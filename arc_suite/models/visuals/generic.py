"""Visuals for any body, scaled to its torso."""

import math

import numpy as np

from arc_suite.models.outline import solid_corners
from arc_suite.models.visuals.spec import Bone, Ornament, Visuals, whip
from arc_suite.robots.spec import Body, Solid

_PIVOT_SHARE = 0.85  # of half of the length of a torso, from its middle to the pivot of the tail
_TAIL_LENGTH = 0.6  # of the geometric mean of a torso's length and the height at which it stands
_TAIL_RISE = math.radians(40.0)  # rad
_TAIL_WIDTH = 0.16  # radius at the pivot, of the tail's length


def generic_visuals(body: Body) -> Visuals:
    """Return visuals for a body: slate armor, violet joints, an eye on a snout in front, a tail."""
    all_corners = [solid_corners(solid) for solid in body.torso.solids]
    corners = max(all_corners, key=lambda corners: corners[:, 0].max())  # of the foremost solid, such as a head
    center = corners.mean(axis=0)
    half_extents = np.ptp(corners, axis=0) / 2.0
    radius = 0.4 * min(half_extents)
    eye_size = (0.4 * radius, 0.7 * radius, 0.7 * radius)
    x, y, z = center + half_extents * (1.0, 0.0, 0.5)  # above the mount of a leg that points forward
    half_length = half_extents[0] / 2.0  # of the snout
    tail = _tail(body)
    return Visuals(
        colors={
            "shell": (0.62, 0.66, 0.72),
            "trim": (0.35, 0.38, 0.45),
            "frame": (0.13, 0.14, 0.17),
            "limb": (0.28, 0.30, 0.35),
            "glow": (0.36, 0.18, 0.85),
        },
        ornaments=(
            Ornament("snout", "frame", "cylinder", (radius, half_length), (x - half_length, y, z), (0, 90, 0)),
            Ornament("eye", "glow", "ellipsoid", eye_size, (x, y, z)),
            *whip(tail, "shell", "glow", "ellipsoid"),
        ),
        bones=(tail,),
    )


def _tail(body: Body) -> Bone:
    """Return a tail: of a torso it rises behind it, above the mounts of legs; of a rearmost other solid it goes on."""
    chassis = body.torso.solids[0]
    rearmost_solid = min(body.torso.solids, key=lambda solid: solid_corners(solid)[:, 0].min())
    corners = solid_corners(rearmost_solid)
    half_extents = np.ptp(corners, axis=0) / 2.0
    if rearmost_solid == chassis:
        offset = half_extents * (_PIVOT_SHARE, 0.0, -_PIVOT_SHARE * math.sqrt(1.0 - _PIVOT_SHARE**2))
        pivot = corners.mean(axis=0) - offset
        direction = np.array((-math.cos(_TAIL_RISE), 0.0, math.sin(_TAIL_RISE)))
    else:
        pivot, direction = _find_free_end(rearmost_solid, chassis)
    length = _TAIL_LENGTH * math.sqrt(2.0 * half_extents[0] * body.torso.standing_height)
    tip = pivot + length * direction
    radius = _TAIL_WIDTH * length
    return Bone("tail", "tail", tuple(pivot.tolist()), tuple(tip.tolist()), radius, 0.5 * radius)


def _find_free_end(solid: Solid, chassis: Solid) -> tuple[np.ndarray, np.ndarray]:
    """Return a point inside the end of a solid that is farther from the chassis, and the direction to it (3,)."""
    corners = solid_corners(solid)
    edges = corners[[4, 2, 1]] - corners[0]  # along the axes of the solid
    longest_edge = max(edges, key=np.linalg.norm)
    ends = [share * longest_edge for share in (-_PIVOT_SHARE / 2.0, _PIVOT_SHARE / 2.0)]
    distances = [np.linalg.norm(corners.mean(axis=0) + end - chassis.position) for end in ends]
    end = ends[int(np.argmax(distances))]
    return corners.mean(axis=0) + end, end / np.linalg.norm(end)
