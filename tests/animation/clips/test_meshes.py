"""Meshes of bodies: few triangles, and a place in a texture for each face."""

import functools

import imports
import numpy as np
import pytest
from refusals import refused

from arc_suite.animation.clips.meshes import body_meshes
from arc_suite.animation.parts import describe_body
from arc_suite.bodies.generator import generate
from arc_suite.robots import ROBOTS, spec_files

BODIES = {"queen": ROBOTS["queen"], "spider": spec_files.load_body("spider"), "many": generate(12, 4)}
BODIES["an arm"] = imports.with_arm()


@functools.cache
def meshes(name, **options):
    body = BODIES[name]
    found = body_meshes(describe_body(body)[0], body.torso.standing_height, **options)
    return [mesh for own in found for mesh in own.values()]


def count(found):
    return sum(len(mesh.triangles) for mesh in found)


@pytest.mark.parametrize("name", BODIES)
def test_few_triangles(name):
    """The creature is as large as before."""
    fine, coarse = meshes(name), meshes(name, triangles=3000)
    assert 1000 < count(coarse) <= 3000 and (count(coarse) < count(fine) or name == "an arm")
    ends = [[np.concatenate([mesh.points for mesh in found]) for found in (fine, coarse)]]
    for one, other in ends:
        np.testing.assert_allclose(np.ptp(other, axis=0), np.ptp(one, axis=0), rtol=0.1)


def test_too_few_triangles():
    with refused("triangles: expected at least ", begins=True):
        meshes("queen", triangles=1)


@pytest.mark.parametrize("name", ["queen", "an arm"])
def test_each_face_has_a_place_of_its_own(name):
    """Nothing is mirrored, and lengths are at one scale, up to the slope of a face."""
    found = meshes(name, triangles=3000, uv=True)
    faces = np.concatenate([mesh.uv[mesh.triangles] for mesh in found])
    assert faces.min() >= 0.0 and faces.max() <= 1.0
    edges = faces[:, 1:] - faces[:, :1]
    areas = 0.5 * (edges[:, 0, 1] * edges[:, 1, 0] - edges[:, 0, 0] * edges[:, 1, 1])
    assert (areas > -1e-12).all()
    corners = np.concatenate([mesh.points[mesh.triangles] for mesh in found])
    true = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=-1)
    large = true > 1e-3 * true.max()
    ratio = (areas / true)[large]
    assert ratio.max() / ratio.min() < 1.8
    assert areas.sum() > 0.35
    grid, covered = 400, np.zeros((400, 400), int)
    for (a, b, c), area in zip(faces * grid, areas, strict=True):
        low, high = np.floor((a, b, c)).min(axis=0).astype(int), np.ceil((a, b, c)).max(axis=0).astype(int)
        x, y = np.meshgrid(*(np.arange(*ends) + 0.5 for ends in zip(low, high, strict=True)), indexing="ij")
        inside = area > 0.0
        for start, end in ((a, b), (b, c), (c, a)):
            inside = inside & ((end[0] - start[0]) * (y - start[1]) < (end[1] - start[1]) * (x - start[0]) - 1e-3)
        covered[low[0] : high[0], low[1] : high[1]] += inside
    assert covered.max() == 1
