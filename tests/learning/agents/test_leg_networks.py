"""Networks that legs share."""

import dataclasses

import numpy as np
import pytest
from conftest import learning
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused

pytest.importorskip("jax", reason="of the extra learn: make check-agents")

import jax

from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import architectures, configuration
from arc_suite.learning.agents import critic_blocks as behind
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.hyperparameters import ProximalPolicy
from arc_suite.learning.agents.leg_networks import Legs
from arc_suite.learning.agents.normalizer import Moments
from arc_suite.learning.agents.training import train
from arc_suite.policies import network
from arc_suite.tasks import leg_views

CHANGES = {"num_envs": 4, "horizon": 8, "minibatch": 16, "epochs": 2, "hidden": 16}


def drawn(task, critic_blocks=(), count=6):
    """An architecture, parameters of actions and values, and vectors, normalized by their own moments."""
    random, architecture = np.random.default_rng(1), architectures.of(task, "legs", critic_blocks)
    size = task.size + sum(task.privileged_blocks[name].size for name in critic_blocks)
    vectors = random.normal(size=(count, size)).astype(np.float32)
    normalize = architecture.normalize(
        Moments.empty(architecture.inputs).with_vectors(architecture.moment_vectors(architecture.view(vectors)))
    )
    networks = architecture.draw_policy(random, 16), architecture.draw_values(random, 16)
    return architecture, *networks, normalize, vectors


@pytest.mark.parametrize(("body", "critic_blocks"), [("queen", ()), ("tick", ("ground", "velocity")), ("leaper", ())])
def test_left_and_right_are_treated_alike(body, critic_blocks):
    task = Setup.of(body, "steer").definition
    architecture, policy, values, normalize, vectors = drawn(task, critic_blocks)
    assert architecture.symmetric
    mirror, mirror_action = behind.mirror_maps(task, critic_blocks)
    here, there = (normalize(architecture.view(each)) for each in (vectors, mirror(vectors)))
    acted, found = architecture.actions(policy, here), architecture.values(values, here)
    assert_allclose(architecture.actions(policy, there), mirror_action(np.asarray(acted)), atol=1e-5)
    assert_allclose(architecture.values(values, there), found, atol=1e-5)
    assert np.std(acted) > 0.1 and np.std(found) > 0.1


@pytest.mark.parametrize("body", ["queen", "varied:5"])
def test_a_network_is_exported_and_imported_as_it_acts(body):
    task = Setup.of(body, "steer").definition
    architecture, policy, _, normalize, vectors = drawn(task)
    graph = architectures.policy_graph(architecture, normalize, policy)
    expected = np.asarray(architecture.actions(policy, normalize(architecture.view(vectors)))).clip(-1.0, 1.0)
    assert_allclose(graph(vectors), expected, atol=1e-5)
    for row, actions in zip(vectors, graph(vectors), strict=True):
        assert_array_equal(graph(row[None])[0], actions)  # whatever the number of environments
    again, parameters = architectures.read_policy_graph(architecture, graph)
    assert_array_equal(again.mean, normalize.mean)
    for one, other in zip(jax.tree.leaves(policy), jax.tree.leaves(parameters), strict=True):
        assert_allclose(one, other, rtol=1e-6)
    with pytest.raises(ValueError, match="^a policy of dagger, bc or ppo, of the same network$"):
        architectures.read_policy_graph(architectures.of(task), graph)


@pytest.mark.parametrize("path", sorted(network.PACKAGED.glob("*.npz")), ids=lambda path: path.stem)
def test_packaged_policies_are_traced_to_the_nodes_that_they_hold(path):
    """What legs and networks see is what it was when these policies were trained."""
    packaged = network.load(path)
    if packaged.setup.several:
        architecture = architectures.AnyLegs()
    else:
        kind = configuration.network_hyperparameters(path)["network"]
        architecture = architectures.of(packaged.setup.definition, kind)
    normalize, parameters = architectures.read_policy_graph(architecture, packaged.graph)
    traced = architectures.policy_graph(architecture, normalize, parameters)
    assert traced.nodes == packaged.graph.nodes and traced.arrays.keys() == packaged.graph.arrays.keys()
    for name, array in packaged.graph.arrays.items():  # which a file rounds to 16 bits
        assert_allclose(traced.arrays[name], array, rtol=2e-3, atol=1e-6)


def test_goals_and_rays_are_mirrored_on_the_right():
    task = Setup.of("tick", "navigate").definition
    architecture, policy, _, normalize, vectors = drawn(task)
    mirror, mirror_action = task.symmetry
    acted = architecture.actions(policy, normalize(architecture.view(vectors)))
    there = architecture.actions(policy, normalize(architecture.view(mirror(vectors))))
    assert_allclose(there, mirror_action(np.asarray(acted)), atol=1e-5)


def test_runs_of_legs_hold_the_version_of_their_views():
    for blocks, holds in ((["contact_forces"], False), ([], True)):
        run = Configuration.of(Setup.of("tick", "steer"), "ppo", {"exclude_blocks": blocks})
        record = run.record()
        assert record.get("leg_views") == (leg_views.VERSION if holds else None)
        assert Configuration.from_dict(record) == run
    assert "leg_views" not in Configuration.of(Setup.of("tick", "walk"), "ppo", {"network": "perceptron"}).record()


def test_moments_are_those_of_all_legs():
    task = Setup.of("tick", "steer").definition
    architecture, _, _, normalize, _ = drawn(task)
    mean = normalize.mean.reshape(6, -1)
    assert_array_equal(mean, np.broadcast_to(mean[0], mean.shape))


def test_learning_goes_on_bit_exactly(tmp_path):
    setup = Setup.of("tick", "steer", {"time_limit": 1.0})
    changes = CHANGES | {"network": "legs", "critic_blocks": ["velocity"]}

    def learned(folder, **context):
        agent = learning("ppo", changes, folder, setup, steps=320, evaluate_every=320, **context)
        return agent

    straight = learned(tmp_path / "straight")
    straight.until(64)
    checkpoint = straight.latest.checkpoint
    straight.until(128)
    resumed = learned(tmp_path / "resumed", checkpoint=checkpoint, steps_before=64)
    resumed.until(128)
    assert isinstance(resumed.collector.architecture, Legs) and resumed.symmetry is None
    for one, other in zip(jax.tree.leaves(straight.state), jax.tree.leaves(resumed.state), strict=True):
        assert_array_equal(one, other)


@pytest.mark.parametrize("name", ["ppo", "xqc"])
def test_the_policy_of_a_run_is_read_again(tmp_path, name):
    setup = Setup.of("tick", "steer", {"time_limit": 0.5})
    changes = CHANGES if name == "ppo" else {"network": "legs", "hidden": 16, "batch": 8, "buffer_size": 100}
    assert train(Configuration.of(setup, name, changes, steps=64, evaluate_every=64), tmp_path / "run")
    found = network.load(tmp_path / "run" / "policy.npz")
    assert np.isfinite(found.actions(np.zeros((3, found.size), np.float32))).all()


@pytest.mark.parametrize(("task", "shape"), [("steer", ("legs", 64)), ("walk", ("perceptron", 128))])
def test_it_starts_from_a_policy_of_either_network(tmp_path, task, shape):
    start, setup = network.PACKAGED / f"leaper-{task}.npz", Setup.of("leaper", task, {"time_limit": 0.5})
    few = {"start": str(start), "num_envs": 2, "horizon": 4, "minibatch": 8}
    hp = Configuration.of(setup, "finetune", few).hyperparameters
    assert (hp.network, hp.hidden) == shape
    agent, policy = learning("finetune", few, tmp_path, setup, steps=64), network.load(start)
    observations = np.random.default_rng(0).normal(size=(5, policy.size)).astype(np.float32)
    assert_allclose(agent.advance().policy(observations), policy.actions(observations), atol=1e-5)  # values learn first
    with refused(f"{start}: expected 32 hidden units, got {shape[1]}"):
        learning("finetune", few | {"hidden": 32}, tmp_path, setup).advance()


def test_a_file_of_a_run_is_read_without_the_policy_that_it_started_from(tmp_path):
    setup, damaged = Setup.of("leaper", "walk"), tmp_path / "policy.npz"
    damaged.write_bytes((network.PACKAGED / "leaper-walk.npz").read_bytes())
    run = Configuration.of(setup, "finetune", {"start": str(damaged)})
    damaged.write_bytes(b"no policy")
    assert Configuration.from_dict(run.to_dict()) == run
    with refused(f"{damaged}: ", begins=True):
        Configuration.of(setup, "finetune", {"start": str(damaged)})


@pytest.mark.parametrize("alike", [False, True])
def test_a_start_of_other_symmetry_is_refused_with_the_hyperparameter_that_fits(tmp_path, alike):
    setup, start = Setup.of("tick", "walk", {"time_limit": 0.5}), tmp_path / "start"
    run = Configuration.of(setup, "ppo", CHANGES | {"symmetry_augmentation": alike}, steps=32, evaluate_every=32)
    assert train(run, start)
    changes = {name: value for name, value in CHANGES.items() if name != "hidden"} | {"start": str(start)}
    other, cure = (changes | {"symmetry_augmentation": value} for value in (not alike, alike))
    text = f"symmetry_augmentation={str(alike).lower()}"
    with refused(f"{start}: a policy of {text}; add --hp {text}"):
        learning("finetune", other, tmp_path, setup, steps=32).advance()
    learning("finetune", cure, tmp_path, setup, steps=32).advance()


def test_a_network_is_one_of_two():
    with refused("unknown network 'leg'; did you mean 'legs'? (there are: perceptron, legs, module:name to import it)"):
        ProximalPolicy(network="leg")
    with refused("minibatch: expected at most the 2048 transitions of a horizon, got 4096"):
        ProximalPolicy(network="legs", minibatch=4096)
    assert dataclasses.replace(ProximalPolicy(), minibatch=4096).network == "perceptron"


def test_several_bodies_share_a_network_of_legs(tmp_path):
    setup = Setup.of("random:0-1", "walk")
    with refused("network: expected legs with several bodies, got perceptron"):
        learning("ppo", CHANGES | {"network": "perceptron"}, tmp_path, setup, steps=64, evaluate_every=64).advance()
