"""Clips that another package registers: of every kind, checked when they are made."""

import numpy as np
import pytest
from refusals import refused

import arc_suite
from arc_suite import registry
from arc_suite.animation import clips as export
from arc_suite.animation.clips import gestures
from arc_suite.animation.clips.catalog import Acted, Difference, Showcase, Turn, WalkLoop, clip_names
from arc_suite.animation.clips.root_motion import Pose
from arc_suite.envs.setup import Setup
from arc_suite.models.posture import find_rest_pose

TICK = Setup.of("tick", "steer")
REST_ANGLES = find_rest_pose(TICK.body)
REST = Pose(
    np.array((0.0, 0.0, -REST_ANGLES.sole_positions[:, 2].min())),
    np.array((1.0, 0.0, 0.0, 0.0)),
    REST_ANGLES.legs.by_joint(REST_ANGLES.joint_angles),
)
KINDS = "WalkLoop, Passage, Turn, Acted, BlowClip, Difference, Showcase"


@pytest.fixture(autouse=True)
def table(monkeypatch):
    """Take back what a test registers."""
    monkeypatch.setitem(registry.ADDITIONS, "clip", {})


@pytest.fixture
def register(monkeypatch):
    """Return a function that registers clips of this test."""
    return lambda **clips: registry.ADDITIONS["clip"].update(clips)


def dip(body, rest):
    """A short motion of the torso over its feet."""
    return gestures.torso_gesture(body, rest, {"height": ((0.0, 0.0), (2.0, -0.05), (4.0, 0.0))}, 4.0)


def test_motions_loops_and_turns_are_made_as_the_suites_are(register):
    register(dip=Acted(dip, (0, -1)), creep=WalkLoop((0.35, 0.0, 0.0)), around=Turn(90.0), paper=Showcase("medium"))
    made = {clip.name: clip for clip in export.clips(TICK, ["walk", "dip", "creep", "around", "paper"], fps=30)}
    assert list(made) == ["walk", "dip", "creep", "around", "paper"]
    low = made["dip"].motion.positions[:, 2]
    assert low[0] == pytest.approx(low[-1]) and low.min() < low[0] - 0.02 * TICK.body.torso.standing_height
    assert made["creep"].motion.twist[0] == pytest.approx(0.35 * made["walk"].motion.twist[0], rel=0.2)
    assert made["around"].motion.root[-1, 2] == pytest.approx(np.pi / 2.0)


PITCH = ((0.0, 0.0), (2.0, 0.2), (4.0, 0.0))


NUMBERS = "(there are: height, forward, left, roll, pitch, yaw)"


@pytest.mark.parametrize(
    ("tracks", "duration", "message"),
    [
        ({"nod": PITCH}, 4.0, f"unknown track 'nod'; did you mean 'pitch'? {NUMBERS}"),
        ({"hight": PITCH}, 4.0, f"unknown track 'hight'; did you mean 'height'? {NUMBERS}"),
        ({"pitch": PITCH}, 3.0, "track pitch: time: expected a number from 0 to 3, got 4.0"),
        ({"yaw": PITCH[::-1]}, 4.0, "track yaw: expected times in ascending order, got 2 after 4"),
        ({"yaw": ((0.0, "a"),)}, 4.0, "track yaw: value: expected a finite number, got 'a'"),
        ({"yaw": (0.0, 1.0)}, 4.0, "track yaw: expected pairs of a time and a value, got (0.0, 1.0)"),
        ({"yaw": ()}, 4.0, "track yaw: expected pairs of a time and a value, got ()"),
        ({"yaw": PITCH}, -1.0, "duration: expected a finite number of at least 0, got -1.0"),
    ],
)
def test_tracks_that_would_have_no_effect_are_refused(tracks, duration, message):
    with refused(message):
        gestures.torso_gesture(TICK.body, REST, tracks, duration)


def scaled(size):
    return {"pitch": tuple((time, size * value) for time, value in PITCH)}


def test_a_gesture_that_is_made_smaller_says_its_share():
    line = "^tick: legs follow 0.8 of a gesture of pitch, which is made smaller$"
    with pytest.warns(UserWarning, match=line):
        motion = gestures.torso_gesture(TICK.body, REST, scaled(1.5), 4.0)
    full = gestures.torso_gesture(TICK.body, REST, scaled(1.2), 4.0)  # without a warning
    np.testing.assert_allclose(motion.quaternions, full.quaternions, atol=1e-12)
    with refused("the legs leave the torso no room to move so: 0.1 of it fits"):
        gestures.torso_gesture(TICK.body, REST, scaled(9.0), 4.0)
    with refused("the legs leave the torso no room to move so: not even 0.02 of it fits"):
        gestures.torso_gesture(TICK.body, REST, scaled(400.0), 4.0)


@pytest.mark.slow
def test_differences_are_additive(register):
    low_walk, low = WalkLoop((1.0, 0.0, 0.0), crouch=0.2), Difference("low_walk", "walk")
    register(low_walk=low_walk, low=low, nod=Acted(dip, (0, -1), additive=True))
    made = {clip.name: clip for clip in export.clips(TICK, ["walk", "idle", "low", "nod"], fps=30)}
    assert made["low"].loops and "walk" in made["low"].additive_over
    assert made["walk"].additive_over is None and made["nod"].additive_over is not None


def test_a_name_may_have_its_module(monkeypatch, register):
    register(creep=WalkLoop((0.35, 0.0, 0.0)))
    monkeypatch.setitem(registry.MODULE_OF_NAME, ("clip", "creep"), __name__)
    (creep,) = export.clips(TICK, [f"{__name__}:creep"], fps=30)
    assert creep.name == "creep" and clip_names()[-1] == "creep"
    with refused("clips: expected each once, got creep, creep"):
        export.clips(TICK, ["creep", f"{__name__}:creep"])


@pytest.mark.parametrize(
    ("clip", "message"),
    [
        (3, f"clip 'mine': expected one of {KINDS}, got int"),
        ("math:pi", f"clip 'mine': expected one of {KINDS}, got float"),
        (
            "math:tau_",
            "clip 'mine': cannot import 'math:tau_': module 'math' has no attribute 'tau_'; did you mean 'tau'?",
        ),
        (
            "no_such:a",
            "clip 'mine': cannot import 'no_such:a': No module named 'no_such'; "
            "start in the folder of no_such.py, or put it on Python's path",
        ),
        (Acted(lambda body, rest: None, (0,)), "tick, clip mine: expected a ClipMotion of its play, got NoneType"),
        (Difference("idle", "walk"), "tick, clip mine: idle is no loop that is recorded"),
        (Showcase("prowl"), "tick, clip mine: tick has no preset prowl"),
    ],
)
def test_what_is_no_clip_is_one_line(register, clip, message):
    register(mine=clip)
    with refused(message):
        export.clips(TICK, ["mine"])


def test_names_of_the_suite_stay_its_own(register):
    register(walk=Turn(9.0))
    with refused("clip 'walk': the suite has one of this name, and __main__ registers another"):
        export.clips(TICK, ["walk"])


def test_a_registered_name_is_taken(monkeypatch):
    monkeypatch.setattr(registry, "MODULE_OF_NAME", dict(registry.MODULE_OF_NAME))
    with refused("clip 'mine' is already registered; choose another name"):
        for turn in (Turn(9.0), Turn(8.0)):
            arc_suite.register(clips={"mine": turn})
