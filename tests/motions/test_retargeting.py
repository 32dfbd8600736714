"""Motions of one body for another, by the paths of feet."""

import drawn_motions
import imports
import numpy as np
import pytest

from arc_suite import motions, registry
from arc_suite.cpg import Demonstrator
from arc_suite.envs.setup import Setup
from arc_suite.models.standing import measure_standing, stability_margin
from arc_suite.motions import gait_transfer, motion_text, striding
from arc_suite.motions.paths import Size, match_feet

QUEEN = registry.body_of("queen")
SPIDER = registry.body_of("spider")
MAX_MISS = 0.05  # standing heights


def froude(motion):
    """Speed in sqrt(g h)."""
    return motion.displacement[0] / motion.seconds / np.sqrt(9.81 * motion.standing_height)


@pytest.mark.parametrize("body", [SPIDER, registry.body_of("varied:3"), imports.quadruped()], ids=lambda b: b.name)
def test_loop_keeps_its_speed_and_strides_in_the_gait_of_the_other_body(body):
    steps = drawn_motions.step_loop(QUEEN)
    motion, notes = motions.retarget(steps, body)
    motions.check_body(motion, body)
    assert motion.loops and notes[-1].startswith("feet miss their paths by up to 0.0")
    assert froude(motion) == pytest.approx(froude(steps), rel=1e-6)
    gait = gait_transfer.find_gait(body)
    assert motion.planted[:-1].mean() == pytest.approx(gait.duty_factor, abs=0.06)
    # A foot in stance does not slide, and a swing is as high over its stance as that of the other body.
    swing_height = steps.soles[..., 2].max() - steps.soles[steps.planted][:, 2].mean()
    for leg in range(len(body.legs)):
        planted = motion.planted[:-1, leg] & motion.planted[1:, leg]
        slides = np.linalg.norm(np.diff(motion.soles[:, leg], axis=0), axis=-1)[planted]
        assert slides.max() < 2 * MAX_MISS and abs(motion.soles[motion.planted[:, leg], leg, 2]).max() < MAX_MISS
        assert motion.soles[:, leg, 2].max() == pytest.approx(swing_height, abs=0.03)
    # Touchdowns have the order of the gait.
    starts = [gait_transfer._find_steps(planted).starts[0] for planted in motion.planted[:-1].T]
    phases = (np.array(starts) - starts[0] + np.array(gait.offsets) - gait.offsets[0] + 0.5) % 1.0 - 0.5
    assert abs(phases).max() <= 1.5 / (motion.frames - 1)
    np.testing.assert_allclose(motion.angles[-1], motion.angles[0], atol=0.01)


def test_loop_closes_on_legs_with_four_joints():
    """Their joints drifted by up to a degree in a cycle, and a longer motion by as much in each of its steps."""
    motion, _ = motions.retarget(drawn_motions.step_loop(QUEEN), registry.body_of("random:17"))
    np.testing.assert_allclose(motion.angles[-1], motion.angles[0], atol=np.radians(0.2))


@pytest.mark.parametrize(("source", "half_path"), [("tick", 0.21), ("tick", 0.36), ("spider", 0.36), ("queen", 0.18)])
def test_a_loop_that_stretched_legs_leave_open_gets_a_lower_torso(source, half_path):
    """Joints of stretched legs came back up to 2 rad elsewhere, and the loop was refused."""
    body = registry.body_of(source)
    gait = gait_transfer.find_gait(body)
    velocity = 2.0 * half_path * body.torso.standing_height * 1.5 / gait.duty_factor
    steps = striding.stride(body, 1.5, gait.duty_factor, np.array(gait.offsets), velocity)
    motion, notes = motions.retarget(steps, registry.body_of("hound"))
    assert any(note.startswith("the torso is lower by") for note in notes)
    np.testing.assert_allclose(motion.angles[-1], motion.angles[0], atol=0.05)
    assert froude(motion) == pytest.approx(froude(steps), rel=1e-6)


def test_gesture_has_the_foot_that_stands_in_the_same_place():
    raised = drawn_motions.raise_leg(QUEEN, 0)
    motion, notes = motions.retarget(raised, SPIDER)
    front_left = 0
    heights = motion.soles[..., 2].max(axis=0)
    assert heights[front_left] == pytest.approx(drawn_motions.RAISE, abs=0.01)
    assert np.delete(heights, front_left).max() < 0.01
    assert notes[0] == "without a partner, planted: l3, r3"
    assert motion.seconds == pytest.approx(raised.seconds * np.sqrt(0.25 / 0.75), rel=1e-6)
    assert not motion.planted[20, front_left] and motion.planted.sum(axis=1).min() == 7


@pytest.mark.slow
@pytest.mark.parametrize("draw", [drawn_motions.step_loop, lambda body: drawn_motions.raise_leg(body, 0)])
def test_an_imported_body_follows_the_motion_of_a_robot(draw):
    motion, _ = motions.retarget(draw(QUEEN), imports.quadruped())
    setup = Setup.of(imports.quadruped(), "mimic", {"motion": motion_text.to_text(motion)})
    environments = setup.make_vec(8)
    tracked = Demonstrator(environments)
    observation, _ = environments.reset(seed=0)
    tracked.reset(range(8))
    for _ in range(100):
        observation, _, terminations, *_ = environments.step(tracked.act(environments.task.split(observation)))
        assert not terminations.any()
    assert environments.task.progress["torso_error"].max() < 0.05
    assert environments.task.progress["joint_error"].max() < 0.08


def test_torso_moves_over_the_feet_that_carry():
    """Four legs would fall over the corner whose foot is raised."""
    quadruped = imports.quadruped()
    motion, notes = motions.retarget(drawn_motions.raise_leg(QUEEN, 0), quadruped)
    (note,) = [note for note in notes if note.startswith("the torso shifts by up to")]
    center = (motion.positions[20] + measure_standing(quadruped).center) / motion.standing_height
    margin = stability_margin(center, motion.soles[20, motion.planted[20]])
    assert motion.planted[20].sum() == 3 and margin == pytest.approx(0.05, abs=0.01), note
    assert not [note for note in notes if note.startswith("the center of mass is")]


def test_middle_legs_are_left_out_of_four_legs():
    motion, notes = motions.retarget(drawn_motions.raise_leg(QUEEN, 1), imports.quadruped())
    assert f"without a partner, left out: {QUEEN.legs[1].name}" in notes
    assert motion.planted.all()


@pytest.mark.slow
def test_legs_that_do_not_reach_to_the_sides():
    """The hinges of each leg of Leaper but the first are parallel."""
    steps = drawn_motions.step_loop(QUEEN)
    sideways = steps._replace(soles=steps.soles + (0.0, 1.0, 0.0) * steps.soles[..., 2:])
    motion, notes = motions.retarget(sideways, registry.body_of("leaper"))
    assert 0.4 * froude(steps) < froude(motion) <= froude(steps) * 1.001
    assert float(notes[-1].split()[-3]) <= MAX_MISS
    assert any(note.endswith(", so that legs reach") for note in notes)


def test_legs_of_two_joints_slide():
    """They keep the height of their feet, and miss their places."""
    body = registry.body_of("varied:9")
    assert len(body.legs[0].joints) == 2
    motion, notes = motions.retarget(drawn_motions.step_loop(QUEEN), body)
    assert MAX_MISS < float(notes[-1].split()[-3]) <= 0.15
    assert abs(motion.soles[motion.planted][:, 2]).max() < MAX_MISS


@pytest.mark.slow
def test_motion_that_legs_cannot_follow_is_one_line():
    raised = drawn_motions.raise_leg(QUEEN, 0)
    far = raised._replace(soles=raised.soles + (3.0, 0.0, 0.0) * (np.arange(6) == 0)[:, None])
    with pytest.raises(ValueError, match="motion 'raise' of queen: spider cannot follow it, l1 misses its path by"):
        motions.retarget(far, SPIDER)


def test_feet_match_by_their_places():
    rest = motions.find_rest(QUEEN)[0]
    assert match_feet(rest, 0.3 * rest) == [0, 1, 2, 3, 4, 5]
    assert match_feet(rest, rest[[0, 2, 3, 5]]) == [0, 2, 3, 5]
    partners = match_feet(rest, motions.find_rest(SPIDER)[0])
    assert sorted(partner for partner in partners if partner is not None) == [0, 1, 2, 3, 4, 5]
    assert partners[0] == 0 and partners[3] == 2 and partners[4] == 3 and partners[7] == 5


def step_with(body, counts):
    """A loop in which each foot takes a number of steps."""
    cycle = np.linspace(0.0, 1.0, 61)
    planted = np.stack([cycle * count % 1.0 < 0.6 for count in counts], axis=-1)
    planted[-1] = planted[0]
    height = body.torso.standing_height
    positions = np.stack([0.2 * cycle, 0.0 * cycle, np.full(61, height)], axis=-1)
    level = np.tile((1.0, 0.0, 0.0, 0.0), (61, 1))
    angles = np.zeros((61, len(body.joint_names)))
    return motions.make(body, "odd", 60.0, True, positions, level, angles, planted)


@pytest.mark.parametrize(
    ("counts", "cycles"),
    [((1, 1, 1, 3, 3, 3), 1), ((2, 2, 4, 4, 0, 0), 2), ((1, 1, 1, 1, 3, 3), 1), ((1, 3, 3, 3, 3, 3), 3)],
)
def test_feet_that_step_more_often_than_others(counts, cycles):
    bastion = registry.body_of("bastion")
    steps = step_with(bastion, counts)
    assert gait_transfer.count_cycles(steps) == cycles
    motion, notes = motions.retarget(steps, registry.body_of("tick"))
    assert notes[0].startswith(f"gait: {cycles} cycles with a duty factor of 0.60, before 0.60; ")
    assert motion.seconds > 0.0 and np.isfinite(motion.angles).all()
    partners = match_feet(steps.rest_soles, motion.rest_soles)
    for leg, foot in enumerate(partners):
        starts = gait_transfer._find_steps(motion.planted[:-1, leg]).starts
        assert len(starts) == counts[foot]


def test_a_torso_that_turns_over_in_steps_turns_evenly():
    steps = step_with(registry.body_of("bastion"), (1, 1, 1, 1, 1, 1))
    halves = np.pi * np.linspace(0.0, 1.0, 61)
    quaternions = np.stack([np.cos(halves), np.sin(halves), 0.0 * halves, 0.0 * halves], axis=-1)
    paths, _ = gait_transfer.transfer(steps._replace(quaternions=quaternions), QUEEN, Size())
    assert len(paths.quaternions) > steps.frames  # frames lie between those of the motion
    cosines = abs((paths.quaternions[1:] * paths.quaternions[:-1]).sum(axis=-1)).clip(0.0, 1.0)
    turns = np.degrees(2.0 * np.arccos(cosines))
    np.testing.assert_allclose(turns, 360.0 / len(turns), rtol=0.05)
