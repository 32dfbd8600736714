"""Bones of ornaments: they lag, settle, stay above the ground, hold their shapes, and swing in pages as in Python."""

import pathlib
import types

import nodes
import numpy as np
import pytest

from arc_suite import rotations
from arc_suite.animation import pages
from arc_suite.animation.clips.meshes import part_meshes
from arc_suite.animation.parts import describe_body
from arc_suite.arenas import FLAT
from arc_suite.bodies.families import sound_body, varied_body
from arc_suite.bodies.generator import generate
from arc_suite.models import swinging
from arc_suite.models.visuals import VISUALS
from arc_suite.models.visuals.spec import Bone, Visuals, whip
from arc_suite.models.visuals.springs import SPRINGS
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import MATERIALS

GENERATED = [*map(sound_body, range(4)), *map(varied_body, range(4))]
BODIES = {body.name: body for body in (*ROBOTS.values(), *GENERATED)}
STEP = 0.01  # s


def turned(body, poses):
    """How the first bone is turned at each pose (7,) of a torso."""
    bones = swinging.Swinging(swinging.list_bones(body))
    return np.array([bones.follow(STEP * row, pose, FLAT)[0] for row, pose in enumerate(poses)])


def standing(body, samples):
    return np.tile((0.0, 0.0, body.torso.standing_height, 1.0, 0.0, 0.0, 0.0), (samples, 1))


def tips(body, poses, turns):
    """Where the tip of the first bone is, (samples, 3)."""
    bone = swinging.list_bones(body)[0]
    ends = bone.place + rotations.matrix(turns) @ bone.swing.tip
    return poses[:, :3] + (rotations.matrix(poses[:, 3:7]) @ ends[..., None])[..., 0]


@pytest.mark.parametrize("name", BODIES)
def test_each_body_has_a_bone_whose_shapes_lie_between_its_balls(name):
    body = BODIES[name]
    parts, _ = describe_body(body)
    bones = parts[len(body.part_names) :]
    assert [part.name for part in parts[: len(body.part_names)]] == list(body.part_names)
    assert tuple(bone.name for bone in bones) == tuple(bone.name for bone in swinging.list_bones(body))
    assert bones
    for bone in bones:
        assert not set(bone.name) & set("- ") and bone.name not in body.part_names
        swing = bone.swing
        assert bone.parent == 0 and bone.joint is bone.axis is None
        for mesh in part_meshes(bone, 0.004 * body.torso.standing_height).values():
            share = (mesh.points @ swing.tip / (swing.tip @ swing.tip)).clip(0.0, 1.0)
            distances = np.linalg.norm(mesh.points - share[:, None] * swing.tip, axis=-1)
            radii = swing.pivot_radius + share * (swing.tip_radius - swing.pivot_radius)
            assert (distances - radii).max() < 1e-6


@pytest.mark.parametrize("name", BODIES)
def test_a_tip_lags_behind_a_step_of_the_torso_and_settles(name):
    body = BODIES[name]
    poses = standing(body, 1200)
    poses[10:, 1] += 0.2 * np.linalg.norm(swinging.list_bones(body)[0].swing.tip)  # to the left, at once
    turns = turned(body, poses)
    held = tips(body, poses, np.tile((1.0, 0.0, 0.0, 0.0), (len(poses), 1)))
    left = (tips(body, poses, turns) - held)[:, 1]
    size = 0.2 * np.linalg.norm(swinging.list_bones(body)[0].swing.tip)
    assert (left[:10] == 0.0).all()
    assert left[10] < -0.5 * size  # it is still where it was, as far as its limit lets it
    assert left.max() > 0.02 * size  # it swings past
    assert abs(left[-200:]).max() < 1e-3 * size
    limit = swinging.list_bones(body)[0].swing.limit
    assert 2.0 * np.arccos(turns[:, 0].min()) <= limit + 1e-9


@pytest.mark.parametrize("name", ["queen", "bastion", "random_0"])
def test_a_tip_stays_above_the_ground_however_the_torso_lies(name):
    body = BODIES[name]
    bone = swinging.list_bones(body)[0]
    random = np.random.default_rng(0)
    quaternions = random.normal(size=(200, 4))
    poses = standing(body, len(quaternions))
    poses[:, 3:7] = quaternions / np.linalg.norm(quaternions, axis=-1, keepdims=True)
    # The pivot is a little above the ground.
    poses[:, 2] = bone.swing.tip_radius - (rotations.matrix(poses[:, 3:7]) @ bone.place)[:, 2]
    heights = tips(body, poses, turned(body, poses))[:, 2]
    assert heights.min() > bone.swing.tip_radius - 1e-9


def test_a_step_of_any_length_is_exact():
    """Half of the step twice is the same step, while the torso goes straight on."""
    bone = swinging.list_bones(ROBOTS["queen"])[0]
    state = swinging.rest(np.zeros(3))._replace(ring=np.array((0.3 + 0.1j, -0.2j, 0.0)))
    end = np.array((1.0, 0.5, 0.0))
    once = swinging.advance(bone, state, end, 0.5)
    twice = swinging.advance(bone, swinging.advance(bone, state, 0.5 * end, 0.25), end, 0.25)
    for one, other in zip(once, twice, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)


def test_springs_swing():
    assert {bone.name.removesuffix("_right") for body in BODIES.values() for bone in swinging.list_bones(body)} == {
        *SPRINGS
    }
    for spring in SPRINGS.values():
        assert 0.0 < spring.damping < 1.0 < spring.frequency and 5.0 <= spring.limit <= 60.0


@pytest.mark.slow
@nodes.needs_node
def test_pages_swing_bones_as_python_does(tmp_path):
    script = nodes.bundled(pathlib.Path(__file__).parents[1] / "engines" / "swings.js", tmp_path)
    walks, expected = [], []
    for name in ("queen", "bastion", "random_0"):
        body = BODIES[name]
        random = np.random.default_rng(1)
        poses = standing(body, 300)
        poses[:, :3] += 0.02 * body.torso.standing_height * random.normal(size=(300, 3)).cumsum(axis=0)
        poses[:, 3:7] += 0.05 * random.normal(size=(300, 4)).cumsum(axis=0)  # it tumbles
        poses[:, 3:7] /= np.linalg.norm(poses[:, 3:7], axis=-1, keepdims=True)
        times = random.uniform(0.001, 0.05, len(poses)).cumsum()
        times[201] = times[200]  # a jump, from which bones begin anew
        bones = swinging.Swinging(swinging.list_bones(body))
        ground = 0.5 * body.torso.standing_height
        arena = types.SimpleNamespace(height=lambda x, y, ground=ground: ground)
        expected.append([bones.follow(time, pose, arena)[0] for time, pose in zip(times, poses, strict=True)])
        bone = pages.to_json_values(swinging.list_bones(body)[0], decimals=None)
        walks.append({"bone": bone, "times": times.tolist(), "poses": poses.tolist(), "ground": ground})
    np.testing.assert_allclose(nodes.run(script, walks), expected, atol=1e-9)


def test_a_jump_at_the_same_time_begins_anew():
    """As two resets in a row do: the bone hangs as it does without the first one."""
    body = ROBOTS["queen"]
    poses = standing(body, 20)
    bones = swinging.Swinging(swinging.list_bones(body))
    bones.follow(0.0, poses[0] + np.array((0.5, 0.2, 0.1, 0.0, 0.0, 0.0, 0.0)), FLAT)
    turns = [bones.follow(STEP * row, pose, FLAT)[0] for row, pose in enumerate(poses)]
    np.testing.assert_array_equal(turns, turned(body, poses))


def test_bones_are_those_of_the_visuals_that_were_registered_last(monkeypatch):
    body = generate(4, 2).replace(name="swinger")
    colors = dict.fromkeys(MATERIALS, (0.5, 0.5, 0.5))
    for name in ("tail", "mast"):
        bone = Bone(name, "tail", (-0.1, 0.0, 0.05), (-0.3, 0.0, 0.2), 0.02, 0.01)
        monkeypatch.setitem(VISUALS, body.name, Visuals(colors, ornaments=whip(bone, "shell", "glow"), bones=(bone,)))
        assert [bone.name for bone in swinging.list_bones(body)] == [name]
