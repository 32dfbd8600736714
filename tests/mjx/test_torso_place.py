"""Readings of a robot whose root frame lies on the floor: the same on JAX as in one simulation."""

import types

import imports
import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from arc_suite.envs.prepare import prepare_task
from arc_suite.learning.worlds import device, mjx


@pytest.mark.parametrize("name", ["walk", "directed"])
def test_readings_have_the_torsos_place(name):
    task, model = prepare_task(imports.on_its_floor(), name)
    data, random = mujoco.MjData(model), np.random.default_rng(0)
    data.qpos[:] = random.normal(size=model.nq)
    data.qpos[3:7] /= np.linalg.norm(data.qpos[3:7])
    data.qvel[:] = random.normal(size=model.nv)
    mujoco.mj_forward(model, data)
    with jax.enable_x64(True):
        fields = types.SimpleNamespace(**{field: jnp.array(getattr(data, field)) for field in task.reads})
        found = jax.jit(lambda **fields: task.read(types.SimpleNamespace(**fields)))(**vars(fields))
        for part, expected in zip(jax.tree.leaves(found), jax.tree.leaves(task.read(data)), strict=True):
            np.testing.assert_allclose(part, expected, atol=1e-9)


def test_worlds_have_the_fields_of_these_readings():
    environment = mjx.load(imports.on_its_floor(), "walk", num_starts=1)
    fields = device.select_fields(environment.start(0).data, environment.task.reads)
    assert fields.xquat.shape == (environment.mj_model.nbody, 4)
