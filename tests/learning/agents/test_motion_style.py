"""Style on command: the discriminator, its share of the reward, and runs that hold the motion."""

import numpy as np
import pytest
from conftest import learning
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused

pytest.importorskip("jax", reason="of the extra learn: make check-agents")

from arc_suite import motions
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.motion_style import MotionStyle
from arc_suite.motions import motion_text, striding
from arc_suite.robots import ROBOTS

CHANGES = {"num_envs": 4, "horizon": 8, "minibatch": 16, "epochs": 2, "hidden": 16, "network": "perceptron"}
TRIPOD = np.array((0.0, 0.5, 0.0, 0.5, 0.0, 0.5))


@pytest.fixture
def motion(tmp_path):
    """The file of a walk of Tick."""
    path = tmp_path / "walk.npz"
    motions.save(striding.stride(ROBOTS["tick"], 1.5, 0.6, TRIPOD, 0.3), path)
    return str(path)


def styled(motion, tmp_path, **context):
    """A learner of `steer` in the style of a motion."""
    context = {"setup": Setup.of("tick", "steer"), "seed": 3} | context
    changes = CHANGES | {"style": motion, "style_share": 0.4}
    return learning("ppo", changes, tmp_path, steps=320, evaluate_every=320, **context)


def test_a_discriminator_tells_the_motion_from_other_poses(motion):
    task = Setup.of("tick", "steer").definition
    style = MotionStyle.of(task, motion, share=0.4, both_sides=False)
    random = np.random.default_rng(0)
    state = style.begin(random)
    of_motion = style.pairs * style.scale + style.mean
    of_policy = of_motion + 4.0 * style.scale * random.standard_normal(of_motion.shape)
    for _ in range(150):
        state = style.learn(state, of_policy, random)
    zeros = np.zeros(len(of_motion))
    rewards, in_style = style.add_reward(state, zeros, of_motion)
    _, out_of_style = style.add_reward(state, zeros, of_policy)
    assert in_style > 0.7
    assert out_of_style < 0.3
    assert_allclose(rewards.mean(), 0.4 * style.highest_reward * in_style, rtol=1e-5)


def test_mirror_images_of_poses_are_as_good_where_both_sides_are_alike(motion):
    task = Setup.of("tick", "steer").definition
    one_side = MotionStyle.of(task, motion, share=0.4, both_sides=False)
    both_sides = MotionStyle.of(task, motion, share=0.4, both_sides=True)
    assert len(both_sides.pairs) == 2 * len(one_side.pairs)


def test_a_discriminator_does_not_tell_poses_by_the_height_that_no_sensor_gives(motion):
    """Observations have 0 in place of the height; so have the poses of the motion."""
    environment = Setup.of("tick", "steer", {"sensors_only": True}).make_vec(2, seed=0)
    task = environment.task.definition
    style = MotionStyle.of(task, motion, share=0.4, both_sides=False)
    seen_heights = style.poses(task, environment.reset()[0])[:, 0]
    pairs = style.pairs * style.scale + style.mean
    numbers = pairs.shape[-1] // 2
    assert_array_equal(seen_heights, 0.0)
    assert_array_equal(pairs[:, [0, numbers]], 0.0)
    assert abs(pairs[:, 3] - 1.0).max() < 0.1  # the vertical stays


@pytest.mark.parametrize(
    ("settings", "changes"), [({}, {"exclude_blocks": ["posture"]}), ({"exclude_blocks": ["posture"]}, {})]
)
def test_observations_without_poses_are_refused(motion, tmp_path, settings, changes):
    changes = CHANGES | {"style": motion} | changes
    with refused("style: expected the block posture, as poses are read from it; see exclude_blocks, got ", begins=True):
        learning("ppo", changes, tmp_path, setup=Setup.of("tick", "steer", settings), steps=64).advance()


def test_a_run_with_a_style_resumes_bit_exactly_and_its_policy_has_no_discriminator(motion, tmp_path):
    whole = styled(motion, tmp_path)
    first = styled(motion, tmp_path)
    arrays = {name: array.copy() for name, array in first.until(128).checkpoint.items()}
    second = styled(motion, tmp_path, checkpoint=arrays, steps_before=128)
    latest = whole.until(320)
    for name, array in latest.checkpoint.items():
        assert_array_equal(second.until(320).checkpoint[name], array, err_msg=name)
    assert any(name.startswith("style/") for name in latest.checkpoint)
    assert 0.0 <= latest.metrics["style"] <= 1.0
    plain = learning("ppo", CHANGES, tmp_path, setup=Setup.of("tick", "steer"), seed=3, steps=320, evaluate_every=320)
    assert latest.policy.arrays.keys() == plain.until(320).policy.arrays.keys()


def test_a_run_holds_its_motion(motion):
    configuration = Configuration.of(Setup.of("tick", "steer"), "ppo", {"style": motion}, steps=320)
    assert configuration.hyperparameters.style == motion_text.to_text(motions.load(motion))


def test_other_learners_and_motions_of_others_are_refused(motion, tmp_path):
    with refused("style_share: expected a motion as style, of which it is the share, got 0.2"):
        Configuration.of(Setup.of("tick"), "ppo", {"style_share": 0.2})
    with refused("unknown hyperparameter 'style'", begins=True):
        Configuration.of(Setup.of("tick", "steer"), "sac", {"style": motion}, steps=320)
    with refused("motion 'walk' is of 'tick': expected 12 joints, got 18", begins=True):
        styled(motion, tmp_path, setup=Setup.of("leaper", "steer")).advance()
    with refused("style: expected none with several bodies, as a motion is of one"):
        hp = {"style": motion, "network": "legs"}
        learning("ppo", CHANGES | hp, tmp_path, setup=Setup.of("tick,queen", "steer"), seed=3, steps=320).advance()
