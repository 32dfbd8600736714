"""Bones: in their limbs, one curve a joint, and the same creature in any pose."""

import imports
import numpy as np
import pytest

from arc_suite import rotations
from arc_suite.animation.clips import bones
from arc_suite.animation.clips.root_motion import Pose
from arc_suite.animation.parts import describe_body, part_frames
from arc_suite.bodies.generator import random_body
from arc_suite.robots import ROBOTS, spec_files

BODIES = {**ROBOTS, "six legs": imports.hexapod(), "spider": spec_files.load_body("spider"), "random": random_body(3)}


def shown(found, pose):
    """Return the places and rotation matrices of all shapes in a pose."""
    return [
        (place + turn @ shape.place, turn @ rotations.matrix(shape.quaternion))
        for part, place, turn in zip(found, *part_frames(bones.pose_parts(found, pose)), strict=True)
        for shape in part.shapes
    ]


@pytest.mark.parametrize("name", BODIES)
def test_bones_move_what_parts_move(name):
    body = BODIES[name]
    found, random = describe_body(body)[0], np.random.default_rng(0)
    angles = random.uniform(-1.0, 1.0, len(body.joint_names))
    pose = Pose(np.array((1.0, 2.0, 3.0)), np.array((0.5, -0.5, 0.5, 0.5)), angles)
    for one, other in zip(shown(found, pose), shown(bones.align_bones(found), pose), strict=True):
        np.testing.assert_allclose(one[0], other[0], atol=1e-12)
        np.testing.assert_allclose(one[1], other[1], atol=1e-12)


@pytest.mark.parametrize("name", BODIES)
def test_a_hinge_is_an_axis_and_a_bone_points_along_its_link(name):
    """In glTF's axes, x is the hinge and y as near to the link as it can be; or y is the hinge that is nearer to it."""
    found = bones.align_bones(describe_body(BODIES[name])[0])
    for part, child in zip(found, found[1:], strict=False):
        if part.axis is None:
            continue
        link = child.place[[1, 2, 0]] / np.linalg.norm(child.place)
        x, y, z = part.axis[[1, 2, 0]]
        assert (x, abs(y), z) in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
        assert link[1] >= np.sqrt(0.5) - 1e-9
        if x:
            assert abs(link[2]) < 1e-12
        else:  # x is far from z of the bone above, where Euler angles have no gimbal lock
            assert abs(rotations.matrix(part.quaternion)[0, 1]) < 0.5


def test_a_foot_goes_on_as_its_link():
    (foot,) = [part for part in bones.align_bones(describe_body(ROBOTS["queen"])[0]) if part.name == "l1_foot"]
    np.testing.assert_allclose(foot.quaternion, (1.0, 0.0, 0.0, 0.0), atol=1e-12)
