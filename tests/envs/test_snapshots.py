"""Snapshots: another environment continues from them bit-exactly, through a file without pickles."""

import dataclasses
import io

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from refusals import refused
from tiers import tiers, turn

import arc_suite
from arc_suite import registry
from arc_suite.bodies.environments import BodiesEnv
from arc_suite.envs.gym import Env
from arc_suite.envs.vector import VectorEnv
from arc_suite.tasks import TASKS

NUM_ENVS, LIMIT = 3, 1.5  # s: episodes end within a test
ID = "arc_suite/tick-walk-v0"
MODES = ("SameStep", "NextStep")


def envs(task="walk", mode="SameStep", robot="tick", **settings):
    return VectorEnv(robot, task, NUM_ENVS, 1, mode, task_kwargs={"time_limit": LIMIT} | settings)


def through_a_file(arrays):
    file = io.BytesIO()
    np.savez(file, **arrays)
    file.seek(0)
    with np.load(file, allow_pickle=False) as stored:
        return {name: stored[name] for name in stored.files}


def assert_equal_steps(one, other, actions):
    for action in actions:
        for mine, theirs in zip(one.step(action)[:4], other.step(action)[:4], strict=True):
            np.testing.assert_array_equal(mine, theirs)


@pytest.mark.parametrize(
    ("task", "mode"),
    tiers(
        [(task, mode) for task in TASKS for mode in MODES],
        check=lambda task, mode: task in ("walk", "gaps") and mode == "SameStep",
        test=lambda task, mode: turn(mode, MODES, list(TASKS).index(task)),
    ),
)
def test_another_environment_goes_on_to_the_bit(task, mode):
    actions = np.random.default_rng(0).uniform(-0.5, 0.5, (64, NUM_ENVS, 18))
    one, other = envs(task, mode, random=5), envs(task, mode)
    one.reset()
    for action in actions[:40]:  # so that levels and models of environments are no longer those of the start
        one.step(action)
    arrays = through_a_file(one.snapshot())
    observations = one.step(actions[40])[0]
    other.restore(arrays)
    np.testing.assert_array_equal(other.step(actions[40])[0], observations)
    assert_equal_steps(one, other, actions[41:])
    assert other.np_random_seed == one.np_random_seed == (5, 6, 7)


def test_an_environment_goes_back():
    environment = envs(random=1)
    environment.reset()
    actions = np.random.default_rng(1).uniform(-1.0, 1.0, (60, NUM_ENVS, 18))
    arrays = environment.snapshot()
    before = [environment.step(action)[0] for action in actions]
    environment.restore(arrays)
    np.testing.assert_array_equal([environment.step(action)[0] for action in actions], before)


def test_environments_that_wait_or_rest():
    one, other = envs(mode="Disabled", random=2), envs(mode="Disabled")
    one.reset()
    one.rest(np.array([False, True, False]))
    for _ in range(10):
        one.step(np.zeros((NUM_ENVS, 18)))
    other.restore(one.snapshot())
    assert_equal_steps(one, other, np.zeros((30, NUM_ENVS, 18)))


def test_a_snapshot_does_not_change():
    environment = envs(random=3)
    environment.reset()
    arrays = environment.snapshot()
    before = {name: array.copy() for name, array in arrays.items()}
    for _ in range(5):
        environment.step(np.ones((NUM_ENVS, 18)))
    assert all(np.array_equal(before[name], array, equal_nan=True) for name, array in arrays.items())


def test_before_a_reset_there_is_none():
    with pytest.raises(ResetNeeded, match=r"^cannot take a snapshot: no episode has begun; call reset first$"):
        envs().snapshot()


@pytest.mark.parametrize("other", [{"task": "steer"}, {"robot": "leaper"}])
def test_of_another_task_or_body(other):
    environment = envs()
    environment.reset()
    with pytest.raises(ValueError, match=r"^snapshot: of another setup or number of environments: ") as caught:
        envs(**other).restore(environment.snapshot())
    assert "\n" not in str(caught.value)


def other_body():
    tick = registry.body_of("tick")
    return dataclasses.replace(tick, density=1.1 * tick.density)


# Environments whose arrays have the shapes of `here`, and the fact that differs.
OTHER_SETUPS = {
    "body": ("steer", {}, "steer", {"robot": "queen"}, "body 'queen "),
    "one mass": ("walk", {}, "walk", {"robot": other_body()}, "body 'tick_"),
    "gait": ("walk", {}, "walk", {"gait": "wave"}, "parameters.duty_factor '"),
    "command": ("steer", {}, "steer", {"commands": {"forward": (0.0, 0.5)}}, "command.commands '"),
    "task": ("steer", {}, "shoved", {"kicks": 0.0}, "task 'shoved-v0', where this environment has 'steer-v0'"),
    "terrain": ("rough", {}, "rough", {"terrain_seed": 1}, "ground.terrain_seed '1', where this environment has '0'"),
    "difficulty": ("stairs", {}, "stairs", {"difficulty": 0.5}, "ground.difficulty '0.5', where"),
    "arena": ("walk", {}, "walk", {"arena": "bumps"}, "arena 'Bumps', where this environment has 'Flat'"),
    "weights": ("walk", {}, "walk", {"weights": {"forward": 2.0}}, "weights.forward '2.0', where"),
    "modifier": ("walk", {"kicks": 1.0}, "walk", {"kicks": 2.0}, "kicks.kicks '2.0', where this environment has '1.0'"),
    "time limit": ("walk", {}, "walk", {"time_limit": 3.0}, "step limit '"),
}


@pytest.mark.parametrize("kind", OTHER_SETUPS)
def test_of_another_setup_with_the_same_shapes(kind):
    task, settings, other_task, other_settings, message = OTHER_SETUPS[kind]
    here, other = envs(task, **settings), envs(other_task, **other_settings)
    other.reset()
    with refused(f"snapshot: of another setup or number of environments: {message}", begins=True):
        here.restore(other.snapshot())
    here.reset()
    here.restore(here.snapshot())


def test_single_environments_refuse_another_setup_too():
    waving, tripod = (gymnasium.make(ID, task_kwargs={"gait": gait}).unwrapped for gait in ("wave", "tripod"))
    tripod.reset(seed=0)
    with refused("snapshot: of another setup or number of environments: parameters.duty_factor '0.6'", begins=True):
        waving.restore(tripod.snapshot())
    waving.reset(seed=0)
    dm = arc_suite.load("tick", "walk", {"gait": "tripod"})
    with refused("snapshot: of another setup or number of environments: parameters.duty_factor '0.8", begins=True):
        dm.restore(waving.snapshot())
    dm.restore(tripod.snapshot())


def test_one_of_several_bodies_differs():
    several, others = (BodiesEnv("walk", 2, bodies) for bodies in (("tick", "leaper"), ("tick", "bastion")))
    others.reset()
    with refused("snapshot: of another setup or number of environments: body 'bastion ", begins=True):
        several.restore(others.snapshot())


def test_a_snapshot_of_an_earlier_version_has_no_setup():
    environment, other = envs(), envs(gait="wave")
    environment.reset()
    arrays = environment.snapshot()
    del arrays["setup/facts"], arrays["setup/indices"]
    other.restore(arrays)


def test_something_is_missing():
    environment = envs()
    environment.reset()
    arrays = environment.snapshot()
    del arrays["random/keys"]
    with pytest.raises(
        ValueError, match=r"^snapshot: of another setup or number of environments: 'random/keys' is missing$"
    ):
        envs().restore(arrays)


def changed(arrays, name, place, value):
    array = arrays[name].copy()
    array[place] = value
    return {**arrays, name: array}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda arrays: {**arrays, "batch/model_jnt_qposadr": np.full((NUM_ENVS, 19), 10**8)},
            "model_jnt_qposadr: no array",
        ),
        (
            lambda arrays: {**arrays, "batch/model_body_mass": np.ones((NUM_ENVS, 2))},
            "model_body_mass: expected float64",
        ),
        (lambda arrays: changed(arrays, "batch/state", (1, 3), np.nan), "state: expected finite numbers"),
        (lambda arrays: changed(arrays, "batch/qpos", (0, 0), np.inf), "qpos: expected finite numbers"),
        (lambda arrays: {**arrays, "batch/qpos": arrays["batch/qpos"].astype(np.float32)}, "qpos: expected float64"),
        (lambda arrays: changed(arrays, "random/positions", 2, 10**9), "random/positions: expected numbers from 0"),
        (lambda arrays: changed(arrays, "random/positions", 0, -1), "random/positions: expected numbers from 0"),
        (lambda arrays: changed(arrays, "random/normals", 0, np.nan), "random/normals: expected numbers from -64"),
        (lambda arrays: {**arrays, "random/keys": arrays["random/keys"][:, :5]}, "random/keys: expected uint32"),
        (lambda arrays: {**arrays, "memory/0": np.zeros((NUM_ENVS, 7, 7))}, "memory: expected"),
    ],
)
def test_a_snapshot_from_elsewhere_is_refused_before_anything_changes(change, message):
    environment = envs("shoved", random=4)
    environment.reset()
    arrays = environment.snapshot()
    environment.step(np.ones((NUM_ENVS, 18)))
    before = environment.snapshot()
    with refused(f"snapshot: of another setup or number of environments: {message}", begins=True):
        environment.restore(change(arrays))
    after = environment.snapshot()
    assert all(np.array_equal(array, after[name], equal_nan=True) for name, array in before.items())


def test_a_snapshot_of_directed_with_gait_and_pose_in_the_command_is_refused():
    """Earlier versions held them in the memory of the command, before that of the health."""
    environments = envs("directed", random=1)
    environments.reset()
    arrays = environments.snapshot()
    memory = [name for name in arrays if name.startswith("memory/")]
    *others, upright, fell, counts = range(len(memory) - 13)
    order = [*others, *range(len(memory) - 13, len(memory)), upright, fell, counts]
    former = arrays | {f"memory/{place}": arrays[f"memory/{index}"] for place, index in enumerate(order)}
    with refused("snapshot: of another setup or number of environments: memory: expected", begins=True):
        environments.restore(former)


def test_a_snapshot_imports_no_module_that_its_settings_name():
    environments = envs("shoved", random=1)
    environments.reset()
    environments.change_settings({"kicks": 0.5})
    arrays = environments.snapshot()
    texts = {name: array for name, array in arrays.items() if array.dtype.kind == "U"}
    assert texts
    hostile = arrays | {name: np.array(['{"strolling:wind": 1.0}'] * NUM_ENVS) for name in texts}
    line = "snapshot: of another setup or number of environments: modifier 'strolling:wind': files import nothing;"
    with refused(line, begins=True):
        environments.restore(hostile)


@pytest.mark.parametrize("kind", ["single", "gym", "vector"])
def test_a_refused_first_restore_changes_nothing(kind):
    settings = {"random": 3}
    make = {
        "single": lambda: arc_suite.load("queen", "walk", settings, {"flat_observation": True}),
        "gym": lambda: Env("queen", "walk", settings),
        "vector": lambda: VectorEnv("queen", "walk", 2, 1, task_kwargs=settings),
    }[kind]
    environment, twin = make(), make()
    with refused("snapshot: of another setup or number of environments:", begins=True):
        environment.restore({})
    with pytest.raises((RuntimeError, ResetNeeded), match="no episode has begun"):
        environment.snapshot()
    first, expected = environment.reset(), twin.reset()
    if kind == "single":
        first, expected = [[step.observation["observations"]] for step in (first, expected)]
    np.testing.assert_array_equal(first[0], expected[0])
    twin.restore(environment.snapshot())
    fresh = make()
    fresh.restore(environment.snapshot())
    actions = np.full((2, 18) if kind == "vector" else 18, 0.3)
    for _ in range(3):
        steps = [copied.step(actions) for copied in (environment, twin, fresh)]
        rewards = [step.reward if kind == "single" else step[1] for step in steps]
        np.testing.assert_array_equal(rewards[0], rewards[1])
        np.testing.assert_array_equal(rewards[0], rewards[2])


@pytest.mark.parametrize("way", ["np_random", "random"])
def test_generators_that_snapshots_do_not_hold_are_refused_by_them(way):
    environment = Env("queen", "walk", {"random": np.random.RandomState(np.random.PCG64(0))} if way == "random" else {})
    if way == "np_random":
        environment.np_random = np.random.default_rng(0)
    environment.reset()
    message = "random: snapshots hold states of MT19937 alone, got PCG64;"
    with refused(message, begins=True):
        environment.snapshot()
    with refused(message, begins=True):
        environment.restore({})
    environment.reset(seed=4)
    assert environment.snapshot()["stream_seeds"] == 4


def test_a_generator_of_ones_own_has_no_seed_anywhere():
    environment = Env("queen", "walk")
    environment.reset(seed=3)
    assert environment.np_random_seed == environment.snapshot()["stream_seeds"] == 3
    environment.unwrapped._env.task.random = np.random.RandomState(1)
    assert environment.np_random_seed == environment.snapshot()["stream_seeds"] == -1


def test_restore_forgets_the_terms_and_the_glow_of_the_abandoned_future():
    environment = arc_suite.load("queen", "walk", {"random": 0}, visualize_reward=True)
    environment.reset()
    arrays = environment.snapshot()
    picture = environment.physics.render(60, 80)
    for _ in range(5):
        environment.step(np.full(18, 0.3))
    environment.restore(arrays)
    assert environment.task.terms == {} and environment.physics.shown_reward is None
    np.testing.assert_array_equal(environment.physics.render(60, 80), picture)
    batch = VectorEnv("queen", "walk", 2, 1)
    batch.reset()
    arrays = batch.snapshot()
    batch.step(np.zeros((2, 18)))
    batch.restore(arrays)
    assert batch.task.terms == {}


@pytest.mark.parametrize("kind", ["single", "vector"])
def test_a_snapshot_has_the_users_edits_of_the_model(kind):
    """They may be written at once, or by `change_model`, and before or after another change of the same field."""
    environment = arc_suite.load("queen", "walk", {"random": 0}, {"flat_observation": True})
    environment.reset()
    arrays_before = environment.snapshot()
    environment.physics.model.body_mass[1] *= 3.0
    environment.physics.model.opt.gravity[2] *= 0.5
    arrays = environment.snapshot()
    assert {"batch/model_body_mass", "batch/lasting_body_mass", "batch/model_gravity"} <= arrays.keys()
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (30, 18))
    if kind == "single":
        other = arc_suite.load("queen", "walk", {"random": 1}, {"flat_observation": True})
    else:
        other = VectorEnv("queen", "walk", 1)
    other.restore(arrays)
    for action in actions:
        expected = environment.step(action)
        if kind == "single":
            assert other.step(action).reward == expected.reward
        else:
            assert other.step(action[None])[1] == expected.reward
    if kind == "single":  # back to before the edits, and the edits stay over resets
        mass = other.reset() and other.physics.model.body_mass[1]
        twin = arc_suite.load("queen", "walk", {"random": 0}, {"flat_observation": True})
        twin.reset()
        assert mass == 3.0 * twin.physics.model.body_mass[1]
        other.restore(arrays_before)
        assert other.physics.model.body_mass[1] == twin.physics.model.body_mass[1]
        for action in actions:
            assert other.step(action).reward == twin.step(action).reward
