"""One control step from recorded states, in double precision: MJX and MuJoCo's C agree."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from conftest import WORLDS, recorded, stepped
from mujoco import mjx as upstream
from mujoco.mjx._src import collision_driver

from arc_suite.bodies import generator
from arc_suite.learning.worlds import device, mjx

CAPSULE = collision_driver.GeomType.PLANE, collision_driver.GeomType.CAPSULE
BODIES = {name: name for name in ("leaper", "queen", "bastion", "tick")} | {"random": generator.random_body(3)}


@pytest.fixture
def frames_of_c(monkeypatch):
    """Turn contact frames of capsules on planes as MuJoCo's C does: along the capsule, however steep it is.

    MJX 3.17 takes a fixed direction where the capsule is within 30 degrees of the plane's normal.
    """
    original = collision_driver._COLLISION_FUNC[CAPSULE]

    def turned(model, data, key, geoms):
        distance, position, frame = original(model, data, key, geoms)
        normal, axis = frame[:, 0], jnp.repeat(data.geom_xmat[geoms[:, 1], :, 2], original.ncon, axis=0)
        along = axis - normal * (normal * axis).sum(axis=-1, keepdims=True)
        along = along / jnp.linalg.norm(along, axis=-1, keepdims=True)
        return distance, position, jnp.stack([normal, along, jnp.cross(normal, along)], axis=1)

    turned.ncon = original.ncon
    monkeypatch.setitem(collision_driver._COLLISION_FUNC, CAPSULE, turned)


@pytest.mark.parametrize("body", BODIES)
def test_one_control_step(body, frames_of_c):
    with jax.enable_x64(True):
        env = mjx.load(BODIES[body], "walk", num_starts=WORLDS)
        start, step = jax.jit(jax.vmap(env.start)), jax.jit(jax.vmap(env.step))
        begun, places, terms = start(jnp.arange(WORLDS)), [], []
        preset = "tuned" if body != "random" else "medium"
        for count, before, action, environments, _, reward in recorded(BODIES[body], preset):
            state = stepped(env, begun, step, count, before, action)

            theirs = environments.batch.data
            places.append(abs(state.data.qpos - theirs.qpos).max(axis=-1))
            for name, term in environments.task.terms.items():
                terms.append(abs(state.metrics[f"reward_{name}"] - term))
            # Positions of bodies stand one substep behind, as in C.
            seen = device.select_fields(state.data, ("xpos",))
            assert np.median(abs(seen.xpos - theirs.xpos).max(axis=(-2, -1))) <= 1e-9
            assert np.median(abs(state.reward - reward)) <= 1e-8
            np.testing.assert_array_equal(state.data.time, (count + 1) * env.dt)
        assert state.data.qpos.dtype == np.float64
        assert state.data.impl == upstream.Impl.JAX
    assert np.mean(np.array(places) <= 1e-9) >= 0.95, np.array(places)
    assert np.mean(np.array(terms) <= 1e-8) >= 0.95, np.max(terms)
