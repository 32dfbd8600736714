"""Torsos of other forms, heads and tails: bodies that stand and walk as files of them do."""

import itertools
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refused

from arc_suite.bodies import generator, torsos
from arc_suite.bodies.descriptions import body_description
from arc_suite.bodies.shaping import shaped
from arc_suite.envs.setup import Setup
from arc_suite.models.outline import solid_corners
from arc_suite.models.soundness import flaws
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Solid
from arc_suite.robots.spec_files import body_from_json, body_to_json

BODIES = [generator.generate(4, 2), generator.generate(6, 3), generator.generate(8, 3, "radial")]
PARTS = [*itertools.product(("torso",), torsos.TORSOS), *itertools.product(("head",), torsos.HEADS)]
PARTS += itertools.product(("tail",), torsos.TAILS)


@pytest.mark.parametrize(("part", "name"), PARTS)
def test_bodies_with_other_torsos_have_no_flaws(part, name):
    for body in BODIES:
        other_body = shaped(body, **{part: name})
        assert other_body != body and not flaws(other_body), other_body.name
        assert body_from_json(body_to_json(other_body)) == other_body
        if part == "torso":
            continue
        *_, solid = other_body.torso.solids
        x, _, z = np.transpose(solid_corners(solid))
        half_length = body.torso.solids[0].size[0]
        assert solid.name == part and z.max() > 0.0
        assert (x.max() > half_length) if part == "head" else (x.min() < -half_length)


def test_proportions_and_torsos_change_together():
    body = shaped(generator.generate(6, 3), torso="box", head="round", scale=2.0, length=1.5)
    box, head = body.torso.solids
    assert box.shape == "box" and box.size[0] == pytest.approx(2.0 * 1.5 * 0.85 * 0.3) and head.shape == "ellipsoid"
    assert body.torso.standing_height == pytest.approx(0.8)


def test_errors_are_one_line():
    with refused("unknown torso 'ball' (there are: box, capsule, own)"):
        shaped(generator.generate(6, 3), torso="ball")
    with refused("torso: leaper has a torso of its own form, which takes no other, no head and no tail"):
        shaped(ROBOTS["leaper"], head="round")


def test_heads_and_tails_are_where_the_torso_is():
    body = generator.generate(4, 2)
    placed_parts = []
    for position in ((0.0, 0.0, 0.0), (-0.2, 0.01, 0.15)):
        chassis = body.torso.solids[0].replace(shape="box", size=(0.3, 0.1, 0.05), position=position)
        other_body = body.replace(torso=body.torso.replace(solids=(chassis,)))
        parts = []
        for head, tail in (("round", "short"), ("long", "long")):
            parts += shaped(other_body, head=head, tail=tail).torso.solids[1:]
        placed_parts.append(np.array([solid.position for solid in parts]))
    centered, moved = placed_parts
    assert_allclose(moved[0], (0.1, 0.01, 0.19))
    assert_allclose(moved - centered, np.tile((-0.2, 0.01, 0.15), (4, 1)))


@pytest.mark.parametrize(
    ("shape", "size", "euler_deg", "extents"),
    [
        ("ellipsoid", (0.3, 0.2, 0.1), (0.0, 0.0, 0.0), (0.3, 0.2, 0.1)),
        ("box", (0.3, 0.2, 0.1), (0.0, 0.0, 90.0), (0.2, 0.3, 0.1)),
        ("sphere", (0.2,), (0.0, 30.0, 0.0), (0.2, 0.2, 0.2)),
        ("capsule", (0.1, 0.2), (0.0, 0.0, 0.0), (0.1, 0.1, 0.3)),
        ("capsule", (0.1, 0.2), (0.0, 90.0, 0.0), (0.3, 0.1, 0.1)),
        ("cylinder", (0.1, 0.2), (90.0, 0.0, 0.0), (0.1, 0.2, 0.1)),
        ("cylinder", (0.1, 0.2), (0.0, 0.0, 45.0), (0.1, 0.1, 0.2)),
        ("ellipsoid", (0.3, 0.1, 0.1), (0.0, 0.0, 45.0), (math.sqrt(0.05), math.sqrt(0.05), 0.1)),
    ],
)
def test_descriptions_tell_how_far_a_torso_reaches(shape, size, euler_deg, extents):
    """Along the torso's axes, in heights."""
    body = generator.generate(4, 2)
    solid = Solid(name="chassis", shape=shape, size=size, euler_deg=euler_deg)
    body = body.replace(torso=body.torso.replace(solids=(solid,)))
    described = body_description(Setup.of(body, "walk").definition).torso[1:4] * body.torso.standing_height
    assert_allclose(described, extents, rtol=1e-6)
