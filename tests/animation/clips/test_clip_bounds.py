"""Bounds of clips: what breaks one is left out with its line, and what is drawn or simulated keeps to all."""

import functools

import mujoco
import numpy as np
import pytest
from poses import placed
from tiers import tiers

from arc_suite import models
from arc_suite.animation import clips as export
from arc_suite.animation.clips import (
    acting,
    bounds,
    from_rest,
    gestures,
    hard_ground,
    on_ground,
    standing_legs,
    turning,
)
from arc_suite.animation.clips.catalog import BOTH_ENDS, CLIPS, Acted, Turn
from arc_suite.animation.clips.root_motion import Pose
from arc_suite.bodies.families import sound_body
from arc_suite.cpg import leaps
from arc_suite.envs.setup import Setup
from arc_suite.models.posture import find_rest_pose
from arc_suite.models.standing import standing_qpos
from arc_suite.models.visuals import VISUALS
from arc_suite.models.visuals.spec import Ornament, Visuals
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import MATERIALS

TICK, QUEEN, BASTION, LEAPER = (ROBOTS[name] for name in ("tick", "queen", "bastion", "leaper"))
STANDS = Acted(gestures.idle, BOTH_ENDS)
FALLS = CLIPS["death"]
OVER_PLANTED_FEET = ("lean_right", "lean_left", "look_up", "attack", "turn_90")
SEEDS = range(7100, 7110)


@functools.cache
def rest_of(body):
    """The pose at rest, with the lowest sole on the ground."""
    rest = find_rest_pose(body)
    position = np.array((0.0, 0.0, -rest.sole_positions[:, 2].min()))
    return Pose(position, np.array((1.0, 0.0, 0.0, 0.0)), rest.legs.by_joint(rest.joint_angles))


def played(body, name):
    """The motion of a clip from rest to rest; a ValueError if the body cannot."""
    clip = CLIPS[name]
    if isinstance(clip, Turn):
        return turning.turn(body, rest_of(body), np.radians(clip.angle))
    return from_rest._act(body, clip, rest_of(body)).motion


def still(body):
    """A body that stands still for a second."""
    return standing_legs.hold_pose(rest_of(body), samples=100, time_step=0.01)


def test_each_bound_has_its_line():
    motion, height = still(TICK), TICK.torso.standing_height
    assert bounds.find_excess(TICK, STANDS, motion) == ""
    assert bounds.find_excess(TICK, FALLS, motion) == "nothing moves for 1.00 s, more than 0.9"
    low = motion.lower(0.05 * height)
    assert bounds.find_excess(TICK, STANDS, low) == "a sole is 0.050 standing heights in the ground, more than 0.03"
    aside = np.linspace(0.0, 0.07, 101)[:, None] * height
    slides = motion._replace(positions=motion.positions + aside * (1.0, 0.0, 0.0))
    assert (
        bounds.find_excess(TICK, STANDS, slides) == "a standing foot slides by 0.070 standing heights, more than 0.05"
    )
    assert bounds.find_excess(TICK, FALLS, slides) == ""
    assert bounds.measure(TICK, slides).still_seconds == 0.0
    glides = motion._replace(root=aside * (0.0, 1.0, 0.0))
    assert "a standing foot slides by 0.070" in bounds.find_excess(TICK, Turn(90.0), glides)
    turns = motion._replace(joints=motion.joints + np.linspace(0.0, 0.1, 101)[:, None])
    assert bounds.find_excess(TICK, FALLS, turns) == "a joint turns at 5.7 degrees/s in the end, more than 2.0"
    assert bounds.find_excess(TICK, Turn(180.0), motion.stretch_to(2.5)) == "it lasts 2.5 s, more than 2.0"
    lying = motion.lower(motion.positions[0, 2] - 0.2 * height)
    assert bounds.find_excess(TICK, STANDS, lying).startswith("torso or legs are 0.")


def test_the_longest_time_without_motion_is_measured():
    angles = np.concatenate([np.linspace(0.0, 0.2, 31), np.full(50, 0.2), np.linspace(0.2, 0.3, 10), np.full(10, 0.3)])
    motion = still(TICK)
    motion = motion._replace(joints=motion.joints + angles[:, None])
    assert bounds.measure(TICK, motion).still_seconds == pytest.approx(0.51, abs=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("body", [TICK, QUEEN], ids=lambda body: body.name)
def test_simulated_actions_begin_and_end_with_motion(body):
    for name in ("death", "rise", "jump"):
        motion = played(body, name)
        assert bounds.measure(body, motion).still_seconds < 0.35, name


def test_legs_of_two_joints_may_slide_and_are_measured():
    slides = still(BASTION)._replace(root=np.linspace(0.0, 0.1, 101)[:, None] * (1.0, 0.0, 0.0))
    assert bounds.find_excess(BASTION, STANDS, slides) == ""
    assert bounds.measure(BASTION, slides).slide == pytest.approx(0.1 / BASTION.torso.standing_height)


def test_the_ground_is_measured_where_mujoco_has_the_drawn_body():
    motion = still(TICK)
    turns = 0.3 * np.sin(np.arange(101))[:, None] * np.ones(len(TICK.joint_names))
    motion = motion._replace(joints=motion.joints + turns, root=np.linspace(0.0, 0.1, 101)[:, None] * np.ones(3))
    ground = on_ground.measure_ground(TICK, motion)
    places, _ = placed(TICK, motion.poses(), TICK.foot_names)
    np.testing.assert_allclose(ground.feet, places[..., :2], atol=1e-9)
    np.testing.assert_allclose(ground.soles, places[..., 2] - [leg.foot.radius for leg in TICK.legs], atol=1e-9)
    model = models.model_spec(TICK, decorated=True).compile()
    data = mujoco.MjData(model)
    belly = model.geom("visual-belly").id
    for sample in (0, 50, 100):
        qpos = standing_qpos(model)
        qpos[:] = motion.poses()[sample]
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        lowest = data.geom_xpos[belly, 2] - abs(data.geom_xmat[belly].reshape(3, 3)[2]) @ model.geom_size[belly]
        assert ground.lowest_part[sample] <= lowest + 1e-6


@pytest.mark.parametrize("name", ["turn_90", "turn_180"])
def test_a_turn_is_short_exact_and_over_planted_feet(name):
    motion = played(TICK, name)
    assert motion.seconds <= 2.0
    assert np.degrees(motion.root[-1]).tolist() == pytest.approx([0.0, 0.0, CLIPS[name].angle])
    np.testing.assert_allclose(motion.joints[-1], motion.joints[0], atol=1e-6)
    measures = bounds.measure(TICK, motion)
    assert measures.slide < 0.02 and measures.sole_depth < 0.01 and measures.last_speed < 2.0


@pytest.mark.slow
@pytest.mark.parametrize("robot", ROBOTS)
def test_robots_turn_about(robot):
    assert bounds.find_excess(ROBOTS[robot], CLIPS["turn_180"], played(ROBOTS[robot], "turn_180")) == ""


@pytest.mark.parametrize("seed", tiers(SEEDS, lambda seed: False, lambda seed: True))
def test_gestures_of_any_body_keep_to_the_bounds(seed):
    body = sound_body(seed)
    name = OVER_PLANTED_FEET[seed % len(OVER_PLANTED_FEET)]
    try:
        motion = played(body, name)
    except ValueError as error:
        assert "the legs" in str(error)
    else:
        assert bounds.find_excess(body, CLIPS[name], motion) == ""


def test_the_ground_is_measured_for_the_visuals_that_were_registered_last(monkeypatch):
    """A ball that hangs deep below the torso is what is lowest, and touches hard ground."""
    body = TICK.replace(name="painted")
    depths = []
    heights = []
    for place in (0.0, -1.5 * body.torso.standing_height):
        ball = Ornament("ball", "shell", "sphere", (0.01,), (0.0, 0.0, place))
        monkeypatch.setitem(VISUALS, body.name, Visuals(dict.fromkeys(MATERIALS, (1.0, 0.0, 0.0)), ornaments=(ball,)))
        depths.append(on_ground.measure_ground(body, still(body)).lowest_part.min())
        model = hard_ground.compile_on_hard_ground(body)
        heights.append(model.geom("visual-ball").pos[2])
    assert depths[0] > -0.01 > depths[1] + 0.3 * body.torso.standing_height
    assert heights == pytest.approx([0.0, -1.5 * body.torso.standing_height])


@pytest.mark.slow
def test_an_attack_of_a_large_body_is_over_soon():
    motion = played(QUEEN, "attack")
    assert 1.4 < motion.seconds < 1.5
    assert np.ptp(motion.positions[:, 0]) > 0.1 * QUEEN.torso.standing_height
    assert reach_of(QUEEN, motion) == pytest.approx(0.4, abs=0.01)
    assert bounds.find_excess(QUEEN, CLIPS["attack"], motion) == ""


def reach_of(body, motion):
    """How far the foot that rises most strikes ahead of where it stood, standing heights."""
    ground = on_ground.measure_ground(body, motion)
    foot = ground.soles.max(axis=0).argmax()
    return np.ptp(ground.feet[:, foot, 0]) / body.torso.standing_height


def test_a_motion_is_as_deep_as_its_deepest_foot():
    motion = still(TICK)
    assert standing_legs._measure_depth(TICK, motion) == pytest.approx(0.0, abs=1e-12)
    lower = motion._replace(positions=motion.positions - np.linspace(0.0, 0.01, 101)[:, None] * (0.0, 0.0, 1.0))
    assert standing_legs._measure_depth(TICK, lower) == pytest.approx(0.01)


@pytest.mark.long
def test_an_attack_of_a_wide_body_reaches_by_its_length():
    """Of eleven legs, whose front foot stands 2.3 standing heights ahead; it reached 0.16."""
    body = sound_body(0)
    motion = played(body, "attack")
    assert reach_of(body, motion) == pytest.approx(0.58, abs=0.02)
    assert bounds.find_excess(body, CLIPS["attack"], motion) == ""


@pytest.mark.slow
@pytest.mark.parametrize("name", ["lean_left", "look_up", "attack"])
def test_gestures_tell_what_inverse_kinematics_misses(name):
    """Leaper leaned with soles 0.15 h in the ground."""
    try:
        motion = played(LEAPER, name)
    except ValueError as error:
        assert "the legs leave the torso no room to" in str(error)
    else:
        assert bounds.measure(LEAPER, motion).sole_depth < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("body", [TICK, LEAPER], ids=lambda body: body.name)
def test_a_death_ends_at_rest_on_the_ground(body):
    motion = played(body, "death_left")
    assert bounds.find_excess(body, FALLS, motion) == ""
    measures = bounds.measure(body, motion)
    assert measures.last_speed < 2.0 and measures.part_depth < 0.01
    assert on_ground.measure_ground(body, motion).lowest_part[-1] < 0.15 * body.torso.standing_height


@pytest.mark.slow
def test_a_jump_comes_down_where_it_stood():
    """And nothing glides after it: what is left is mended in the air."""
    motion = acting.jump(QUEEN, rest_of(QUEEN))
    ground, height = on_ground.measure_ground(QUEEN, motion), QUEEN.torso.standing_height
    assert ground.soles.min(axis=1).max() > 0.1 * height
    assert np.linalg.norm((ground.feet[-1] - ground.feet[0]).mean(axis=0)) < 0.1 * height
    met = from_rest._act(QUEEN, CLIPS["jump"], rest_of(QUEEN)).motion
    landed = np.flatnonzero((ground.soles > 0.02 * height).all(axis=1))[-1] + 1
    paths = [each.positions[landed:, :2] - each.positions[-1, :2] for each in (motion, met)]
    np.testing.assert_allclose(*paths, atol=1e-6)


def test_who_cannot_jump_on_the_spot_says_why(monkeypatch):
    rest = tuple(rest_of(TICK).joints.tolist())
    flight = leaps.Flight(0.0, 0.3, 0.0, 0.1, 0.2, 0.5, 0.2, True)
    for changes, line in (
        ({}, "its feet come down 0.30 standing heights from where they stood, more than 0.1"),
        ({"clearance": 0.04}, "the clearance of its feet is 0.04 standing heights, less than 0.1"),
        ({"lowest": 0.38}, "its torso sinks to 0.4 standing heights or less"),
        ({"landed": False}, "it does not land on its feet"),
    ):
        flights = [flight._replace(**changes)] * len(leaps._JUMPS)
        monkeypatch.setattr(leaps, "_try_leaps", lambda *of, flights=flights: flights)
        with pytest.raises(ValueError, match=f"^{line}$"):
            leaps.choose_jump(TICK, rest)


@pytest.mark.slow
def test_what_breaks_a_bound_is_left_out_with_its_line(monkeypatch):
    deep = bounds.SOLE_DEPTH._replace(limit=-1.0)
    monkeypatch.setattr(bounds, "bounds_of", lambda body, clip: (deep,) if clip is CLIPS["look_up"] else ())
    setup = Setup.of("tick", "steer")
    with pytest.warns(UserWarning, match="^tick, clip look_up is left out: a sole is .* in the ground, more than -1.0"):
        idle, look_down = export.clips(setup, ["idle", "look_up", "look_down"], fps=30)
    told = export.sidecar(TICK, [idle, look_down])["clips"]
    assert 0.0 <= told["look_down"]["slide"] < 0.05 * TICK.torso.standing_height
