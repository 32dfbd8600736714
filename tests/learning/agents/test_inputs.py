"""Inputs of networks: excluded blocks, running moments, mirrored transitions."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from arc_suite.envs.setup import Setup
from arc_suite.learning.agents.inputs import Inputs
from arc_suite.learning.agents.replay import Transitions
from arc_suite.robots import generator

TASK = Setup.of("tick").definition
CONTACTS = ("contact_forces",)


def drawn(count, size=TASK.size):
    return np.random.default_rng(0).standard_normal((count, size), np.float32)


def test_raw_observations():
    inputs = Inputs.of(TASK, (), normalize=False, mirror=False)
    assert inputs.after(drawn(4)) is inputs
    assert_array_equal(inputs(drawn(4)), drawn(4))


def test_excluded_blocks_and_moments():
    inputs = Inputs.of(TASK, CONTACTS, normalize=True, mirror=False).after(drawn(300))
    parts = [block for name, block in TASK.split(drawn(300)).items() if name not in CONTACTS]
    seen = np.concatenate(parts, axis=-1)
    assert seen.shape == (300, TASK.size - TASK.sizes["contact_forces"])
    expected = (seen - seen.mean(axis=0)) / seen.std(axis=0)
    assert_allclose(inputs(drawn(300)), expected.clip(-5.0, 5.0), atol=1e-5)


def test_a_task_without_the_block_has_all_its_inputs():
    assert len(Inputs.of(TASK, ("nothing",), normalize=False, mirror=False).columns) == TASK.size
    with pytest.raises(ValueError, match=r"^exclude_blocks: expected to leave a block, got all of them: posture, "):
        Inputs.of(TASK, tuple(TASK.blocks), normalize=False, mirror=False)


def test_moments_see_as_much_of_the_left_as_of_the_right():
    inputs = Inputs.of(TASK, (), normalize=True, mirror=True).after(drawn(50))
    assert inputs.moments.count == 100
    assert_allclose(inputs.symmetry.observation(inputs.moments.mean), inputs.moments.mean, atol=1e-9)


def test_every_other_transition_is_mirrored():
    inputs = Inputs.of(TASK, (), normalize=False, mirror=True)
    joints = len(TASK.scene.body.joint_names)
    batch = Transitions(drawn(6), drawn(6, joints), drawn(6, 1)[:, 0], np.ones(6, np.float32), drawn(12)[6:])
    found, maps = inputs.of_batch(batch), inputs.symmetry
    mirrors = {"observations": maps.observation, "actions": maps.action, "next_observations": maps.observation}
    for name, mirror in mirrors.items():
        before, after = getattr(batch, name), getattr(found, name)
        assert_array_equal(after[::2], before[::2])
        assert_array_equal(after[1::2], mirror(before[1::2]))
        assert not np.array_equal(after[1::2], before[1::2])
    assert_array_equal(found.rewards, batch.rewards)


def test_a_body_without_symmetry_has_no_mirrored_transitions():
    task = Setup.of(generator.random_body(10)).definition
    assert Inputs.of(task, (), normalize=False, mirror=True).symmetry is None


@pytest.mark.parametrize("normalize", [False, True])
def test_exported_layers_take_whole_observations(normalize):
    inputs = Inputs.of(TASK, CONTACTS, normalize, mirror=False).after(3.0 + 2.0 * drawn(50))
    weight = drawn(len(inputs.columns), 4)
    layers = ({"weight": weight, "bias": np.ones(4, np.float32)},)
    observations = 3.0 + 2.0 * drawn(60)[50:]
    expected = np.tanh(inputs(observations) @ weight + 1.0)
    assert_allclose(inputs.exported(layers)(observations), expected, atol=1e-5)
