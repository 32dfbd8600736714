"""Parts of imported bodies: the shapes that they show are where the simulation has them."""

import imports
import mujoco
import numpy as np
import pytest

from arc_suite import models, rotations
from arc_suite.animation import pages, parts
from arc_suite.models.standing import standing_qpos
from arc_suite.tasks import readings

BODIES = {"four legs": imports.quadruped, "six legs": imports.hexapod, "an arm": imports.with_arm}


def bent(found, pose):
    """Places and rotation matrices of parts in a pose (7 + joints,)."""
    turned = []
    for part in found:
        place, turn = (pose[:3], pose[3:7]) if part.parent is None else (part.place, part.quaternion)
        if part.joint is not None:
            half = 0.5 * pose[7 + part.joint]
            turn = rotations.product(turn, np.array((np.cos(half), *(np.sin(half) * part.axis))))
        turned.append(part._replace(place=place, quaternion=turn))
    return parts.part_frames(turned)


@pytest.mark.parametrize("name", BODIES)
def test_shapes_are_where_the_simulation_has_them(name):
    body = BODIES[name]()
    found, materials = parts.describe_body(body)
    assert [part.name for part in found] == list(body.part_names)
    torso_color = "visual_color0" if name in ("four legs", "an arm") else "shell"  # of their file
    assert set(materials) == {torso_color, "limb", "glow"}
    model = models.model_spec(body, decorated=True).compile()
    data, layout = mujoco.MjData(model), readings.layout(model, body)
    random = np.random.default_rng(0)
    pose = np.concatenate([(1.0, 2.0, 3.0, 0.5, -0.5, 0.5, 0.5), random.uniform(-0.5, 0.5, len(body.joint_names))])
    data.qpos[:] = readings.positions(pose, layout, standing_qpos(model))
    np.testing.assert_allclose(readings.pose(data.qpos, layout), pose, atol=1e-12)
    mujoco.mj_kinematics(model, data)
    places, turns = bent(found, pose)
    shown = [
        (*(place + turn @ shape.place), *(turn @ rotations.matrix(shape.quaternion)).ravel())
        for part, place, turn in zip(found, places, turns, strict=True)
        for shape in part.shapes
    ]
    own = np.flatnonzero((model.geom_bodyid > 0) & (model.geom_group <= 2))  # others are not drawn
    simulated = np.concatenate([data.geom_xpos[own], data.geom_xmat[own]], axis=-1)
    assert len(shown) == len(simulated)
    for shape in shown:
        assert abs(simulated - shape).max(axis=-1).min() < 1e-12


def test_a_mesh_is_a_closed_hull_seen_from_outside():
    """What lies within the hull is left out."""
    torso = parts.describe_body(imports.with_arm())[0][0]
    (shape,) = [shape for shape in torso.shapes if shape.kind == "hull"]
    points, triangles = shape.hull
    assert len(points) == 6 and len(triangles) == 8
    corners = points[triangles] - points.mean(axis=0)
    assert (np.linalg.det(corners) > 0.0).all()
    assert np.linalg.det(corners).sum() / 6.0 == pytest.approx(0.2 * 0.1 * 0.1 / 2.0, rel=1e-5)
    (drawn,) = [each for each in pages.body_drawing(imports.with_arm())["parts"][0]["shapes"] if each["kind"] == "hull"]
    assert drawn["hull"]["triangles"] == triangles.tolist()


def test_a_simple_hull_is_nearly_as_large():
    sphere = np.random.default_rng(0).normal(size=(300, 3))
    points = sphere / np.linalg.norm(sphere, axis=-1, keepdims=True) * (0.3, 0.1, 0.05) + (1.0, 2.0, 3.0)
    found = parts.simplify_hull(parts.Hull(points, np.empty((0, 3), int)), 32)
    assert len(found.points) == 32 and len(found.triangles) == 60
    assert abs(points[:, None] - found.points).sum(axis=-1).min(axis=0).max() < 1e-6  # they are some of the points
    corners = found.points[found.triangles] - points.mean(axis=0)
    assert 0.7 < np.linalg.det(corners).sum() / 6.0 / (4.0 / 3.0 * np.pi * 0.3 * 0.1 * 0.05) < 1.0
    few = parts.Hull(points[:20], np.empty((0, 3), int))
    assert parts.simplify_hull(few, 32) is few
