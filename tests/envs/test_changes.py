"""Model fields and settings change while environments run: one environment equals a vector, or raises an error."""

import itertools
import pickle
from pathlib import Path

import gymnasium
import imageio.v3 as imageio
import imports
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv
from refusals import refused
from tiers import tiers, turns

import arc_suite
from arc_suite import motions
from arc_suite.bodies import BodiesEnv
from arc_suite.envs.gym import Env
from arc_suite.envs.vector import VectorEnv
from arc_suite.simulation.model import CONTACT_PROPERTIES, FIELDS, compile_model, field
from arc_suite.tasks import TASKS

NUM_ENVS, SHORT = 3, {"time_limit": 1.0}
SOME = np.array([True, False, True])
MODEL = {"gravity": (0.0, 0.0, -4.0), "friction": 1e-3, "body_mass": 2.0}


def both(task, **settings):
    vector = VectorEnv("tick", task, NUM_ENVS, 2, "SameStep", task_kwargs=SHORT | settings)
    singles = [Env("tick", task, SHORT | settings) for _ in range(NUM_ENVS)]
    vector.reset(seed=3)
    for index, single in enumerate(singles):
        single.reset(seed=3 + index)
    return vector, singles


def change(vector, singles, call, values, mask):
    getattr(vector, call)(values, mask)
    for single, there in zip(singles, mask, strict=True):
        if there:
            getattr(single, call)(values)


def assert_steps_are_equal(vector, singles, actions):
    for action in actions:
        observations, rewards, *ends, _ = vector.step(action)
        for index, single in enumerate(singles):
            observation, reward, terminated, truncated, _ = single.step(action[index])
            if terminated or truncated:
                observation, _ = single.reset()
            np.testing.assert_array_equal(observations[index], observation)
            assert (rewards[index], ends[0][index], ends[1][index]) == (reward, terminated, truncated)


@pytest.mark.parametrize("task", ["walk", "shoved", "rough", "navigate"])
def test_one_is_a_vector_over_resets_pickles_and_snapshots(task):
    vector, singles = both(task)
    actions = np.random.default_rng(0).uniform(-0.5, 0.5, (80, NUM_ENVS, 18)).astype(np.float32)
    change(vector, singles, "change_model", MODEL, SOME)
    change(vector, singles, "change_settings", {"weights": {"control": 0.0}, "gait_frequency": 2.0}, ~SOME)
    assert_steps_are_equal(vector, singles, actions[:30])
    vector, singles = pickle.loads(pickle.dumps((vector, singles)))
    change(vector, singles, "change_settings", {"duty_factor": 0.7}, SOME)
    assert_steps_are_equal(vector, singles, actions[30:50])
    again, alone = both(task)
    again.restore(vector.snapshot())
    for single, fresh in zip(singles, alone, strict=True):
        fresh.restore(single.snapshot())
    assert_steps_are_equal(again, alone, actions[50:])


def test_different_bodies_change_too():
    bodies = BodiesEnv("walk", 4, "varied:0-1", task_kwargs=SHORT)
    twin = BodiesEnv("walk", 4, "varied:0-1", task_kwargs=SHORT)
    action = np.zeros(bodies.action_space.shape)
    for each in (bodies, twin):
        each.reset(seed=0)
    bodies.change_model({"gravity": (0.0, 0.0, 0.0)}, np.array([True, False, False, False]))
    bodies.change_settings({"weights": {"healthy": 0.0}}, np.array([False, True, False, False]))
    bodies.reset(seed=0), twin.reset(seed=0)
    for _ in range(10):
        rewards, plain = bodies.step(action)[1], twin.step(action)[1]
    assert rewards[1] == pytest.approx(plain[1] - 1.0)
    assert (rewards == plain).tolist() == [False, False, True, True]


def test_different_bodies_take_a_value_of_each_environment():
    """As `VectorEnv` does; bodies 0 and 2 are one batch, 1 and 3 are others."""
    bodies = BodiesEnv("walk", 4, ["queen", "leaper", "tick", "bastion"])
    frictions = np.array([0.2, 0.4, 0.6, 0.8])
    bodies.change_model({"friction": frictions, "gravity": np.outer(frictions, (0.0, 0.0, -9.0))})
    for group, indices, _ in bodies._places:
        for model, index in zip(group.batch.models, indices, strict=True):
            assert (model.pair_friction[:, :2] == frictions[index]).all()
            assert model.opt.gravity[2] == pytest.approx(-9.0 * frictions[index])
    bodies.change_model({"friction": 0.5})
    assert all(
        (model.pair_friction[:, 0] == 0.5).all() for place in bodies._places for model in place.group.batch.models
    )
    with pytest.raises(ValueError, match=r"^model field 'friction': expected 4 values, one of each environment, got "):
        bodies.change_model({"friction": [0.2, 0.4, 0.6]})


GEOMS = [name for name in FIELDS if name.startswith("geom_")]


@pytest.mark.parametrize("name", [name for name in FIELDS if name not in GEOMS])
def test_every_field_moves_what_follows(name):
    """Limits and biases of actuators are those of servos."""
    observations, body = [], imports.hexapod() if name in ("jnt_actfrcrange", "actuator_biasprm") else "tick"
    for change in (False, True):
        environment = Env(body, "walk", {"base_noise": 0.0})
        environment.reset(seed=0)
        value = field(environment.unwrapped._env.physics.model.ptr, name)
        other = (0.6, 0.0, 0.0, 0.8) if name == "body_iquat" else 0.5 * value + 0.01
        environment.change_model({name: other} if change else {})
        observations.append([environment.step(np.full(18, 0.1, np.float32))[0] for _ in range(10)])
    assert not np.array_equal(*observations)


CONTACTS = {"friction": 0.05, "solref": (0.2, 1.0), "solimp": (0.1, 0.2, 0.01, 0.5, 2.0), "margin": 0.05}
PARTLY = ("stairs", "gaps", "course", "leap", "navigate")  # tasks in which contacts with boxes or pillars read geoms


@pytest.mark.parametrize(
    ("name", "task"),
    tiers(
        itertools.product(CONTACT_PROPERTIES, TASKS),
        lambda name, task: task in ("walk", "stairs"),
        turns(CONTACT_PROPERTIES, TASKS),
    ),
)
def test_properties_of_contacts_move_every_task(task, name):
    """They write all that contacts read; a field of some contacts alone is refused, or of none."""
    with_all, with_both, without = (arc_suite.load("tick", task, {"random": 2}) for _ in range(3))
    observations = []
    for environment in (with_all, with_both, without):
        environment.reset()
        if environment is with_all:
            environment.change_model({name: CONTACTS[name]})
        elif environment is with_both:
            geoms = {f"geom_{name}": 0.5 * CONTACTS[name] if name == "margin" else CONTACTS[name]}
            environment.change_model({f"pair_{name}": CONTACTS[name]} | (geoms if task in PARTLY else {}))
        actions = np.random.default_rng(1).uniform(-0.5, 0.5, (15, 18))
        observations.append([environment.step(action).observation["posture"] for action in actions])
    assert not np.array_equal(observations[0], observations[2])
    if name != "friction":  # fields of friction have torsional and rolling friction, too
        np.testing.assert_array_equal(observations[0], observations[1])
    if task in PARTLY:
        with refused(f"model field 'pair_{name}': contacts of this model read geom_{name}, too; change {name}"):
            without.change_model({f"pair_{name}": 0.5})
        with refused(f"model field 'geom_{name}': contacts of this model read pair_{name}, too; change {name}"):
            without.change_model({f"geom_{name}": 0.5})
    else:
        with refused(f"model field 'geom_{name}': contacts of this model read pair_{name}; change {name}"):
            without.change_model({f"geom_{name}": 0.5})


def test_friction_leaves_what_modifiers_draw_of_other_fields():
    """Torsional and rolling friction are the compiled ones, in one environment and in a vector."""
    vector, singles = both("gaps", friction=(0.5, 2.0), mass=(0.5, 2.0))
    frictions = np.array([0.1, 0.2, 0.3])
    vector.change_model({"friction": frictions})
    for single, friction in zip(singles, frictions, strict=True):
        single.change_model({"friction": friction})
    actions = np.random.default_rng(0).uniform(-0.5, 0.5, (60, NUM_ENVS, 18)).astype(np.float32)
    assert_steps_are_equal(vector, singles, actions)
    compiled = compile_model(vector.task.scene.body, vector.task.scene.arena)
    for model, friction in zip(vector.batch.models, frictions, strict=True):
        np.testing.assert_array_equal(model.pair_friction[:, :2], friction)
        np.testing.assert_array_equal(model.pair_friction[:, 2:], compiled.pair_friction[:, 2:])
        np.testing.assert_array_equal(model.geom_friction[:, 0], friction)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"body_mas": 1.0}, "unknown model field 'body_mas'; did you mean 'body_mass'? (there are: gravity, "),
        ({"geom_friction": 1.0}, "model field 'geom_friction': contacts of this model read pair_friction; change fric"),
        ({"friction": 1.0, "pair_friction": 1.0}, "model field 'pair_friction': friction changes it, too; leave one "),
        ({"friction": -1.0}, "model field 'friction': expected numbers from 0 to 1e+06, got -1.0"),
        ({"jnt_actfrcrange": 1.0}, "model field 'jnt_actfrcrange': torques of this model have no limits of joints"),
        ({"actuator_biasprm": 1.0}, "model field 'actuator_biasprm': motors of this model have no bias; servos have"),
        ({"gravity": (1.0, 2.0)}, "model field 'gravity': expected numbers of shape (3,), got (1.0, 2.0)"),
        ({"body_mass": 0.0}, "model field 'body_mass': expected numbers from 0 to 1e+06, above 0 where the model's"),
        ({"gravity": np.nan}, "model field 'gravity': expected numbers from -1e+06 to 1e+06, got nan"),
        ({"body_iquat": 1.0}, "model field 'body_iquat': expected quaternions of length 1, got 1.0"),
        ([1], "model: expected a mapping of names to values, got [1]"),
    ],
)
def test_fields_that_do_not_fit(fields, message):
    vector, singles = both("walk")
    for each in (singles[0], arc_suite.load("tick", "walk")):
        with refused(message, begins=True):
            each.change_model(fields)
    with refused(message.replace("(3,)", "(3, 3)"), begins=True):
        vector.change_model(fields)


def test_models_of_a_vector_are_read_only():
    vector, _ = both("walk")
    model = vector.batch.models[0]
    with pytest.raises(ValueError, match="read-only"):
        model.opt.gravity[:] = 0.0
    with pytest.raises(ValueError, match="read-only"):
        model.pair_friction *= 0.5
    with refused("cannot set 'timestep': models are read-only; use change_model of the environments", AttributeError):
        model.opt.timestep = 1.0


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"time_limit": 3.0}, "setting 'time_limit': environments keep it; open another environment"),
        ({"random": 3}, "setting 'random': environments keep it; reset(seed=...) begins a stream"),
        ({"dificulty": 1}, "unknown setting of rough 'dificulty'; did you mean 'difficulty'?"),
        ({"difficulty": 1.0}, "settings 'difficulty': they would change the ground, which environments keep; open "),
        ({"kicks": 1.0}, "settings 'kicks': they would change the motors, senses or kicks, which environments keep;"),
        ({"gait_frequency": "fast"}, "gait_frequency: expected a "),
    ],
)
def test_settings_that_do_not_fit(settings, message):
    for each in (*both("rough")[1][:1], both("rough")[0], arc_suite.load("tick", "rough")):
        with refused(message, begins=True):
            each.change_settings(settings)


def test_a_curriculum_neither_begins_nor_ends():
    settings = {"commands": {"forward": [-1.0, 2.0]}, "curriculum": True}
    vector, singles = both("steer")
    widening = arc_suite.load("tick", "steer", settings)
    cases = ((vector, settings), (singles[0], settings), (widening, {"curriculum": False}))
    for environment, changes in cases:
        message = "they would change the curriculum, which environments keep; open another environment with them"
        with pytest.raises(ValueError, match=message):
            environment.change_settings(changes)
        environment.reset()
    widening.change_settings({"curriculum": True, "level": 3})
    widening.reset()
    assert widening.task.progress["level"] == 3.0


def test_settings_hold_from_the_next_reset_on():
    single = Env("tick", "walk")
    single.reset(seed=0)
    single.change_settings({"target_velocity": 0.5})
    assert single.task.definition.target_velocity == 0.33
    single.reset()
    assert single.task.definition.target_velocity == 0.5


def test_attributes_that_nothing_reads_are_errors():
    vector, (single, *_) = both("walk")
    runs = arc_suite.load("tick", "walk")
    message = "cannot set '{}': there is no such attribute; change_settings of the environment changes settings"
    for each in (vector, vector.task, single, single.task, runs, runs.task):
        for name in ("target_velocity", "nonsense"):
            with refused(message.format(name), AttributeError):
                setattr(each, name, 1)
    for each in (vector, SyncVectorEnv([lambda: gymnasium.make("arc_suite/tick-walk-v0")])):
        with refused(message.format("target_velocity"), AttributeError):
            each.set_attr("target_velocity", 0.5)


def test_environments_of_gymnasium_take_changes():
    make = lambda: gymnasium.make("arc_suite/tick-walk-v0")  # noqa: E731
    rewards = []
    for vector in (SyncVectorEnv([make] * 2), AsyncVectorEnv([make] * 2)):
        vector.reset(seed=0)
        vector.call("change_settings", {"weights": {"forward": 0.0}})
        vector.call("change_model", {"gravity": (0.0, 0.0, -1.0)})
        vector.reset(seed=0)
        rewards.append(vector.step(np.zeros((2, 18), np.float32))[1])
        vector.close()
    np.testing.assert_array_equal(*rewards)
    own = VectorEnv("tick", "walk", 2)
    own.call("change_settings", {"weights": {"forward": 0.0}})
    own.call("change_model", {"gravity": (0.0, 0.0, -1.0)})
    own.reset(seed=0)
    np.testing.assert_array_equal(own.step(np.zeros((2, 18)))[1], rewards[0])


def test_one_environment_and_a_vector_of_one_share_snapshots():
    single, vector, action = Env("tick", "steer"), VectorEnv("tick", "steer", 1), np.full(18, 0.2, np.float32)
    single.reset(seed=7)
    for _ in range(5):
        single.step(action)
    arrays = single.snapshot()
    vector.restore(arrays)
    expected = single.step(action)
    found = vector.step(action[None])
    np.testing.assert_array_equal(found[0][0], expected[0])
    assert found[1][0] == expected[1]
    back = arc_suite.load("tick", "steer")
    back.restore(vector.snapshot())
    assert back.step(action).reward == single.step(action)[1]


@pytest.mark.parametrize("task", TASKS)
def test_one_environment_goes_back(task):
    single = Env("tick", task, {"time_limit": 0.5})
    actions = np.random.default_rng(0).uniform(-0.5, 0.5, (25, 18)).astype(np.float32)
    single.reset(seed=1)
    for action in actions[:3]:
        single.step(action)
    arrays, runs = single.snapshot(), []
    for _ in range(2):
        single.restore(arrays)
        run = []
        for action in actions[3:]:
            observation, reward, terminated, truncated, _ = single.step(action)
            run.append(np.append(observation, reward))
            if terminated or truncated:
                run.append(np.append(single.reset()[0], 0.0))
        runs.append(run)
    np.testing.assert_array_equal(*runs)


@pytest.mark.parametrize("name", ["memory/2", "memory/6", "steps", "stream/0/0"])
@pytest.mark.parametrize("value", [1e300, 10**15])
def test_snapshots_with_nonsense_are_refused(name, value):
    single = Env("tick", "rough", {"curriculum": True})
    single.reset(seed=0)
    arrays = single.snapshot()
    if arrays[name].dtype.kind != "f" and value > 1e18:
        value = 10**18
    arrays[name] = np.full_like(arrays[name], value)
    with pytest.raises(ValueError, match=r": expected finite numbers of at most 1e\+10$"):
        single.restore(arrays)


@pytest.mark.parametrize("text", ['{"arena": "os:path"}', "[" * 9000, '{"nothing": 1}', "3", "{"])
def test_settings_of_a_snapshot_are_checked(text):
    single = Env("tick", "walk")
    single.reset(seed=0)
    names = "settings/present", "settings/next"
    with pytest.raises(ValueError, match="^snapshot: of another setup or number of environments: "):
        single.restore(single.snapshot() | {name: np.array([text]) for name in names})


def test_resets_without_steps_leave_a_curriculum_where_it_is():
    level = lambda env: env.task.memory.ground.level  # noqa: E731
    single = Env("tick", "rough", {"curriculum": True, "level": 5})
    single.reset(seed=0)
    levels = []
    for steps in (0, 0, 1, 13):  # a cycle of the gait takes 13.3 steps
        for _ in range(steps):
            single.step(np.zeros(18, np.float32))
        single.reset()
        levels.append(level(single))
    assert levels == [5, 5, 5, 5]
    for _ in range(14):
        single.step(np.zeros(18, np.float32))
    single.reset()
    assert level(single) == 4
    single.change_settings({"level": 8})
    single.reset()
    assert level(single) == 8


def test_options_of_reset():
    for vector in (VectorEnv("tick", "walk", 2), BodiesEnv("walk", 2)):
        with refused("unknown option of reset 'reset_masks'; did you mean 'reset_mask'? (there are: reset_mask)"):
            vector.reset(options={"reset_masks": [True, False]})
    with refused("unknown option of reset 'reset_mask': one environment has none; vector ones have reset_mask"):
        gymnasium.make("arc_suite/tick-walk-v0").reset(options={"reset_mask": 1})


@pytest.mark.parametrize("make", [gymnasium.make, gymnasium.make_vec])
def test_more_steps_than_an_episode_has(make):
    needed = "longer ones need task_kwargs={'time_limit': 150}, too"
    with refused(f"max_episode_steps: episodes of this task end after 1000 steps, got 3000; {needed}"):
        make("arc_suite/tick-walk-v0", max_episode_steps=3000)
    longer = make("arc_suite/tick-walk-v0", max_episode_steps=3000, task_kwargs={"time_limit": 150.0})
    steps = longer.spec.max_episode_steps if make is gymnasium.make else longer.step_limit
    assert steps == 3000
    assert make("arc_suite/tick-walk-v0", task_kwargs={"time_limit": 2.0})


def test_a_renderer_of_the_user_has_room():
    buffer = arc_suite.load("tick", "walk").physics.model.ptr.vis.global_
    assert buffer.offwidth >= 1920 and buffer.offheight >= 1080  # `mujoco.Renderer` refuses more than that


def test_progress_before_a_reset():
    with refused("no episode has begun; call reset first", RuntimeError):
        _ = arc_suite.load("tick", "walk").task.progress


def test_seeds_that_go_on_beyond_the_last_one():
    for vector in (VectorEnv("tick", "walk", 3), BodiesEnv("walk", 3)):
        with refused("seed: expected an integer from 0 to 4294967293, got 4294967294"):
            vector.reset(seed=2**32 - 2)
        vector.reset(seed=2**32 - 3)


def test_too_many_environments_of_different_bodies():
    with refused("num_envs: expected an integer from 1 to 1048576, got 1000000000"):
        BodiesEnv("walk", 10**9, "varied:0-1")


def settings_of_next_episode(environment):
    """Return the settings of an environment's episodes after the next reset."""
    environment.reset()
    definition = environment.task.definition
    return definition.settings


@pytest.mark.parametrize("make", [arc_suite.load, Env, lambda *setup: VectorEnv(*setup[:2], 2, task_kwargs=setup[2])])
def test_settings_are_those_of_the_opening_whatever_the_caller_changes(make):
    settings = {"weights": {"forward": 1.5}}
    environment = make("queen", "walk", settings)
    environment.reset()
    settings["weights"]["forward"] = 7.0
    environment.change_settings({"gait": "ripple"})
    assert settings_of_next_episode(environment).weights["forward"] == 1.5


def test_files_of_the_opening_need_not_stay(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    imageio.imwrite("hill.png", np.arange(64, dtype=np.uint8).reshape(8, 8))
    walk = arc_suite.load("queen", "mimic", {"motion": "walk"}).task.definition.settings.motions[0]
    motions.save(walk, "pace.npz")
    hill, pace = {"arena": "hill.png:20x20x0.2"}, {"motion": "pace.npz"}
    walking = [arc_suite.load("queen", "walk", hill), VectorEnv("queen", "walk", 2, task_kwargs=hill)]
    following = arc_suite.load("queen", "mimic", pace)
    Path("hill.png").unlink(), Path("pace.npz").unlink()
    arena = walking[0].task.scene.arena
    for environment in walking:
        environment.change_settings({"gait": "ripple"})
        assert settings_of_next_episode(environment).parameters.duty_factor > 0.7
        assert environment.task.definition.scene.arena == arena
    following.change_settings({"both_sides": False})
    assert settings_of_next_episode(following).motions[0].name == walk.name


def test_noise_of_level_0_is_none():
    noise = {"posture": 0.0, "velocities": 1.0}
    environment = VectorEnv("queen", "walk", 2, task_kwargs={"observation_noise": noise, "random": 0})
    same = VectorEnv("queen", "walk", 2, task_kwargs={"observation_noise": {"velocities": 1.0}, "random": 0})
    observations = []
    for vector in (environment, same):
        vector.reset()
        vector.change_settings({"observation_noise": {"velocities": 2.0}}, mask=[False, True])
        observations.append(vector.reset()[0])
    np.testing.assert_array_equal(*observations)


def test_attributes_of_arrays_are_compared_as_a_whole():
    environment = VectorEnv("queen", "walk", 2)
    with refused("set_attr 'render_mode': environments share it; expected one value for all", begins=True):
        environment.set_attr("render_mode", ["a", np.array([1, 2])])
    with refused("set_attr 'step_limit': environments share it; expected one value for all", begins=True):
        environment.set_attr("step_limit", [np.array([1, 2]), np.array([1, 3])])
    environment.set_attr("step_limit", [np.array([7, 8]), np.array([7, 8])])
    assert environment.step_limit.tolist() == [7, 8]
