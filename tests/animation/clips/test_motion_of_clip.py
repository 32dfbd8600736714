"""Clips of the suite as files of motions."""

import numpy as np
import pytest

from arc_suite import animation, motions, registry


@pytest.mark.slow
def test_clip_becomes_a_motion(tmp_path):
    (clip,) = animation.animate("tick", tmp_path / "attack.npz", "attack", fps=30)
    motion = motions.load(tmp_path / "attack.npz")
    motions.check_body(motion, registry.body_of("tick"))
    assert (motion.name, motion.frame_rate, motion.frames) == ("attack", pytest.approx(30.0), len(clip.times))
    np.testing.assert_array_equal(motion.angles, clip.motion.joints)
    assert not motion.loops
    assert (~motion.planted).any(axis=0).sum() == 1  # one leg strikes
    struck = int((~motion.planted).any(axis=0).argmax())
    assert motion.soles[:, struck, 2].max() > 0.5


@pytest.mark.slow
def test_loop_turns_by_its_command(tmp_path):
    (clip,) = animation.animate("tick", tmp_path / "turn.npz", "turn_left")
    motion = motions.load(tmp_path / "turn.npz")
    np.testing.assert_allclose(motion.displacement / motion.seconds, clip.motion.twist, rtol=0.1, atol=0.03)
    assert 0.5 < motion.planted.mean() < 0.7  # the duty factor of the gait


@pytest.mark.slow
def test_additive_clip_is_no_motion(tmp_path):
    with pytest.raises(ValueError, match="clips: hit_left is added to another clip, and is no motion by itself"):
        animation.animate("tick", tmp_path / "hit.npz", "hit_left")
    assert not list(tmp_path.iterdir())
