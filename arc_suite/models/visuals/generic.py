"""Visuals for any body, scaled to its torso."""

import numpy as np

from arc_suite.models.outline import solid_corners
from arc_suite.models.visuals.spec import Ornament, Visuals
from arc_suite.robots.spec import Body


def generic_visuals(body: Body) -> Visuals:
    """Return visuals for a body: slate armor, violet joints, and an eye on a snout in front of the torso."""
    corners = solid_corners(body.torso.solids[0])
    center = corners.mean(axis=0)
    half_extents = np.ptp(corners, axis=0) / 2.0
    radius = 0.4 * min(half_extents)
    eye_size = (0.4 * radius, 0.7 * radius, 0.7 * radius)
    x, y, z = center + half_extents * (1.0, 0.0, 0.5)  # above the mount of a leg that points forward
    half_length = half_extents[0] / 2.0  # of the snout
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
        ),
    )
