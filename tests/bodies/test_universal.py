"""Policies of many bodies: what they do for one body."""

import numpy as np
import pytest
from networks import of_many_bodies as drawn
from numpy.testing import assert_allclose, assert_array_equal

from arc_suite import evaluation, policies
from arc_suite.bodies import BodiesEnv, generator, universal
from arc_suite.bodies.universal import Universal
from arc_suite.envs.setup import Setup
from arc_suite.policies import network
from arc_suite.policies.tracing import traced
from arc_suite.robots import ROBOTS

SETTINGS = {"time_limit": 1.0}
BODIES = (generator.random_body(3), generator.generate(5, 2))


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """The file of a policy of many bodies."""
    path = tmp_path_factory.mktemp("policy") / "policy.npz"
    network.save(path, drawn())
    return path


def test_it_acts_for_a_body_as_among_many():
    """Bit-equal actions, whatever the other bodies are, in the same environments."""
    made, env = drawn(), BodiesEnv("walk", 2, list(BODIES), flat=True)
    observations, _ = env.reset(seed=0)
    alone = [Universal(made, task) for task in env.unwrapped.tasks]
    for _ in range(5):
        actions = made.actions(observations)
        own = env.unwrapped.own_observations()
        for index, policy in enumerate(alone):
            mask = env.unwrapped.description.mask[index].ravel()
            expected = policy.act(policy.task.split(own[index][None]))
            assert_array_equal(actions[index][mask], expected[0].astype(np.float32))
            assert not actions[index][~mask].any()
        observations, *_ = env.step(actions)


@pytest.mark.parametrize("task", ["walk", "steer"])
def test_torques_are_those_that_hold_its_positions(trained, task):
    """The same episode with torques and with positions as actions."""
    totals = []
    for settings in (SETTINGS, SETTINGS | {"actions": "position"}):
        environment = Setup.of(BODIES[0], task, settings).load()
        policy = policies.policy(trained, BODIES[0], task=environment.task.definition)
        totals.append(evaluation.run(environment, policy, 0).total)
    assert_allclose(totals[1], totals[0], rtol=1e-3)


@pytest.mark.parametrize("body", [ROBOTS["leaper"], *BODIES], ids=lambda body: body.name)
def test_any_program_takes_it(trained, body):
    """By its path, for a batch and for one environment alike."""
    setup = Setup.of(body, "walk", SETTINGS)
    environment = setup.make_vec(2, autoreset_mode="Disabled")
    batch = policies.policy(str(trained), body, num_envs=2, task=environment.task.definition)
    together = evaluation.episodes_in_batch(environment, batch, (0, 1))
    alone = policies.policy(str(trained), body, task=environment.task.definition)
    one = evaluation.run(setup.load(), alone, 1)
    assert one.total == pytest.approx(together[1].total, rel=1e-4) and one.length == together[1].length


def test_a_damaged_file_is_one_line(tmp_path):
    made, path = drawn(), tmp_path / "policy.npz"
    graph, at = made.graph, {node.operator: index for index, node in enumerate(made.graph.nodes)}
    for operator, place, change, message in (
        ("Linear", 1, lambda array: array[:-1], r"node \d+, Linear: weight .* do not fit"),
        ("Product", 1, lambda array: array[:-1], r"node \d+, Product: weight .* do not fit"),
        ("Take", 1, lambda array: array + 759 * 12, r"node \d+, Take: IndexError: index \d+ is out of bounds"),
        ("Take", 1, lambda array: array - 759 * 12, r"array \d+: expected indices, got -\d+"),
    ):
        name = graph.nodes[at[operator]].inputs[place]
        changed = graph._replace(arrays={**graph.arrays, name: change(graph.arrays[name])})
        network.save(path, made._replace(graph=changed))
        with pytest.raises(ValueError, match=f"no policy, or a damaged one: {message}"):
            network.load(path)
    masked = graph._replace(nodes=tuple(node for node in graph.nodes if node.operator != "Pick"))
    for change in ({"graph": masked}, {"blocks": {"legs": 758}}):
        network.save(path, made._replace(**change))
        with pytest.raises(ValueError, match=r"no policy, or a damaged one: node \d+, "):
            network.load(path)


@pytest.mark.parametrize("body", BODIES, ids=lambda body: body.name)
@pytest.mark.parametrize("settings", [{}, {"actions": "position"}])
def test_fitted_to_a_body_it_does_the_same(body, settings):
    """Actions are bit-equal where they are positions; torques are float64 in `act` and float32 in a graph."""
    setup = Setup.of(body, "steer", settings)
    environment = setup.make_vec(3, seed=0)
    policy, fitted = Universal(drawn(), setup.definition), universal.for_body(drawn(), setup)
    observations, _ = environment.reset()
    expected = policy.act(environment.task.split(observations))
    assert_allclose(fitted.actions(observations), expected, atol=0.0 if settings else 1e-5)


def test_what_does_not_fit_is_one_line(trained, tmp_path):
    legs = ROBOTS["tick"].legs
    many = ROBOTS["tick"].replace(
        name="many", legs=tuple(legs[i % 6].replace(name=f"l{i}", yaw_deg=float(i)) for i in range(13))
    )
    with pytest.raises(ValueError, match=r"^many: expected at most 12 legs of at most 4 joints, got 13 legs"):
        policies.policy(trained, many)
    excluded = Setup.of("tick", "walk", {"exclude_blocks": ["contact_forces"]}).definition
    with pytest.raises(ValueError, match=r"^task walk: expected the blocks posture, velocities, contact_forces, "):
        policies.policy(trained, "tick", task=excluded)
    with pytest.raises(ValueError, match=r"expected one of one body, or --robot; got one of random:0-1$"):
        policies.load_network(trained)
    graph = traced(lambda x: x.node("Product", np.zeros((664, 48))), 664)  # as it was before pose, gait and ground
    network.save(tmp_path / "before.npz", network.Network(graph, Setup.of("random:0-1"), {"legs": 664}))
    line = r"^policy of random:0-1, walk: expected 759 observations, got 664; train it again$"
    for read in (universal.load, lambda path: policies.policy(path, "tick")):
        with pytest.raises(ValueError, match=line):
            read(tmp_path / "before.npz")
    single = Setup.of("leaper").definition
    graph = traced(lambda x: x.node("Product", np.zeros((single.size, 12))), single.size)
    network.save(tmp_path / "one.npz", network.Network(graph, Setup.of("leaper"), dict(single.sizes)))
    with pytest.raises(ValueError, match=r"one\.npz: expected one of many bodies, got one of leaper$"):
        universal.load(tmp_path / "one.npz")
