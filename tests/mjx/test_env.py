"""`arc_suite.learning.worlds.mjx`: its starts, its interface and its errors."""

import subprocess
import sys

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from conftest import WORLDS, compiled
from limited import with_drives

import arc_suite
from arc_suite.bodies import generator
from arc_suite.envs.prepare import prepare_task
from arc_suite.envs.vector import VectorEnv
from arc_suite.learning.worlds import device, mjx
from arc_suite.learning.worlds.randomization import randomization_fn
from arc_suite.robots import ROBOTS
from arc_suite.tasks import privileged

ROBOT = "leaper"  # the fastest to compile


def arrays(tree):
    return [np.asarray(leaf) for leaf in jax.tree.leaves(tree)]


@pytest.mark.parametrize("task", arc_suite.TASKS_BY_DOMAIN[ROBOT])
def test_starts_are_those_of_the_suite(task):
    """Of all tasks, also of those that Warp alone simulates."""
    impl = "warp" if isinstance(reason(task), ValueError) else "jax"
    if impl == "warp":
        pytest.importorskip("warp")
    env = mjx.load(ROBOT, task, None, impl, num_starts=5, first_seed=7)
    state = jax.vmap(env.start)(jnp.arange(7, 13))
    envs = VectorEnv(ROBOT, task, 5, 1)
    observation, _ = envs.reset(seed=7)
    np.testing.assert_array_equal(state.obs[:5], observation)
    np.testing.assert_array_equal(state.obs[5], observation[0])  # they repeat
    np.testing.assert_array_equal(state.data.qpos[:5], envs.batch.data.qpos.astype(np.float32))
    np.testing.assert_array_equal(state.data.mocap_pos[:5], envs.batch.mocap_pos.astype(np.float32))
    for ours, theirs in zip(arrays(state.info["memory"]), arrays(envs._memory), strict=True):
        np.testing.assert_array_equal(ours[:5], theirs.astype(ours.dtype))


def reason(task):
    """The error of a task that MJX's own implementation cannot simulate, or None."""
    try:
        mjx.load(ROBOT, task, num_starts=1)
    except ValueError as error:
        return error
    return None


def test_a_key_draws_from_the_table():
    env = mjx.load(ROBOT, "walk", num_starts=5)
    drawn = jax.vmap(env.reset)(jax.random.split(jax.random.key(0), 100)).obs
    assert {row.tobytes() for row in np.asarray(drawn)} == {
        row.tobytes() for row in np.asarray(jax.vmap(env.start)(jnp.arange(5)).obs)
    }


def test_models_of_episodes_are_those_of_the_suite():
    settings = {"friction": (0.5, 1.0), "mass": (0.8, 1.2), "payload": (0.1, 0.4), "armature": (0.8, 1.5)}
    env = mjx.load(ROBOT, "walk", settings, num_starts=3)
    own = jax.vmap(env.start)(jnp.arange(3)).info["model"]
    envs = VectorEnv(ROBOT, "walk", 3, 1, task_kwargs=settings)
    envs.reset(seed=0)
    assert {"pair_friction", "body_mass", "body_inertia", "body_iquat", "body_invweight0", "dof_armature"} <= own.keys()
    for name, values in own.items():
        np.testing.assert_allclose(values, [getattr(model, name) for model in envs.batch.models], rtol=1e-6)


def test_privileged_observations_are_those_of_the_suite():
    settings = {"payload": (0.1, 0.4), "force": 0.3, "joint_offset": 0.05, "history": 2}
    env = mjx.load(ROBOT, "walk", settings, num_starts=3, privileged=True)
    envs = VectorEnv(ROBOT, "walk", 3, 1, task_kwargs=settings, privileged=True)
    state, (_, info) = jax.jit(jax.vmap(env.start))(jnp.arange(3)), envs.reset(seed=0)
    np.testing.assert_array_equal(state.info["privileged"], info["privileged"])
    state, info = jax.jit(jax.vmap(env.step))(state, np.zeros((3, 12))), envs.step(np.zeros((3, 12)))[-1]
    close = abs(state.info["privileged"] - info["privileged"]).max(axis=-1) < 1e-3
    assert close.sum() >= 2, "a capsule on its end takes another friction: see test_one_step"
    assert "privileged" not in mjx.load(ROBOT, "walk", num_starts=1).start(0).info


def test_privileged_observations_show_randomized_models(monkeypatch):
    """As wrappers put them in place, with what an episode draws beside them."""
    env = mjx.load(ROBOT, "walk", {"mass": (0.5, 0.8)}, num_starts=1, privileged=True)
    drawn = randomization_fn(friction=(0.5, 0.9), motor_strength=(0.5, 0.9))
    model, axes = drawn(env.mjx_model, rng=jax.random.split(jax.random.key(0), 2))
    plain, sizes = env.mjx_model, privileged.sizes(env.task)

    def start(model):
        monkeypatch.setattr(env, "_mjx_model", model)
        return env.start(0).info["privileged"]

    found = privileged.split(sizes, jax.vmap(start, in_axes=(axes,))(model))
    np.testing.assert_allclose(found["friction"][:, 0], (model.pair_friction / plain.pair_friction)[:, 0, 0], rtol=1e-6)
    gears = model.actuator_gear[..., 0] / plain.actuator_gear[:, 0]
    np.testing.assert_allclose(found["strength"], gears, rtol=1e-6)
    assert (found["mass"] < 0.8).all() and (found["armature"] == 1.0).all()


def test_interface():
    env, *_ = compiled(ROBOT)
    assert (env.dt, env.n_substeps, env.episode_length) == (0.05, 25, 1000)
    assert env.sim_dt == pytest.approx(env.dt / env.n_substeps)
    assert env.observation_size == env.task.size and env.action_size == env.mj_model.nu == 12
    assert env.unwrapped is env
    assert mjx.load(ROBOT, "walk", {"time_limit": 2.0}, num_starts=1).episode_length == 40
    body = generator.random_body(3)
    assert mjx.load(body, "steer", num_starts=1).task.scene.body == body


def test_seeds_of_four_billion():
    first = 4_000_000_000
    env = mjx.load(ROBOT, "walk", num_starts=3, first_seed=first)
    found = jax.vmap(env.start)(np.arange(first, first + 3, dtype=np.uint32)).obs
    envs = VectorEnv(ROBOT, "walk", 3, 1)
    np.testing.assert_array_equal(found, envs.reset(seed=first)[0])
    assert env.reset(jax.random.key(0)).obs in np.asarray(found)


def test_pictures_are_those_of_the_suite():
    env, start, _ = compiled(ROBOT, "steer")
    envs = VectorEnv(ROBOT, "steer", WORLDS, 1, render_mode="rgb_array", width=80, height=60)
    envs.reset(seed=0)
    (theirs,) = envs.render([2])
    (ours,) = env.render(start(np.arange(WORLDS)), height=60, width=80, index=2)
    assert ours.shape == (60, 80, 3) and ours.std() > 10.0
    assert abs(ours.astype(int) - theirs).mean() < 1.0
    with pytest.raises(ValueError, match="scene_option"):
        env.render([], scene_option=object())


def test_an_environment_that_diverges():
    _, start, step = compiled(ROBOT)
    state = start(np.arange(WORLDS))
    qvel = state.data.qvel.at[1, 3].set(jnp.nan).at[2, 0].set(1e11)
    action = jnp.zeros((WORLDS, 12))
    after = step(state.replace(data=state.data.replace(qvel=qvel)), action)
    np.testing.assert_array_equal(after.metrics["diverged"], [0.0, 1.0, 1.0, 0.0])
    np.testing.assert_array_equal(after.done, [0.0, 1.0, 1.0, 0.0])
    assert (after.reward[1:3] == 0.0).all() and (after.reward[::3] != 0.0).all()
    assert all(np.isfinite(leaf).all() for leaf in arrays((after.obs, after.metrics, after.data.qpos)))
    again = step(after, action)
    np.testing.assert_array_equal(again.metrics["diverged"], np.zeros(WORLDS))
    untouched = step(state, action)
    np.testing.assert_array_equal(after.obs[::3], untouched.obs[::3])


def test_a_live_command():
    env, start, step = compiled(ROBOT, "steer")
    state, action = start(np.arange(WORLDS)), jnp.zeros((WORLDS, 12))
    assert np.isnan(state.info["command"]).all()
    command = np.array((0.25, 0.0, -0.5), np.float32)
    asked = step(state.replace(info={**state.info, "command": state.info["command"].at[1].set(command)}), action)
    observed = env.task.split(asked.obs)["command"][:, :3]
    np.testing.assert_array_equal(observed[1], command)
    np.testing.assert_array_equal(observed[::2], env.task.split(step(state, action).obs)["command"][::2, :3])


def test_what_wrappers_add_to_a_state_stays():
    env, *_ = compiled(ROBOT)
    state = env.start(0)
    given = state.replace(metrics=state.metrics | {"reward": state.reward}, info=state.info | {"steps": state.done})
    after = jax.eval_shape(env.step, given, jnp.zeros(12))
    assert jax.tree.structure(after) == jax.tree.structure(given)


def test_randomized_models_differ_by_world():
    env, *_ = compiled(ROBOT)
    keys = jax.random.split(jax.random.key(0), 6)
    model, axes = randomization_fn(friction=(0.5, 1.5), damping=(0.9, 1.1))(env.mjx_model, rng=keys)
    multiples = model.pair_friction / env.mjx_model.pair_friction
    assert multiples.min() >= 0.5 and multiples.max() <= 1.5 and multiples.std(axis=0).min() > 0.1
    np.testing.assert_allclose(multiples.std(axis=(1, 2)), 0.0, atol=1e-6)
    assert axes.pair_friction == axes.dof_damping == 0 and axes.body_mass is None
    with pytest.raises(ValueError, match="unknown range 'mass'"):
        randomization_fn(mass=(0.5, 1.0))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"impl": "cuda"}, "unknown impl 'cuda' .*there are: jax, warp"),
        ({"task_name": "rough"}, "impl 'jax': MJX cannot simulate this model: .*; use impl='warp'"),
        ({"task_name": "stairs"}, r"impl 'jax': MJX needs place for every possible contact, here \d+, .*impl='warp'"),
        ({"task_name": "rough", "task_kwargs": {"curriculum": True}}, "task rough: expected no curriculum"),
        ({"task_kwargs": {"random": 3}}, "random: expected none"),
        ({"task_kwargs": {"on_divergence": "raise"}}, "on_divergence"),
        ({"num_starts": 0}, "num_starts: expected an integer from 1 to 16384"),
        ({"num_envs": 0}, "num_envs"),
        ({"domain_name": "quen"}, "did you mean 'queen'"),
    ],
)
def test_errors_are_one_line(arguments, message):
    with pytest.raises(ValueError, match=message) as error:
        mjx.load(**{"domain_name": ROBOT, "task_name": "walk", "num_starts": 1} | arguments)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("module", "code", "extra"),
    [
        ("mujoco.mjx", "from arc_suite.learning.worlds import mjx", "gpu"),
        ("warp", "from arc_suite.learning.worlds import mjx; mjx.load('leaper', 'walk', impl='warp')", "gpu"),
    ],
)
def test_a_missing_extra_is_one_line(module, code, extra):
    hidden = f"""
import sys
sys.modules[{module!r}] = None
try:
    {code}
except ImportError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", hidden], capture_output=True, text=True, check=True)
    assert len(done.stdout.splitlines()) == 1 and f"[{extra}]" in done.stdout


@pytest.mark.parametrize(("robot", "sizes"), [("queen", (21, 102)), ("leaper", (18, 84))])
def test_sizes_of_tables(robot, sizes):
    model = prepare_task(robot, "walk")[1]
    assert device.table_sizes(model) == sizes
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.ncon < sizes[0] and data.nefc < sizes[1]


def test_delays_of_motors_are_refused():
    """MJX would ignore them."""
    with pytest.raises(ValueError, match="delay: expected none of motors in worlds"):
        mjx.load(with_drives(ROBOTS["leaper"], delay=0.01), "walk", num_starts=1)


@pytest.mark.parametrize("impl", ["jax", "warp"])
def test_torques_fall_with_speed(impl):
    """Worlds step bodies with such motors as C does."""
    pytest.importorskip("warp" if impl == "warp" else "jax")
    body = with_drives(ROBOTS["leaper"], no_load_speed=2.0, stall=1.5)
    env = mjx.load(body, "walk", None, impl, num_starts=2, num_envs=2)
    state = jax.jit(jax.vmap(env.start))(np.arange(2))
    step = jax.jit(jax.vmap(env.step))
    environments = VectorEnv(body, "walk", 2, 1)
    environments.reset(seed=0)
    free = VectorEnv(ROBOTS["leaper"], "walk", 2, 1)
    free.reset(seed=0)
    action = np.where(np.arange(env.action_size) % 2, 0.7, -0.7) * np.ones((2, 1))
    for _ in range(2):
        state = step(state, action)
        observation, reward, *_ = environments.step(action)
        other_observation, *_ = free.step(action)
    # MJX's own implementation integrates motors at their limits more implicitly than C and Warp.
    difference = abs(np.asarray(state.obs) - observation).max()
    assert difference < 0.01 * abs(observation - other_observation).max()
    np.testing.assert_allclose(state.reward, reward, atol=1e-3)
    with pytest.raises(ValueError, match="motor_strength: expected motors whose torques do not fall with speed"):
        randomization_fn(motor_strength=(0.5, 1.0))(env.mjx_model, jax.random.split(jax.random.key(0), 2))
