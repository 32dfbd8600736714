"""Laws as pure functions: held at stops, the same under JAX, fitted to a task however it is given."""

import gymnasium
import imports
import numpy as np
import pytest
from gaitless import Stay
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused
from tiers import tiers

import arc_suite
from arc_suite.bodies import generator
from arc_suite.cpg import Demonstrator, suited_preset
from arc_suite.cpg.law import read_blocks
from arc_suite.cpg.selection import law, presets_of
from arc_suite.envs.vector import VectorEnv
from arc_suite.robots import ROBOTS
from arc_suite.tasks.suite import Rough

PRESETS = [
    ("queen", "walk", "refined"),
    (generator.generate(6, 3), "walk", "medium"),
    (generator.generate(4, 3), "walk", "straight"),
    ("tick", "steer", "steered"),
    ("leaper", "steer", "surefooted"),
    ("queen", "gaps", "sighted"),
    (generator.generate(4, 3), "stairs", "climbing"),
    ("leaper", "roam", "balanced"),
    ("queen", "leap", "leaping"),
    (imports.quadruped(), "limp", "limping"),
]


@pytest.mark.parametrize(
    ("robot", "preset"),
    tiers(
        [(robot, "steered") for robot in ROBOTS] + [("leaper", "balanced")], lambda robot, preset: robot == "bastion"
    ),
)
def test_feet_do_not_jump_at_a_stop(robot, preset):
    """At each of 20 phases of the cycle the phase is held, and feet come to rest; zeros of the clock are negative."""
    environments, count, going = VectorEnv(robot, "steer", 20, 1), 20, (1.0, 0.0, 0.3)
    task, actions = environments.task.definition, np.zeros(environments.action_space.shape)
    act, joints = law(task, presets_of(task.scene.body)[preset]), len(task.scene.body.joint_names)
    environments.reset(seed=0)
    state, before, walking = act.initial(count), None, 0.0
    for step in range(80):
        stops = np.arange(count) < step - 40
        environments.command("command", np.where(stops[:, None], 0.0, going))
        blocks = read_blocks(task.split(environments.step(actions)[0]), act.reads, joints)
        resting = ~blocks["gait_clock"].any(axis=-1)
        assert_array_equal(resting, stops)
        blocks["gait_clock"][resting] = 0.0, -0.0
        _, actions = act(state, blocks)
        held, (state, targets, _) = state.phase, act.targets(state, blocks)
        if before is not None:
            changes = abs(targets - before).max(axis=-1)
            walking = max(walking, changes[~resting].max(initial=0.0))
            assert (changes <= 1.1 * walking).all(), step
            if preset == "steered":  # balanced shifts its feet to catch the torso
                assert (changes[np.arange(count) < step - 41] <= 0.4 * walking).all(), step
        assert_array_equal(state.phase[resting], held[resting])
        before = targets
    assert resting.all() and changes[:15].max() < 1e-5 < walking


@pytest.mark.parametrize(
    ("robot", "task", "preset"),
    [*PRESETS, ("random:17", "steer", "steered"), ("random:17", "gaps", "sighted")],  # whose legs have four joints
)
def test_jit_computes_what_numpy_computes(robot, task, preset):
    jax = pytest.importorskip("jax", reason="of the extra `jax`: make check-jax")
    jax.config.update("jax_enable_x64", True)
    environments = VectorEnv(robot, task, 3, 1)
    body = environments.task.definition.scene.body
    fitted = law(environments.task.definition, presets_of(body)[preset])
    state, observation = fitted.initial(3), environments.reset(seed=0)[0]
    compiled, theirs = jax.jit(fitted.__call__), fitted.initial(3)
    for _ in range(40):
        blocks = read_blocks(environments.task.split(observation), fitted.reads, len(body.joint_names))
        state, actions = fitted(state, blocks)
        theirs, found = compiled(theirs, blocks)
        assert_allclose(np.asarray(found), actions, atol=1e-9)
        observation = environments.step(actions)[0]


def test_tasks_and_environments_are_accepted():
    settings = {"gait": "ripple", "random": 0}
    environment = arc_suite.load("queen", "steer", settings)
    environment.reset()
    environment.command("command", (1.0, 0.0, 0.0))
    blocks = environment.step(np.zeros(18)).observation
    expected = Demonstrator(environment.task.definition, "steered").act(blocks)
    settings.pop("random")
    single = gymnasium.make("arc_suite/queen-steer-v0", task_kwargs=settings)
    batch = gymnasium.make_vec("arc_suite/queen-steer-v0", num_envs=2, task_kwargs=settings)
    for given in (environment, environment.task.definition, single, single.unwrapped, batch):
        assert_array_equal(Demonstrator(given, "steered").act(blocks), expected)
    assert abs(Demonstrator("queen", "steered").act(blocks) - expected).max() > 0.01
    noisy = arc_suite.load("queen", "steer", {"gait": "ripple", "kicks": 1.0})
    assert_array_equal(Demonstrator(noisy, "steered").act(blocks), expected)


@pytest.mark.parametrize(
    ("settings", "preset", "speed", "compliance"),
    [({"target_velocity": 0.3}, "tuned", 0.3, 0.95), ({"gait_frequency": 1.0}, "refined", 0.44, 0.9)],
)
def test_presets_walk_at_the_tasks_speed_and_frequency(settings, preset, speed, compliance):
    environment = arc_suite.load("queen", "walk", settings)
    act, timestep = Demonstrator(environment, preset), environment.reset(0)
    for _ in range(300):
        timestep = environment.step(act(timestep))
    progress = environment.task.progress
    assert progress["speed"] == pytest.approx(speed, abs=0.03)
    assert progress["gait_compliance"] >= compliance


def test_who_cannot_be_fitted_is_told_in_one_line():
    still = arc_suite.load("tick", "steer", {"duty_factor": 1.0})
    message = (
        "task steer: a demonstrator needs a gait_frequency above 0 and a duty_factor between 0 and 1, got 1.5 and 1"
    )
    for preset in ("steered", "medium"):
        with refused(message):
            Demonstrator(still, preset)
    with pytest.raises(ValueError, match="^preset: expected one of Preset, float, SteppingParameters, .*, got dict$"):
        Demonstrator("tick", {})


def test_what_suits_a_task_follows_from_its_attributes(monkeypatch):
    class Ragged(Rough):
        name = "ragged"

    monkeypatch.setitem(arc_suite.tasks.TASKS, "ragged", Ragged)
    monkeypatch.setitem(arc_suite.tasks.TASKS, "stay", Stay)
    assert suited_preset(arc_suite.load("tick", "ragged").task.definition) == "climbing"
    assert suited_preset(arc_suite.load("tick", "ragged", {"kicks": 1.0}).task.definition) == "climbing"
    with pytest.raises(ValueError, match="^task stay: no demonstrator suits .* such as zero, or a preset: .*steered"):
        suited_preset(arc_suite.load("tick", "stay").task.definition)
