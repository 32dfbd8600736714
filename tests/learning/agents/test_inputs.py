"""Inputs of networks: running moments, mirrored transitions, privileged blocks of critics."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused

pytest.importorskip("jax", reason="of the extra learn: make check-agents")

from arc_suite.bodies import generator
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents.critic_blocks import mirror_maps, privileged_columns
from arc_suite.learning.agents.inputs import NetworkInputs
from arc_suite.learning.agents.replay import Transitions
from arc_suite.robots import queen

TASK = Setup.of("tick").definition


def stiff(*names):
    """Queen, some of whose legs have no ankle."""
    body = queen.BODY
    legs = [leg.replace(links=(*leg.links[:2], leg.links[2].replace(joint=None))) for leg in body.legs]
    legs = tuple(other if leg.name in names else leg for leg, other in zip(body.legs, legs, strict=True))
    return body.replace(name="stiff", legs=legs)


def drawn(count, size=TASK.size):
    return np.random.default_rng(0).standard_normal((count, size), np.float32)


def test_raw_observations():
    inputs = NetworkInputs.of(TASK, normalize=False, symmetry_augmentation=False)
    assert inputs.with_observations(drawn(4)) is inputs
    assert_array_equal(inputs(drawn(4)), drawn(4))


def test_moments_normalize():
    inputs, seen = (
        NetworkInputs.of(TASK, normalize=True, symmetry_augmentation=False).with_observations(drawn(300)),
        drawn(300),
    )
    expected = (seen - seen.mean(axis=0)) / seen.std(axis=0)
    assert_allclose(inputs(drawn(300)), expected.clip(-5.0, 5.0), atol=1e-5)


def test_privileged_blocks_of_critics_are_mirrored_behind_the_observation():
    names = ("ground", "velocity")
    places, maps = privileged_columns(TASK, names), mirror_maps(TASK, names)
    assert places.tolist() == [6, 7, 8, 9, 10, 11, 0, 1, 2, 3, 4, 5]
    vectors = drawn(3, TASK.size + 12)
    found, own = maps.observation(vectors), TASK.symmetry.observation(vectors[:, : TASK.size])
    assert_array_equal(found[:, : TASK.size], own)
    assert_array_equal(found[:, -6:], vectors[:, -6:] * [1, -1, 1, -1, 1, -1])
    assert_array_equal(np.sort(found[:, -12:-6]), np.sort(vectors[:, -12:-6]))
    assert_array_equal(maps.observation(found), vectors)
    with pytest.raises(ValueError, match=r"^unknown block of critic_blocks 'speed' \(there are: velocity, ground\)$"):
        privileged_columns(TASK, ("speed",))


def test_moments_see_as_much_of_the_left_as_of_the_right():
    inputs = NetworkInputs.of(TASK, normalize=True, symmetry_augmentation=True).with_observations(drawn(50))
    assert inputs.moments.count == 100
    assert_allclose(inputs.symmetry.observation(inputs.moments.mean), inputs.moments.mean, atol=1e-9)


def test_every_other_transition_is_mirrored():
    inputs = NetworkInputs.of(TASK, normalize=False, symmetry_augmentation=True)
    joints = len(TASK.scene.body.joint_names)
    batch = Transitions(drawn(6), drawn(6, joints), drawn(6, 1)[:, 0], np.ones(6, np.float32), drawn(12)[6:])
    found, maps = inputs.transform_batch(batch), inputs.symmetry
    mirrors = {"observations": maps.observation, "actions": maps.action, "next_observations": maps.observation}
    for name, mirror in mirrors.items():
        before, after = getattr(batch, name), getattr(found, name)
        assert_array_equal(after[::2], before[::2])
        assert_array_equal(after[1::2], mirror(before[1::2]))
        assert not np.array_equal(after[1::2], before[1::2])
    assert_array_equal(found.rewards, batch.rewards)


def test_a_body_without_symmetry_has_no_mirrored_transitions():
    task = Setup.of(generator.random_body(10)).definition
    assert NetworkInputs.of(task, normalize=False, symmetry_augmentation=True).symmetry is None


@pytest.mark.parametrize("normalize", [False, True])
def test_exported_layers_take_observations(normalize):
    inputs = NetworkInputs.of(TASK, normalize, symmetry_augmentation=False).with_observations(3.0 + 2.0 * drawn(50))
    weight = drawn(TASK.size, 4)
    layers = ({"weight": weight, "bias": np.ones(4, np.float32)},)
    observations = 3.0 + 2.0 * drawn(60)[50:]
    expected = np.tanh(inputs(observations) @ weight + 1.0)
    assert_allclose(inputs.policy_graph(layers)(observations), expected, atol=1e-5)


def test_legs_see_and_do_what_the_body_does():
    task = Setup.of("queen", "steer").definition
    inputs = NetworkInputs.of(task, normalize=True, symmetry_augmentation=True, network="legs")
    assert inputs.joints == (6, 3) and inputs.symmetry is None
    observations = drawn(40, task.size)
    inputs = inputs.with_observations(observations)
    seen = inputs(observations) / inputs.legs.scale
    assert seen.shape == (40, 6, inputs.size)
    varied = seen.std(axis=(0, 1)) > 0.0  # not what is the same for all legs
    assert_allclose(seen.mean(axis=(0, 1))[varied], 0.0, atol=1e-3)
    actions = drawn(40, 18)
    assert_array_equal(inputs.body_actions(inputs.legs.leg_actions(actions)), actions)
    with refused("network: expected perceptron for legs with different numbers of joints, got legs"):
        NetworkInputs.of(Setup.of(stiff("l2", "r2")).definition, True, True, "legs")
