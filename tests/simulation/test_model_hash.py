"""The hash of a model's physics is portable, and sees every change of the physics."""

import copy
import os
import subprocess
import sys

import numpy as np
import pytest

from arc_suite import registry
from arc_suite.envs.setup import Setup
from arc_suite.simulation.model_hash import hash_physics

PROGRAM = """
import hashlib, sys, mujoco, numpy as np
from arc_suite.envs.setup import Setup
from arc_suite.simulation.model_hash import hash_physics
for robot in sys.argv[1:]:
    model = Setup.of(robot).prepare()[1]
    content = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, content)
    print(robot, hashlib.sha256(content.data).hexdigest(), hash_physics(model))
"""


@pytest.fixture(scope="module")
def model():
    return Setup.of("varied:0").prepare()[1]


@pytest.mark.parametrize("kernels", ["Nehalem", "Haswell"])
def test_it_is_the_same_with_the_kernels_of_other_processors(kernels):
    """Of OpenBLAS, whose results differ in their last bits; elsewhere the variable has no effect."""
    robots = ("queen", "leaper", "varied:0", "random:3")
    command = [sys.executable, "-c", PROGRAM, *robots]
    environment = {**os.environ, "OPENBLAS_CORETYPE": kernels}
    process = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    for line, robot in zip(process.stdout.splitlines(), robots, strict=True):
        assert line.split()[2] == Setup.of(robot).provenance()["physics_sha256"], line


def test_last_bits_and_pictures_do_not_change_it(model):
    changed = copy.copy(model)
    changed.actuator_gear *= 1.0 + 1e-14
    changed.body_quat += 1e-17
    changed.cam_pos += 1.0
    changed.geom_rgba[:] = 0.5
    assert hash_physics(changed) == hash_physics(model)


@pytest.mark.parametrize("name", ["tick", "varied:0", "random:3"])
def test_colors_do_not_change_it(name):
    body = registry.body_of(name)
    palettes = (body.palette, "moss", 7, "#3a5f2b", "#3a5f2b,#d8c48a,#ffffff,#000000,#808080")
    records = [Setup.of(body.replace(palette=palette)).provenance() for palette in palettes]
    assert len({record["body_sha256"] for record in records}) == len(palettes)
    assert len({record["physics_sha256"] for record in records}) == 1


@pytest.mark.parametrize("name", ["actuator_gear", "body_mass", "geom_size", "qpos0", "pair_friction", "jnt_range"])
def test_physics_changes_it(model, name):
    changed = copy.copy(model)
    values = getattr(changed, name)
    values[np.unravel_index(np.abs(values).argmax(), values.shape)] *= 1.0 + 1e-7
    assert hash_physics(changed) != hash_physics(model)


def test_options_change_it(model):
    changed = copy.copy(model)
    changed.opt.timestep *= 2.0
    assert hash_physics(changed) != hash_physics(model)
