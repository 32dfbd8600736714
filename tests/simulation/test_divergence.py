"""When the physics diverges: an error or an end of the episode, never a silent restart."""

import gymnasium
import numpy as np
import pytest
from dm_control.rl.control import PhysicsError
from gymnasium.utils.env_checker import data_equivalence
from numpy.testing import assert_array_equal
from refusals import refused

import arc_suite
from arc_suite.envs.vector import VectorEnv

# What spoils a simulation, and how MuJoCo names it.
ACCIDENTS = {
    "speed": ("qvel", 5, np.nan, "Nan, Inf or huge value in QVEL at DOF 5"),
    "place": ("qpos", 9, np.inf, "Nan, Inf or huge value in QPOS at DOF 9"),
    "spin": ("qvel", 4, 9e9, "Nan, Inf or huge value in QACC at DOF "),
}
every_accident = pytest.mark.parametrize("accident", ACCIDENTS)


def spoil(data, accident, which=()):
    field, index, value, _ = ACCIDENTS[accident]
    getattr(data, field)[(*which, index)] = value


def load(robot="queen", random=0, **task_kwargs):
    return arc_suite.load(robot, "walk", {"random": random, **task_kwargs}, {"flat_observation": True})


def random_actions(shape, count, seed=0):
    return np.random.RandomState(seed).uniform(-0.5, 0.5, (count, *shape)).astype(np.float32)


@every_accident
def test_single_environment_raises_one_line_with_robot_time_and_cause(accident):
    environment, twin = load(), load()
    environment.reset(), twin.reset()
    actions = random_actions((18,), 5)
    for action in actions[:3]:
        environment.step(action), twin.step(action)
    spoil(environment.physics.data.ptr, accident)
    message = f"queen: physics diverged in the step from 0.150 s: {ACCIDENTS[accident][-1]}"
    with refused(message, PhysicsError, begins=True):
        environment.step(actions[3])
    # A reset makes good.
    assert_array_equal(environment.reset().observation["observations"], twin.reset().observation["observations"])
    one, two = environment.step(actions[4]), twin.step(actions[4])
    assert one.reward == two.reward
    assert_array_equal(one.observation["observations"], two.observation["observations"])


@every_accident
def test_single_environment_may_end_the_episode_instead(accident):
    environment, twin = load("tick", on_divergence="truncate"), load("tick")
    environment.reset(), twin.reset()
    actions = random_actions((18,), 4)
    environment.step(actions[0])
    spoil(environment.physics.data.ptr, accident)
    last = environment.step(actions[1])
    assert last.last() and last.discount == 1.0 and last.reward == 0.0
    assert np.isfinite(last.observation["observations"]).all()
    assert set(environment.task.terms.values()) == {0.0}
    first = environment.step(actions[2])
    assert first.first()
    assert_array_equal(first.observation["observations"], twin.reset().observation["observations"])
    assert environment.step(actions[3]).reward == twin.step(actions[3]).reward


def test_every_divergence_is_noticed_without_a_reset_between():
    environment = load()
    environment.reset()
    for _ in range(3):
        spoil(environment.physics.data.ptr, "speed")
        with pytest.raises(PhysicsError):
            environment.step(np.zeros(18))
        environment.task.before_step(np.zeros(18), environment.physics)
    environment.step(np.zeros(18))


@pytest.mark.parametrize("task", ["walk", "rough"])
def test_step_that_diverges_leaves_metrics_and_curriculum_alone(task):
    settings = {"random": 0, "curriculum": True} if task == "rough" else {"random": 0}
    single = arc_suite.load("queen", task, settings | {"on_divergence": "truncate"})
    batch = VectorEnv("queen", task, 2, 1, "Disabled", task_kwargs=settings)
    single.reset(), batch.reset()
    actions = random_actions((18,), 60)
    for action in actions:
        single.step(action), batch.step(np.stack([action, action]))
    metrics, outcome = single.task.progress, single.task.definition.stream_state(single.task.memory)
    spoil(single.physics.data.ptr, "speed"), spoil(batch.batch.data, "speed", (0,))
    assert single.step(actions[0]).last()
    *_, info = batch.step(np.stack([actions[0]] * 2))
    assert info["diverged"].tolist() == [True, False]
    assert single.task.progress == metrics
    assert {name: info[f"progress_{name}"][0] for name in metrics} == metrics
    assert {name: values[0] for name, values in batch.task.progress.items()} == metrics
    assert single.task.definition.stream_state(single.task.memory) == outcome
    first, others = single.reset(), batch.reset(options={"reset_mask": np.array([True, False])})[0]
    blocks = [np.ravel(block) for block in first.observation.values()]
    assert_array_equal(np.concatenate(blocks).astype(np.float32), others[0])


def test_divergence_that_raises_leaves_metrics_alone():
    environment = load()
    environment.reset()
    for action in random_actions((18,), 60):
        environment.step(action)
    metrics = environment.task.progress
    spoil(environment.physics.data.ptr, "speed")
    with pytest.raises(PhysicsError):
        environment.step(np.zeros(18))
    assert environment.task.progress == metrics


def test_unknown_answer_to_divergence():
    with pytest.raises(ValueError, match=r"^unknown on_divergence 'stop' \(there are: raise, truncate\)$"):
        load(on_divergence="stop")


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_environments_diverge_as_single_environments_that_terminate_do(mode):
    batch = gymnasium.make_vec("arc_suite/leaper-walk-v0", num_envs=3, num_threads=2, autoreset_mode=mode)
    singles = gymnasium.make_vec(
        "arc_suite/leaper-walk-v0",
        num_envs=3,
        vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": mode},
        task_kwargs={"on_divergence": "truncate"},
    )
    assert data_equivalence(batch.reset(seed=2), singles.reset(seed=2), exact=True)
    ends = 0
    for count, actions in enumerate(random_actions(batch.action_space.shape, 40)):
        if count % 3 == 0:
            accident, which = list(ACCIDENTS)[count // 3 % 3], count // 3 % 2
            spoil(batch.batch.data, accident, (which,))
            spoil(singles.envs[which].unwrapped.physics.data.ptr, accident)
        result, expected = batch.step(actions), singles.step(actions)
        told = result[4].get("final_info", result[4])
        diverged, given = (told.pop(name, np.zeros(3, bool)) for name in ("diverged", "_diverged"))
        assert_array_equal(diverged, given)
        assert_array_equal(np.flatnonzero(diverged), [which] if count % 3 == 0 and result[3][which] else [])
        assert data_equivalence(result, expected, exact=True)
        ends += diverged.sum()
    assert ends >= 10
