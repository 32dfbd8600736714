"""One policy for many bodies: imitation, proximal policy optimization from it, and its network of legs."""

import numpy as np
import pytest
from conftest import learning
from numpy.testing import assert_allclose, assert_array_equal

pytest.importorskip("jax", reason="of the extra learn: make check-agents")


from arc_suite.bodies import tokens
from arc_suite.bodies.padding import MAX_LEGS
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors
from arc_suite.learning.agents import architectures
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.leg_networks import AnyLegs
from arc_suite.learning.agents.normalizer import Moments
from arc_suite.learning.agents.training import train
from arc_suite.policies import network, policy
from arc_suite.policies.tracing import traced

SETUP = Setup.of("random:0-1", "steer", {"time_limit": 0.5})
SMALL = {"num_envs": 4, "round": 8, "left_out": 2, "updates": 20, "last_updates": 40, "batch": 32, "hidden": 8}
PPO = {"num_envs": 4, "horizon": 6, "minibatch": 8, "hidden": 8, "value_warm_up": 6}


def trained(folder, setup=SETUP, algorithm="dagger_bodies"):
    """Train a short run in a folder, and return its configuration."""
    run = Configuration.of(setup, algorithm, SMALL, steps=64, evaluate_every=64)
    assert train(run, folder)
    return run


@pytest.fixture(scope="module")
def vectors():
    """Observations of two bodies."""
    return SETUP.make_vec(2, seed=0).reset(seed=0)[0]


def test_a_network_of_legs_in_files_computes_what_learning_does(vectors):
    architecture = AnyLegs()
    parameters = architecture.draw_policy(np.random.default_rng(0), 16)
    normalize = architecture.normalize(
        Moments.empty(architecture.inputs).with_vectors(architecture.moment_vectors(vectors))
    )
    normalized = normalize(vectors)
    expected = np.asarray(architecture.actions(parameters, normalized))
    graph = architectures.policy_graph(architecture, normalize, parameters)
    assert_allclose(graph(vectors), expected.clip(-1.0, 1.0), atol=1e-5)
    normalizer, again = architectures.read_policy_graph(architecture, graph)
    for array, same in zip(normalizer, normalize, strict=True):
        assert_array_equal(array, same)
    assert_array_equal(np.asarray(architecture.actions(again, normalized)), expected)
    assert not expected[~SETUP.make_vec(2).description.mask.reshape(2, -1)].any()
    with pytest.raises(ValueError, match="^a policy of dagger, bc or ppo"):
        architectures.read_policy_graph(architecture, traced(lambda x: x.clip(-1.0, 1.0), architecture.size))


def test_the_order_of_legs_does_not_matter(vectors):
    """Actions follow the legs, and values stay."""
    architecture = AnyLegs()
    random = np.random.default_rng(0)
    of_actions, of_values = architecture.draw_policy(random, 16), architecture.draw_values(random, 16)
    legs = int(tokens.leg_inputs(vectors[:1])[1].any(axis=-1).sum())
    order = np.arange(MAX_LEGS)
    order[:legs] = order[:legs][::-1]
    ends = np.cumsum(list(tokens.FLAT_SIZES.values()))[:-1]
    parts = [part.reshape(-1) for part in np.split(vectors[0], ends)]
    for place in (0, 3):
        parts[place] = parts[place].reshape(MAX_LEGS, -1)[order].ravel()
    other = np.concatenate(parts)
    both = np.stack([vectors[0], other])
    actions, turned = np.asarray(architecture.actions(of_actions, both)).reshape(2, 12, 4)
    assert_allclose(turned, actions[order], atol=1e-5)
    values = np.asarray(architecture.values(of_values, both))
    assert values[0] == pytest.approx(values[1], abs=1e-5)


def test_normalized_observations_keep_the_number_of_joints(vectors):
    architecture = AnyLegs()
    seen = architecture.moment_vectors(vectors)
    normalize = architecture.normalize(Moments.empty(architecture.inputs).with_vectors(seen))
    inputs, mask = tokens.leg_inputs(normalize(vectors))
    assert_array_equal(mask, tokens.leg_inputs(vectors)[1])
    there = inputs[mask.any(axis=-1)]
    counts = tokens.LEG_SIZE + np.arange(8, 12)  # of the leg's description
    scaled = np.delete(there, counts, axis=-1)
    assert abs(scaled.mean(axis=0)).max() < 0.1
    assert scaled.std(axis=0).max() < 1.05
    assert_array_equal(there[:, counts].sum(axis=-1), 1.0)


def test_inputs_that_never_changed_have_no_effect_in_other_tasks(vectors):
    """The ground is 0 in `steer`. With untrained weights for it, policies of `steer` did not walk in `rough`."""
    architecture = AnyLegs()
    parameters = architecture.draw_policy(np.random.default_rng(0), 16)
    seen = architecture.moment_vectors(vectors)
    normalize = architecture.normalize(Moments.empty(architecture.inputs).with_vectors(seen))
    ground = slice(tokens.LEG_SIZE - tokens.PATCH_SIZE, tokens.LEG_SIZE)  # of a leg
    assert not seen[:, ground].any()
    uneven = vectors.copy()
    of_legs = uneven[:, : tokens.FLAT_SIZES["legs"]].reshape(len(vectors), MAX_LEGS, -1)
    of_legs[..., ground] = 0.1
    assert (uneven != vectors).any()
    actions = np.asarray(architecture.actions(parameters, normalize(vectors)))
    assert_array_equal(np.asarray(architecture.actions(parameters, normalize(uneven))), actions)


@pytest.mark.parametrize("algorithm", ["dagger_bodies", "finetune_bodies"])
def test_it_resumes_bit_exactly(algorithm, tmp_path):
    """Episodes of ten steps begin and end meanwhile; demonstrators have a memory."""
    changes = SMALL
    if algorithm == "finetune_bodies":
        trained(tmp_path / "start")
        changes = PPO | {"start": str(tmp_path / "start")}

    def begun(checkpoint=None, steps_before=0):
        return learning(algorithm, changes, tmp_path, SETUP, 96, 96, steps_before, checkpoint=checkpoint)

    whole, first = begun(), begun()
    arrays = {name: array.copy() for name, array in first.advance().checkpoint.items()}
    second = begun(arrays, first.step)
    for other in (first, second):
        for name, array in whole.until(96).checkpoint.items():
            assert_array_equal(other.until(96).checkpoint[name], array, err_msg=name)
    finite = map(np.isfinite, whole.latest.policy.arrays.values())
    assert all(each.all() for each in finite)


def test_a_run_makes_a_policy_of_any_body(tmp_path):
    run = trained(tmp_path / "run")
    assert run.name == "random.0-1-steer-dagger_bodies-0"
    assert Configuration.from_dict(run.to_dict()) == run
    made = network.load(tmp_path / "run")
    assert made.setup == SETUP
    environment = Setup.of("leaper", "steer", {"time_limit": 0.5}).load()
    acting = policy(tmp_path / "run", "leaper", task=environment.task.definition)
    blocks = {name: block[None] for name, block in environment.reset().observation.items()}
    assert acting.act(blocks).shape == (1, 12)


def test_anchors_are_means_over_bodies_of_validation():
    scale = anchors.anchors(Setup.of("random:0-1", "walk", {"time_limit": 1.0}).validation(2))
    assert scale.preset == "of each body" and scale.demonstrator > scale.zero > 0.0


def test_what_learns_with_one_body_alone_is_one_line():
    those = "ppo, finetune, dagger, dagger_bodies, finetune_bodies"
    expected = f"^algorithm sac: learns with one body, got random:0-1; with several: {those}$"
    with pytest.raises(ValueError, match=expected):
        Configuration.of(SETUP, "sac")


def test_a_start_that_does_not_fit_is_one_line(tmp_path):
    trained(tmp_path / "start")
    begun = learning("finetune_bodies", PPO | {"start": str(tmp_path / "start"), "hidden": 16}, tmp_path, SETUP)
    with pytest.raises(ValueError, match=r"start: expected 16 hidden units, got 8$"):
        begun.advance()
    trained(tmp_path / "one", Setup.of("leaper", "steer"), "dagger")
    begun = learning("finetune_bodies", PPO | {"start": str(tmp_path / "one")}, tmp_path, SETUP)
    with pytest.raises(ValueError, match=r"one: expected one of many bodies, got one of leaper$"):
        begun.advance()
