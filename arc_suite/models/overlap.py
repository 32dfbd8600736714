"""Overlaps of a body's parts, which no contact keeps apart, standing and in the strides of its gait."""

import copy
from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite.models.standing import compile_body
from arc_suite.models.stride import fitted_gait, half_stroke, strokes
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Body

_ALLOWED = 0.01  # depth of an overlap, of the standing height

# Demonstrators lengthen strides to keep their course. Of 49 random bodies that overlapped as they walked, 47 are found
# with this factor and 41 without, and none that did not.
_LENGTHENED = 1.25


class Overlap(NamedTuple):
    """Two parts of a body that overlap.

    Attributes:
        names: of a solid of the torso and a part of a leg, or of parts of two legs.
        depth: m.
        pose: in which they do, "the standing pose" or "a stride".
    """

    names: tuple[str, str]
    depth: float
    pose: str


def overlaps(body: Body, spread: float = 1.0) -> Iterator[Overlap]:
    """Yield the overlaps of a body: between torso and legs beyond their hips, and between legs.

    Hips lie in the torso, and side by side. Ballast touches nothing, and may overlap.

    Args:
        body: the spec.
        spread: factor of the distances of the legs' mounts from the torso's middle, seen from above.
    """
    if body.source:  # whose parts are a sketch of colliders of any shape
        return
    names, pairs = _names(body), _pairs(body)
    model = copy.copy(compile_body(body))
    model.body_pos[[model.body(leg.part_names[0]).id for leg in body.legs], :2] *= spread
    data = mujoco.MjData(model)
    nearest = model.geom_rbound[pairs].sum(axis=1)
    for pose, angles in _poses(body):
        data.qpos[7:] = angles
        mujoco.mj_kinematics(model, data)
        distances = np.linalg.norm(np.subtract(*data.geom_xpos[pairs.T]), axis=1)
        for one, other in pairs[distances < nearest]:
            depth = -mujoco.mj_geomDistance(model, data, one, other, 0.0, None)
            if depth > _ALLOWED * body.torso.standing_height:
                yield Overlap((names[one], names[other]), depth, pose)


def _poses(body: Body) -> Iterator[tuple[str, np.ndarray]]:
    """Yield poses by name, (joints,) rad: the standing one, and those of a stride at which legs are nearest."""
    yield "the standing pose", np.zeros(len(body.joint_names))
    if body.name in ROBOTS:  # which has a gait of its own
        return
    gait = fitted_gait(body)
    moves = strokes(body, _LENGTHENED * half_stroke(body, gait))
    offsets = np.array(gait.offsets)
    # Neighbors reach the ends of their strides at different times. All legs sweep at constant speed between the
    # moments at which one of them touches down or takes off, so that two are nearest at such a moment.
    for time in np.unique(np.concatenate([-offsets, gait.duty_factor - offsets]).round(9) % 1.0):
        ways = np.interp((time + offsets) % 1.0, (0.0, gait.duty_factor, 1.0), (1.0, -1.0, 1.0))
        yield "a stride", np.concatenate([way * sweep for way, (sweep, _) in zip(ways, moves, strict=True)])


def _pairs(body: Body) -> np.ndarray:
    """Return the pairs of geoms that are to be apart, (pairs, 2)."""
    weights = len(body.ballast)
    inner = [True] * len(body.torso.solids) + [False] * weights
    owner = [-1] * len(body.torso.solids) + [-2] * weights
    for index, leg in enumerate(body.legs):
        hip = next(number for number, link in enumerate(leg.links) if link.joint)
        inner += [number <= hip for number in range(len(leg.parts))]
        owner += [index] * len(leg.parts)
    inner, owner = np.array(inner), np.array(owner)
    one, other = np.triu_indices(len(owner), 1)
    apart = (owner[one] != owner[other]) & ~(inner[one] & inner[other])
    return np.stack([one, other], axis=1)[apart & (owner[one] != -2) & (owner[other] != -2)]


def _names(body: Body) -> list[str]:
    """Return the names of the parts of geoms."""
    solids = [solid.name for solid in (*body.torso.solids, *body.ballast)]
    return solids + [name for leg in body.legs for name in leg.part_names]
