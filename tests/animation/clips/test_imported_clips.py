"""Clips of imported bodies: their bytes, and motions that servos make."""

import functools

import gltf_reader
import imports
import numpy as np
import pytest
from poses import placed
from tiers import never, tiers

from arc_suite.animation import clips as export
from arc_suite.animation.clips import acting, gestures
from arc_suite.animation.clips.root_motion import Pose
from arc_suite.envs.setup import Setup

BODIES = {"four legs": imports.quadruped, "six legs": imports.hexapod, "on its floor": imports.on_its_floor}
NAMES = ("walk", "idle", "hit_front", "rise", "death")
EACH = tiers(BODIES, never, lambda name: name == "four legs")


@functools.cache
def made(name):
    return {clip.name: clip for clip in export.clips(Setup.of(BODIES[name](), "steer"), NAMES, fps=30)}


@pytest.mark.parametrize("name", EACH)
def test_clips_are_in_the_bytes_as_the_simulation_moves(name):
    body, clips = BODIES[name](), made(name)
    assert set(clips) == set(NAMES)
    file = gltf_reader.read(export.glb(body, list(clips.values())))
    for animation, clip in zip(("walk_loop", "idle_loop", "hit_front", "rise", "death"), clips.values(), strict=True):
        world, feet = gltf_reader.played(file, animation), placed(body, clip.motion.poses(), body.foot_names)[0]
        for leg, foot in enumerate(body.foot_names):
            places = np.broadcast_to(world[foot][..., :3, 3], (len(feet), 3))
            assert abs(places - feet[:, leg][:, [1, 2, 0]]).max() < 1e-5


@pytest.mark.parametrize("name", EACH)
def test_servos_walk_hold_and_let_go(name):
    body, clips = BODIES[name](), made(name)
    height, rest = body.torso.standing_height, clips["idle"].motion.pose(0)
    assert clips["walk"].motion.twist[0] > 0.5 * np.sqrt(9.81 * height) * 0.3
    assert {contact.foot for contact in clips["walk"].foot_contacts} == set(body.foot_names)
    heights = {name: clip.motion.positions[:, 2] / rest.position[2] for name, clip in clips.items()}
    assert heights["death"][-1] < 0.6 and heights["rise"][0] < 0.6
    assert np.ptp(clips["hit_front"].motion.positions[:, 0]) > 0.02 * height
    for clip, end in (("hit_front", -1), ("rise", -1), ("death", 0)):
        for one, other in zip(clips[clip].motion.pose(end), rest, strict=True):
            np.testing.assert_allclose(one, other, atol=1e-6)


def test_a_part_that_shows_nothing_has_no_mesh():
    file = gltf_reader.read(export.glb(imports.hexapod(), [], "nodes"))
    empty = {node["name"] for node in file.json["nodes"] if "mesh" not in node}
    assert empty == {"root", *(f"{leg.name}_link1" for leg in imports.hexapod().legs)}
    assert all(mesh["primitives"] for mesh in file.json["meshes"])


def test_a_body_with_an_arm_stands_and_dies():
    """The servo of the arm is not taken for a release of one of the legs."""
    body = imports.with_arm()
    rest = Pose(np.array((0.0, 0.0, body.torso.standing_height)), np.array((1.0, 0.0, 0.0, 0.0)), np.zeros(12))
    strike, death = gestures.strike(body, rest), acting.death(body, rest, "left")
    assert abs(strike.joints[-1]).max() < 0.2
    assert death.positions[-1, 2] < 0.5 * rest.position[2]
