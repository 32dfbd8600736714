"""The standing pose is measured on the body that is built."""

import mujoco
import numpy as np
import pytest

import arc_suite
from arc_suite import models
from arc_suite.bodies import generator
from arc_suite.models import direct, standing
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec_files import EXAMPLES, load_body

BODIES = [*ROBOTS.values(), *map(load_body, EXAMPLES), *map(generator.random_body, range(5))]

# What the mechanics of a pose follow from.
FIELDS = ("body_mass", "body_inertia", "body_ipos", "body_iquat", "body_pos", "body_quat", "body_parentid")
FIELDS += ("jnt_type", "jnt_axis", "jnt_pos", "jnt_bodyid", "qpos0")


@pytest.mark.slow
@pytest.mark.parametrize("body", BODIES, ids=lambda body: body.name)
def test_what_stands_is_what_is_built(body):
    built = mujoco.MjModel.from_xml_string(models.assemble(body).to_xml_string())
    stands = standing.compile_body(body)
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(stands, field), getattr(built, field), err_msg=field)
    names = [[model.body(i).name for i in range(model.nbody)] for model in (stands, built)]
    assert names[0] == names[1]


def test_a_body_is_built_once_to_be_loaded(monkeypatch):
    built = []
    build = direct.on_flat_ground
    monkeypatch.setattr(direct, "on_flat_ground", lambda body: built.append(body.name) or build(body))
    arc_suite.load(generator.random_body(4711), "walk")
    assert built == ["random_4711"]
