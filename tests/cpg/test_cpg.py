"""Demonstrators against the published figures."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import arc_suite
from arc_suite import evaluation
from arc_suite.cpg import PRESETS, Demonstrator
from arc_suite.cpg.presets import TUNINGS
from arc_suite.robots import ROBOTS
from arc_suite.tuning import Judge

# preset medium: centre, stance and swing bends in degrees by rank from the front.
MEDIUM = {
    "queen": {
        "kd": 0.18,
        "settle": 15,
        "frequency": 1.5,
        "hip": 26,
        "knee": ((-25, 15, -45), (-25, 15, -45), (25, -15, 45)),
        "ankle": ((15, 35, 35), (30, 0, 55), (-15, -35, -35)),
    },
    "bastion": {"kd": 0.15, "settle": 15, "frequency": 1.5, "hip": 26, "ankle": ((30, -20, 45),) * 3},
    "tick": {
        "kd": 0.18,
        "settle": 15,
        "frequency": 1.5,
        "hip": 40,
        "knee": ((0, 12, -40),) * 3,
        "ankle": ((0, 0, 45),) * 3,
    },
    "leaper": {
        "kd": 0.15,
        "settle": 0,
        "frequency": 1.2,
        "hip": 30,
        "knee": ((0, 0, -55),) * 2,
        "ankle": ((0, 25, 75), (0, 0, -75)),
    },
}
OFFSETS = {"l1": 0.5, "r1": 0, "l2": 0, "r2": 0.5, "l3": 0.5, "r3": 0, "fl": 0, "fr": 0.5, "rl": 0.5, "rr": 0}
RANKS = {"l1": 0, "r1": 0, "l2": 1, "r2": 1, "l3": 2, "r3": 2, "fl": 0, "fr": 0, "rl": 1, "rr": 1}
LEFT = ("l1", "l2", "l3", "fl", "rl")


def expected_target(robot, joint, step):
    """A joint's target by the law of the published demonstrators, rad."""
    figures = MEDIUM[robot]
    leg, part = joint.rsplit("_", 1)
    hip = part == "hip"
    centre, stance, swing = (0, 0, 0) if hip else figures[part][RANKS[leg]]
    if step < figures["settle"]:
        return math.radians(centre)
    cycle = (figures["frequency"] * 0.05 * step + OFFSETS[leg]) % 1.0
    if cycle < 0.6:
        s = cycle / 0.6
        sweep, bend = 1 - 2 * s, stance * math.sin(math.pi * s)
    else:
        w = (cycle - 0.6) / 0.4
        sweep, bend = 2 * w - 1, swing * math.sin(math.pi * w)
    angle = figures["hip"] * sweep * (-1 if leg in LEFT else 1) if hip else centre + bend
    return math.radians(angle)


@pytest.mark.parametrize("robot", MEDIUM)
def test_action_is_the_published_law(robot):
    joints = ROBOTS[robot].joint_names
    n = len(joints)
    size = sum(spec.shape[0] for spec in arc_suite.load(robot, "walk").observation_spec().values())
    demonstrator = Demonstrator(robot)
    rng = np.random.default_rng(1)
    ramp, start = (15, 0.2) if robot == "leaper" else (20, 0.3)
    for step in range(200):
        observation = rng.normal(0, 0.2, size)
        angles, velocities = observation[5 : 5 + n], observation[11 + n : 11 + 2 * n]
        targets = [expected_target(robot, joint, step) for joint in joints]
        kp = 0.8 * (start + (1 - start) * min(1.0, step / ramp))
        expected = np.clip(kp * (targets - angles) - MEDIUM[robot]["kd"] * velocities, -1, 1)
        cycle_edges = [(MEDIUM[robot]["frequency"] * 0.05 * step + OFFSETS[j.rsplit("_", 1)[0]]) % 1 for j in joints]
        sure = [min(abs(c - edge) for edge in (0.0, 0.6, 1.0)) > 1e-9 for c in cycle_edges]
        action = demonstrator(observation)
        assert action.shape == (n,)
        assert_allclose(action[sure], expected[sure], atol=1e-12, err_msg=f"step {step}")


# Mean return of 10 seeds; the published lines with the tolerance that the paper's figures carry.
PUBLISHED = {"queen": (2049, 0.015), "tick": (1971, 0.015), "bastion": (2324, 0.015), "leaper": (2653, 0.05)}


@pytest.mark.parametrize("robot", PUBLISHED)
def test_medium_earns_the_published_return(robot):
    environment = arc_suite.load(robot, "walk")
    results = evaluation.episodes(environment, Demonstrator(robot))
    published, tolerance = PUBLISHED[robot]
    assert_allclose(np.mean([episode.total for episode in results]), published, rtol=tolerance)
    assert {episode.length for episode in results} == {1000}


# Mean return of 10 seeds, with the tolerance that their scatter asks for.
TUNED = {"queen": (3830, 0.005), "bastion": (3796, 0.005), "tick": (3814, 0.005), "leaper": (3567, 0.01)}


@pytest.mark.parametrize("robot", TUNED)
def test_tuned_earns_most_and_walks_no_worse_than_medium(robot):
    presets = [TUNINGS[robot][name] for name in ("tuned", "medium")]
    score = Judge(ROBOTS[robot], presets=2, episodes=10, steps=1000)(presets, range(10))
    expected, tolerance = TUNED[robot]
    assert_allclose(1000 * score.rewards[0].mean(), expected, rtol=tolerance)
    assert not score.falls.any()
    for cost, (tuned, medium) in score.style.items():
        assert tuned.mean() <= medium.mean(), cost


@pytest.mark.parametrize("robot", ROBOTS)
def test_no_preset_falls_and_medium_walks_at_the_target_speed(robot):
    environment = arc_suite.load(robot, "walk")
    episodes = {preset: evaluation.run(environment, Demonstrator(robot, preset), seed=1) for preset in PRESETS}
    assert {episode.length for episode in episodes.values()} == {1000}
    assert 0.0 < episodes["slow"].speed < episodes["medium"].speed
    target = environment.task.settings.parameters.target_velocity
    assert_allclose(episodes["medium"].speed, target, rtol=0.02)


def test_every_form_of_observation_gives_the_same_action():
    environment = arc_suite.load("bastion", "walk", {"random": 0})
    timestep = environment.reset()
    forms = [Demonstrator("bastion") for _ in range(4)]
    for _ in range(30):
        blocks = timestep.observation
        flat = np.concatenate(list(blocks.values()))
        actions = [
            form(observation)
            for form, observation in zip(forms, (timestep, blocks, flat, {"observations": flat}), strict=True)
        ]
        for action in actions[1:]:
            assert_array_equal(actions[0], action)
        timestep = environment.step(actions[0])


def test_batch_rows_are_single_demonstrators_and_restart_alone():
    rng = np.random.default_rng(0)
    batch, singles = Demonstrator("tick"), [Demonstrator("tick") for _ in range(3)]
    for step in range(60):
        observations = rng.normal(0, 0.3, (3, 199))
        if step == 25:
            batch.reset([1])
            singles[1].reset()
        if step == 40:
            batch.reset(np.array([True, False, True]))
            singles[0].reset()
            singles[2].reset()
        actions = batch(observations)
        for row, single in enumerate(singles):
            assert_array_equal(actions[row], single(observations[row]))


def test_first_timestep_restarts_the_clock():
    environment = arc_suite.load("leaper", "walk", {"random": 0})
    demonstrator = Demonstrator("leaper")
    first = environment.reset()
    before = demonstrator(first)
    for _ in range(7):
        demonstrator(environment.step(before))
    assert_array_equal(demonstrator(first), before)


def test_wrong_observation_and_names_are_one_line_errors():
    with pytest.raises(ValueError, match=r"^observation: expected 199 numbers, got shape \(198,\)$"):
        Demonstrator("queen")(np.zeros(198))
    with pytest.raises(ValueError, match=r"^unknown preset 'meduim'; did you mean 'medium'\?"):
        Demonstrator("queen", "meduim")
    with pytest.raises(ValueError, match=r"^preset: queen has 6 legs, and phase_offsets is for 4$"):
        Demonstrator("queen", TUNINGS["leaper"]["medium"])
    with pytest.raises(ValueError, match=r"^preset: does not fit queen: KeyError: 'knee'$"):
        Demonstrator("queen", TUNINGS["bastion"]["tuned"])
    with pytest.raises(ValueError, match=r"^unknown robot 'quene'; did you mean 'queen'\?"):
        Demonstrator("quene")
