"""A batch does what one simulation does, bit by bit, and what only a batch can."""

import pickle

import mujoco
import numpy as np
import pytest
from fixtures.obstacles import Obstacle
from numpy.testing import assert_array_equal
from tiers import tiers

from arc_suite.arenas import ARENAS
from arc_suite.robots import ROBOTS
from arc_suite.simulation.batch import Batch
from arc_suite.simulation.model import compile_model
from arc_suite.simulation.physics import Physics

NUM_ENVS = 3
ALL = np.ones(NUM_ENVS, bool)
SOME = np.array([True, False, True])


def starts(model, seed=0):
    """Positions and velocities of environments that are about to fall."""
    random = np.random.RandomState(seed)
    qpos = np.tile(model.qpos0, (NUM_ENVS, 1))
    qpos[:, 7:] += random.uniform(-0.2, 0.2, (NUM_ENVS, model.nq - 7))
    return qpos, random.uniform(-0.5, 0.5, (NUM_ENVS, model.nv))


def begin(physics, qpos, qvel):
    with physics.reset_context():
        physics.data.qpos[:], physics.data.qvel[:] = qpos, qvel


def assert_same(batch, index, physics):
    for name, array in vars(batch.data).items():
        assert array[index].tobytes() == getattr(physics.data.ptr, name).tobytes(), name


@pytest.mark.parametrize("threads", tiers((1, 2), lambda threads: threads == 2))
@pytest.mark.parametrize("arena", tiers(ARENAS, lambda arena: arena in ("flat", "bumps")))
def test_environments_are_simulations(arena, threads):
    body = ROBOTS["leaper"]
    arena = ARENAS[arena](body)
    singles = [Physics.from_body(body, arena) for _ in range(NUM_ENVS)]
    batch = Batch(compile_model(body, arena), NUM_ENVS, threads)
    states = starts(compile_model(body, arena))
    batch.reset(ALL, *states)
    for physics, *state in zip(singles, *states, strict=True):
        begin(physics, *state)
    for action in np.random.RandomState(1).uniform(-1.0, 1.0, (20, NUM_ENVS, batch.data.ctrl.shape[1])):
        batch.data.ctrl[...] = action
        assert not batch.step(25, ALL).any()
        for index, physics in enumerate(singles):
            physics.set_control(action[index])
            physics.step(25)
            assert_same(batch, index, physics)


def test_data_has_the_fields_asked_for_and_those_that_are_written():
    model = compile_model(ROBOTS["tick"])
    batch = Batch(model, NUM_ENVS, fields=("site_xpos", "qvel"))
    assert set(vars(batch.data)) == {"qpos", "qvel", "ctrl", "site_xpos"}
    batch.reset(ALL, *starts(model))
    assert batch.data.site_xpos.any()
    assert set(vars(batch.part(SOME))) == set(vars(batch.data))
    assert_array_equal(batch.part(SOME).site_xpos, batch.data.site_xpos[[0, 2]])


def test_environments_are_placed_elsewhere_and_the_others_stay():
    body = ROBOTS["tick"]
    model = compile_model(body)
    batch, (qpos, qvel) = Batch(model, NUM_ENVS, 2), starts(model)
    batch.reset(ALL, qpos, qvel)
    before = {name: array.copy() for name, array in vars(batch.data).items()}
    qpos[:, 2] += 0.3
    batch.place(SOME, qpos[SOME])
    for name, array in vars(batch.data).items():
        assert_array_equal(array[1], before[name][1])
    for index in (0, 2):
        physics = Physics.from_body(body)
        begin(physics, before["qpos"][index], qvel[index])
        physics.data.qpos[:] = qpos[index]
        physics.forward()
        assert_same(batch, index, physics)
        assert not np.array_equal(batch.data.xpos[index], before["xpos"][index])


def test_obstacles_stand_where_a_reset_puts_them():
    body = ROBOTS["tick"]
    model = compile_model(body, Obstacle())
    batch = Batch(model, NUM_ENVS, 2)
    post = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "post")
    batch.reset(ALL, *starts(model))
    assert_array_equal(batch.data.xpos[:, post], [(5.0, 0.0, 0.5)] * NUM_ENVS)
    places = np.array([[(1.0, 2.0, 0.5)], [(3.0, 4.0, 0.5)]])
    batch.reset(SOME, *(state[SOME] for state in starts(model)), mocap_pos=places)
    assert_array_equal(batch.data.xpos[:, post], [(1.0, 2.0, 0.5), (5.0, 0.0, 0.5), (3.0, 4.0, 0.5)])
    batch.step(25, ALL)
    assert_array_equal(batch.data.xpos[:, post], [(1.0, 2.0, 0.5), (5.0, 0.0, 0.5), (3.0, 4.0, 0.5)])
    batch.reset(ALL, *starts(model))
    assert_array_equal(batch.data.xpos[:, post], [(5.0, 0.0, 0.5)] * NUM_ENVS)


def test_environments_have_models_of_their_own_until_their_next_reset():
    body = ROBOTS["tick"]
    model = compile_model(body)
    batch, singles, (qpos, qvel) = (
        Batch(model, NUM_ENVS, 2),
        [Physics.from_body(body) for _ in range(NUM_ENVS)],
        starts(model),
    )
    heavy = {name: 2.0 * getattr(model, name) for name in ("body_mass", "body_inertia")}
    slippery = {"pair_friction": 0.1 * model.pair_friction}
    for models in ([{}, heavy, slippery], [slippery, {}, heavy | slippery], []):
        batch.reset(ALL, qpos, qvel, models=models)
        for index, physics in enumerate(singles):
            with physics.reset_context():
                physics.change_model(models[index] if models else {})
                physics.data.qpos[:], physics.data.qvel[:] = qpos[index], qvel[index]
        for twin in (batch, pickle.loads(pickle.dumps(batch))):
            for index, physics in enumerate(singles):
                assert_same(twin, index, physics)
        batch = twin
        for _ in range(5):
            batch.step(25, ALL)
            for index, physics in enumerate(singles):
                physics.step(25)
                assert_same(batch, index, physics)
    assert not np.array_equal(batch.data.qpos[0], batch.data.qpos[1])
    plain = Batch(model, NUM_ENVS)
    plain.reset(ALL, qpos, qvel)
    for _ in range(5):
        plain.step(25, ALL)
    assert_array_equal(plain.data.qpos, batch.data.qpos)


def test_sensors_are_back_after_an_exception():
    model = compile_model(ROBOTS["tick"])
    batch, twin = Batch(model, NUM_ENVS, 1), Batch(model, NUM_ENVS, 1)
    with pytest.raises(ValueError):
        batch.step(25, np.ones(NUM_ENVS + 1, bool))
    for envs in (batch, twin):
        envs.reset(ALL, *starts(model))
        envs._simulations.step(ALL, 100)  # until feet touch
    assert_array_equal(batch.data.cfrc_ext, twin.data.cfrc_ext)
    assert batch.data.cfrc_ext.any()
