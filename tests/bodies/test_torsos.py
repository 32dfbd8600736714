"""Torsos of other forms, heads and tails: bodies that stand and walk as files of them do."""

import itertools

import numpy as np
import pytest
from refusals import refused

from arc_suite.bodies import generator, torsos
from arc_suite.bodies.shaping import shaped
from arc_suite.models.outline import solid_corners
from arc_suite.models.soundness import flaws
from arc_suite.robots import ROBOTS
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
