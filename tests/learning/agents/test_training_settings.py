"""Settings of training apart from those of judging, blocks that networks leave out, and privileged critics."""

import json

import imageio.v3 as imageio
import numpy as np
import pytest
from conftest import learning
from numpy.testing import assert_allclose, assert_array_equal

from arc_suite import motions
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents.algorithms import ALGORITHMS
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.motions import striding
from arc_suite.policies import network
from arc_suite.tasks.modifiers import Kicks

STEER = Setup.of("tick", "steer", {"time_limit": 1.0})
SMALL = {"network": "perceptron", "num_envs": 4, "horizon": 8, "minibatch": 16, "epochs": 1, "hidden": 16}
CRITIC = SMALL | {"critic_blocks": ["ground", "velocity"]}
KICKS = {"kicks": 1.5, "friction": [0.5, 1.0]}


def test_a_configuration_holds_both():
    run = Configuration.of(STEER, "ppo", training=KICKS, steps=100)
    assert run.setup == STEER == run.validation
    assert run.training_setup == STEER.with_settings(KICKS | {"exclude_blocks": ["contact_forces"]})
    assert run.policy_setup == STEER.with_settings({"exclude_blocks": ["contact_forces"]})
    assert json.loads(json.dumps(run.to_dict()))["training"] == KICKS
    assert Configuration.from_dict(json.loads(json.dumps(run.to_dict()))) == run
    assert run.command.endswith(" --set=time_limit=1.0 '--train_set=friction=[0.5, 1.0]' --train_set=kicks=1.5")


def test_ground_and_motion_of_training_are_texts(tmp_path):
    """Runs go on and cards are written without the files that settings of training name."""
    level = tmp_path / "level.png"
    imageio.imwrite(level, np.tile(np.uint8([0, 200]), (8, 4)))
    run = Configuration.of(STEER, "ppo", training={"arena": f"{level}:20x20x0.1"})
    walk = tmp_path / "walk.npz"
    motions.save(striding.stride(Setup.of("tick").body, 1.5, 0.6, np.arange(6) % 2 / 2, 0.3), walk)
    mimic = Configuration.of(Setup.of("tick", "mimic", {"motion": "walk"}), "ppo", training={"motion": str(walk)})
    expected_setup = mimic.policy_setup.with_settings({"motion": str(walk)})
    for path in (level, walk):
        path.unlink()
    assert run.training_setup.labeled_settings["arena"] == "level"
    assert Configuration.from_dict(json.loads(json.dumps(run.to_dict()))) == run
    assert mimic.training_setup == expected_setup


def test_a_configuration_holds_plain_numbers_of_numpy_ones():
    changes = {"hidden": np.int64(8), "learning_rate": np.float64(0.25), "normalize": np.True_, "early_stop": "none"}
    run = Configuration.of(STEER, "sac", changes, seed=np.int64(1), steps=np.int32(64), evaluate_every=np.uint8(32))
    plain_changes = {"hidden": 8, "learning_rate": 0.25, "normalize": True, "early_stop": "none"}
    plain_run = Configuration.of(STEER, "sac", plain_changes, seed=1, steps=64, evaluate_every=32)
    assert run == plain_run and json.dumps(run.to_dict()) == json.dumps(plain_run.to_dict())
    assert run.command == plain_run.command
    with pytest.raises(ValueError, match=r"^seed: expected an integer from 0 to \d+, got np.float64\(1.0\)"):
        Configuration.of(STEER, "sac", seed=np.float64(1.0))


@pytest.mark.parametrize("name", ["ppo", "finetune", "dagger", "sac_parallel", "xqc"])
def test_networks_leave_out_contact_forces_by_default(name):
    run = Configuration.of(STEER, name)
    assert "contact_forces" in run.setup.definition.sizes
    assert "contact_forces" not in run.training_setup.definition.sizes
    whole = Configuration.of(STEER, name, {"exclude_blocks": []})
    assert whole.training_setup == whole.policy_setup == STEER


def test_what_a_task_leaves_out_stays_out():
    run = Configuration.of(STEER.with_settings({"exclude_blocks": "posture"}), "ppo")
    assert run.policy_setup.task_kwargs["exclude_blocks"] == ["posture", "contact_forces"]
    without = Configuration.of(STEER.with_settings({"exclude_blocks": ["contact_forces"]}), "ppo")
    assert without.policy_setup == without.setup
    assert Configuration.of(Setup.of("random:0-1"), "ppo").policy_setup == Setup.of("random:0-1")


@pytest.mark.parametrize(
    ("setup", "algorithm", "training", "line"),
    [
        (STEER, "ppo", {"actions": "position"}, "^training: expected settings of the same observations and actions, g"),
        (STEER, "ppo", {"random": 3}, "^training: setting random: expected none, as every run has a seed, got 3$"),
        (STEER, "ppo", {"exclude_blocks": ["posture"]}, r"exclude_blocks: expected none, as it is a hyperparameter"),
        (STEER, "ppo", {"kick": 1.5}, "^unknown setting of steer 'kick'; did you mean 'kicks'"),
        (STEER, "bc", KICKS, "^training: expected no settings, as the algorithm makes no step, got kicks, friction$"),
        (Setup.of("tick", "gaps", {"curriculum": True}), "ppo", {}, r"^setting curriculum: expected .*\(--train_set\)"),
        (STEER, "ppo", [1], "^training: expected "),
    ],
)
def test_settings_that_do_not_fit(setup, algorithm, training, line):
    with pytest.raises(ValueError, match=line) as error:
        _ = Configuration.of(setup, algorithm, training=training).training_setup
    assert "\n" not in str(error.value)


def test_all_blocks_cannot_be_left_out():
    with pytest.raises(ValueError, match="^exclude_blocks: expected none with several bodies, got posture$"):
        Configuration.of(Setup.of("random:0-1"), "ppo", {"exclude_blocks": ["posture"]})
    run = Configuration.of(STEER, "ppo", {"exclude_blocks": list(STEER.definition.sizes)})
    with pytest.raises(ValueError, match=r"^exclude_blocks: expected to leave a block, got all of them: posture, "):
        _ = run.training_setup.definition


@pytest.mark.parametrize("name", [name for name, each in ALGORITHMS.items() if each.acts])
def test_every_learner_of_one_body_can_leave_blocks_out(name):
    own = ALGORITHMS[name].with_hyperparameters({"exclude_blocks": ["posture"]})
    assert own.hyperparameters.exclude_blocks == ("posture",)


def trained(tmp_path, algorithm, changes, **fields):
    """A run of `steer` to its end, and its folder."""
    pytest.importorskip("jax", reason="of the extra learn: make check-agents")
    from arc_suite.learning.agents.training import train

    run = Configuration.of(STEER, algorithm, changes, **fields)
    assert train(run, tmp_path / "run")
    return run, tmp_path / "run"


@pytest.mark.parametrize(
    ("algorithm", "changes"),
    [("ppo", SMALL), ("dagger", {"num_envs": 4, "round": 10, "left_out": 0, "hidden": 16, "batch": 64})],
)
def test_a_policy_leaves_out_what_it_does_not_read_and_is_judged_in_the_task(tmp_path, algorithm, changes):
    run, folder = trained(tmp_path, algorithm, changes, training=KICKS, steps=64, evaluate_every=64)
    found = network.load(folder)
    assert found.setup == run.policy_setup and "kicks" not in found.setup.task_kwargs
    assert dict(found.blocks) == dict(run.training_setup.definition.sizes)
    task = STEER.definition
    blocks = task.split(np.zeros((3, task.size)))
    assert found.act(blocks, np.zeros(3)).shape == (3, found.joints)


@pytest.fixture
def begun(tmp_path):
    """A function that begins to learn by `ppo`."""
    pytest.importorskip("jax", reason="of the extra learn: make check-agents")

    def begin(changes, **context):
        return learning("ppo", changes, tmp_path, STEER, steps=320, evaluate_every=320, **context)

    return begin


def rolled_out(agent):
    return agent.collector.roll_out(agent.state.policy, agent.normalize, 0.3, 0, 0)


def test_environments_of_training_have_its_settings(begun):
    agent = begun(SMALL, training=KICKS)
    agent.advance()
    environment = agent.collector.environment
    assert environment.task.definition.modifier(Kicks).kicks == 1.5


def test_a_critic_sees_privileged_blocks_and_the_policy_does_not(begun):
    agent, plain = begun(CRITIC), begun(SMALL)
    agent.advance()
    plain.advance()
    environment, task = agent.collector.environment, agent.task
    told = np.concatenate([environment.task.privileged[name] for name in ("ground", "velocity")], axis=-1)
    assert_allclose(agent.collector.observation[:, task.size :], told, atol=1e-6)
    rollout = rolled_out(agent)
    assert rollout["observations"].shape == rollout["next_observations"].shape == (8, 4, task.size + 12)
    same = np.random.default_rng(0).standard_normal((5, task.size), np.float32)
    assert agent.latest.policy(same).shape == plain.latest.policy(same).shape == (5, 18)
    assert agent.state.values[0]["weight"].shape[0] == task.size + 12
    assert agent.state.policy[0]["weight"].shape[0] == task.size


def test_the_critics_last_observation_of_an_episode_is_that_before_the_reset(begun):
    agent = begun(CRITIC | {"horizon": 16, "minibatch": 16})
    agent.advance()
    rollout = rolled_out(agent)
    steps, places = np.nonzero(rollout["ended"][:-1] & ~rollout["terminated"][:-1])
    assert len(steps)
    size = agent.task.size
    later = rollout["observations"][steps + 1, places, size:]
    last = rollout["next_observations"][steps, places, size:]
    assert (np.abs(later - last).max(axis=-1) > 0.0).all(), "the next one begins another episode, or is the same"


def test_a_privileged_critic_resumes_bit_exactly(begun):
    whole, first = begun(CRITIC), begun(CRITIC)
    arrays = {name: array.copy() for name, array in first.until(128).checkpoint.items()}
    second = begun(CRITIC, checkpoint=arrays, steps_before=128)
    for name, array in whole.until(320).checkpoint.items():
        assert_array_equal(second.until(320).checkpoint[name], array, err_msg=name)


@pytest.mark.parametrize(
    ("setup", "blocks", "line"),
    [
        (
            STEER,
            ["velocities"],
            r"^unknown block of critic_blocks 'velocities'; did you mean 'velocity'\? \(there are: velocity, ground, ",
        ),
        (Setup.of("random:0-1"), ["velocity"], "^critic_blocks: expected none with several bodies, got velocity$"),
    ],
)
def test_critic_blocks_that_there_are_not(tmp_path, setup, blocks, line):
    pytest.importorskip("jax", reason="of the extra learn: make check-agents")
    with pytest.raises(ValueError, match=line):
        learning("ppo", SMALL | {"network": "legs", "critic_blocks": blocks}, tmp_path, setup).advance()
