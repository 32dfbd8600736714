"""Policies of many bodies: what they do for one body."""

import numpy as np
import pytest
from legs import network as drawn
from numpy.testing import assert_allclose, assert_array_equal

from arc_suite import evaluation, policies
from arc_suite.envs.bodies import BodiesEnv
from arc_suite.envs.setup import Setup
from arc_suite.policies import network, universal
from arc_suite.policies.universal import Universal
from arc_suite.robots import ROBOTS, generator

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


def test_a_file_of_it_is_read_as_it_was_written(trained):
    read, made = network.load(trained), drawn()
    assert read.setup == made.setup and read.setup.robot == "random:0-1" and read.blocks == made.blocks
    assert [layer.kind for layer in read.layers] == ["legs", "clip"]
    for one, other in zip(read.layers[0].arrays, made.layers[0].arrays, strict=True):
        assert_array_equal(one, other)


def test_a_damaged_file_is_one_line(tmp_path):
    layer, clip = drawn().layers
    path = tmp_path / "policy.npz"
    for arrays, message in (
        ((layer.arrays[0][:-1], *layer.arrays[1:]), "layer 0, legs: array 0 does not fit 664 inputs"),
        ((*layer.arrays[:4], layer.arrays[4][:-1], *layer.arrays[5:]), "layer 0, legs: array 4 does not fit"),
        ((*layer.arrays[:-1], layer.arrays[-1][:-1]), "layer 0, legs: array 8 does not fit"),
    ):
        network.save(path, drawn()._replace(layers=(layer._replace(arrays=arrays), clip)))
        with pytest.raises(ValueError, match=f"no policy, or a damaged one: {message}"):
            network.load(path)
    network.save(path, drawn()._replace(blocks={"legs": 663}))
    with pytest.raises(ValueError, match="layer 0, legs: expected 664 inputs, got 663"):
        network.load(path)


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
        policies.trained(trained)
    single = Setup.of("leaper").definition
    layers = (network.Layer("linear", (np.zeros((single.size, 12), np.float32), np.zeros(12, np.float32))),)
    network.save(tmp_path / "one.npz", network.Network(layers, Setup.of("leaper"), dict(single.sizes)))
    with pytest.raises(ValueError, match=r"one\.npz: expected one of many bodies, got one of leaper$"):
        universal.load(tmp_path / "one.npz")
