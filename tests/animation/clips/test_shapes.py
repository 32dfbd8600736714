"""Shapes as triangles: closed, facing outwards, as large as what they stand for."""

import math

import numpy as np
import pytest

from arc_suite.animation.clips import shapes

SIZE = (0.3, 0.2, 0.5)
BALL, TUBE, BRICK = 4.0 / 3.0 * math.pi * 0.3**3, math.pi * 0.3**2 * 0.4, 0.3 * 0.2 * 0.5
VOLUMES = {"sphere": BALL, "capsule": BALL + TUBE, "cylinder": TUBE, "box": 8.0 * BRICK}
VOLUMES["ellipsoid"] = 4.0 / 3.0 * math.pi * BRICK


def volume(mesh):
    a, b, c = (mesh.points[mesh.triangles[:, corner]] for corner in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0


@pytest.mark.parametrize("kind", shapes.KINDS)
def test_a_shape(kind):
    mesh = shapes.shape_mesh(kind, SIZE, 0.0005)
    assert volume(mesh) == pytest.approx(VOLUMES[kind], rel=0.03)
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=-1), 1.0)
    a, b, c = (mesh.points[mesh.triangles[:, corner]] for corner in range(3))
    faces = np.cross(b - a, c - a)
    assert (np.linalg.norm(faces, axis=-1) > 0.0).all()
    for corner in range(3):
        assert ((faces * mesh.normals[mesh.triangles[:, corner]]).sum(axis=-1) > 0.0).all()


@pytest.mark.parametrize("kind", shapes.KINDS)
def test_it_is_closed(kind):
    mesh = shapes.shape_mesh(kind, SIZE, 0.01)
    _, same = np.unique(mesh.points.round(9), axis=0, return_inverse=True)  # rims have points of their own
    edges = np.concatenate([same[mesh.triangles[:, pair]].reshape(-1, 2) for pair in ((0, 1), (1, 2), (2, 0))])
    forth, back = ({tuple(edge) for edge in way.tolist()} for way in (edges, edges[:, ::-1]))
    assert forth == back
    assert len(forth) == len(edges)


def test_finer_is_nearer():
    coarse, fine = (volume(shapes.shape_mesh("sphere", SIZE, tolerance)) for tolerance in (0.02, 0.002))
    assert coarse < fine < VOLUMES["sphere"]


@pytest.mark.parametrize("radius", [0.001, 0.01, 0.1, 1.0])
def test_segments(radius):
    count = shapes.segment_count(radius, 0.002)
    assert count % 2 == 0 and 8 <= count <= 32
    if 8 < count < 32:
        assert radius * (1.0 - math.cos(math.pi / count)) <= 0.002


def test_joined_and_moved():
    box = shapes.shape_mesh("box", SIZE, 0.01)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    both = shapes.join_meshes([box, box.transform(np.array((2.0, 0.0, 0.0)), turn)])
    assert volume(both) == pytest.approx(2.0 * VOLUMES["box"])
    np.testing.assert_allclose(both.points[24:].max(axis=0), (2.2, 0.3, 0.5))
