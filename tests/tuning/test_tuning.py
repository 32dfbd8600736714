"""The search for a demonstrator's numbers: its space, its judge, its course and its journal."""

import gymnasium
import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from arc_suite.cpg import Demonstrator
from arc_suite.cpg.demonstrator import Prescribed, pattern
from arc_suite.cpg.presets import TUNINGS
from arc_suite.robots import ROBOTS
from arc_suite.tuning import Generation, Journal, Judge, Search, Space

SETTINGS = {"robot": "bastion", "seed": 3, "episodes": 2, "steps": 12, "starts": 8}


@pytest.mark.parametrize("robot", TUNINGS)
def test_space_holds_the_preset_that_it_is_about(robot):
    body, medium = ROBOTS[robot], TUNINGS[robot]["medium"]
    space = Space(body, medium)
    assert len(space.ranges()) == space.vector().size
    same = space.preset(space.vector())
    for ours, published in zip(pattern(body, same), pattern(body, medium), strict=True):
        assert_allclose(ours, published, atol=1e-12)
    for name in ("stiffness", "damping", "settle", "ramp", "ramp_start", "frequency"):
        assert getattr(same, name) == getattr(medium, name)


def test_a_lead_moves_the_clock_of_all_legs():
    body, medium = ROBOTS["leaper"], TUNINGS["leaper"]["medium"]
    space = Space(body, medium)
    led = space.preset(space.vector(lead=0.75))
    assert led.phase_offsets == (0.75, 0.25, 0.25, 0.75)
    assert led._replace(phase_offsets=medium.phase_offsets) == space.preset(space.vector())


def test_every_number_of_a_vector_counts_and_stays_within_bounds():
    space = Space(ROBOTS["tick"], TUNINGS["tick"]["medium"])
    vector, (scale, low, high, _) = space.vector(0.1), np.transpose(space.ranges())
    presets = [space.preset(vector - step) for step in np.diag(0.5 * scale)]
    assert len({str(preset) for preset in presets}) == vector.size
    assert space.preset(np.full(vector.size, 1e9)) == space.preset(high)
    assert space.preset(np.full(vector.size, -1e9)) == space.preset(low)


def test_ranks_and_sides_of_a_hip():
    medium = TUNINGS["queen"]["medium"]
    led = medium._replace(sweep=(1.0, 2.0, 3.0), centre=medium.centre | {"hip": (10.0, 20.0, 30.0)})
    hips = [i for i, name in enumerate(ROBOTS["queen"].joint_names) if name.endswith("hip")]
    laid = pattern(ROBOTS["queen"], led)
    assert_allclose(np.degrees(laid.sweep[hips]), [-1, -2, -3, 1, 2, 3])
    assert_allclose(np.degrees(laid.centre[hips]), [-10, -20, -30, 10, 20, 30])


def test_settling_is_a_crouch_or_the_centre():
    medium = TUNINGS["bastion"]["medium"]
    crouching = medium._replace(settle=4, crouch={"hip": 10, "ankle": (60, 50, 40)})
    still = np.zeros((2, 12))
    targets = []
    for preset in (medium, crouching):
        control = Prescribed.fit(ROBOTS["bastion"], preset._replace(stiffness=0.1, ramp_start=1.0))
        targets.append([np.degrees(control(np.array(clock), None, *still) / 0.1) for clock in (0, 3, 4)])
    assert_allclose(targets[0], np.tile([0, 30], (3, 6)), atol=1e-9)
    left = [-10, 60, -10, 50, -10, 40]
    assert_allclose(targets[1][:2], [left + [abs(angle) for angle in left]] * 2, atol=1e-9)
    assert abs(targets[1][2] - targets[1][1]).max() > 10


def test_stacked_controls_are_single_ones():
    body, presets = ROBOTS["queen"], TUNINGS["queen"]
    controls = [Prescribed.fit(body, preset) for preset in presets.values()]
    stacked = Prescribed.stacked(controls)
    random = np.random.default_rng(0)
    for clock in (0, 3, 14, 15, 40, 500):
        angles, velocities = random.normal(0.0, 0.3, (2, len(presets), 18))
        actions = stacked(np.full(len(presets), clock), None, angles, velocities)
        for row, control in enumerate(controls):
            assert_array_equal(actions[row], control(np.array(clock), None, angles[row], velocities[row]))


def test_judge_plays_the_episodes_of_ordinary_environments():
    presets = [TUNINGS["leaper"][name] for name in ("slow", "fast")]
    score = Judge(ROBOTS["leaper"], presets=2, episodes=2, steps=30)(presets, range(5, 7))
    environment = gymnasium.make("arc_suite/leaper-walk-v0")
    for row, preset in enumerate(presets):
        for episode in range(2):
            policy = Demonstrator("leaper", preset)
            observation, _ = environment.reset(seed=5 + episode)
            total, smoothness, tilt, axis = 0.0, 0.0, 0.0, np.zeros(3)
            for _ in range(30):
                observation, reward, _, _, info = environment.step(policy(observation))
                total += reward
                smoothness += info["reward_smoothness"]
                mujoco.mju_rotVecQuat(axis, (0.0, 0.0, 1.0), observation[1:5].astype(float))
                tilt += axis[0] ** 2 + axis[1] ** 2
            assert_allclose(score.rewards[row, episode], total / 30, rtol=1e-12)
            assert_allclose(score.style["smoothness"][row, episode], smoothness / 30, rtol=1e-12)
            assert_allclose(score.style["tilt"][row, episode], tilt / 30, rtol=1e-4)
    assert not score.falls.any()


def test_judge_counts_falls_and_pays_nothing_after_them():
    medium = TUNINGS["leaper"]["medium"]
    folding = medium._replace(stiffness=3.0, centre={"knee": -120.0, "ankle": -120.0}, sweep=0.0)
    score = Judge(ROBOTS["leaper"], presets=2, episodes=1, steps=60)([folding, medium], [0])
    assert_array_equal(score.falls, [[True], [False]])
    environment, policy, total, fallen = (
        gymnasium.make("arc_suite/leaper-walk-v0"),
        Demonstrator("leaper", folding),
        0,
        False,
    )
    observation, _ = environment.reset(seed=0)
    while not fallen:
        observation, reward, fallen, _, _ = environment.step(policy(observation))
        total += reward
    assert_allclose(score.rewards[0, 0], total / 60, rtol=1e-12)
    assert np.isfinite(score.style["posture"]).all()
    assert score.tipping[0] == 1.0
    assert 0.0 < score.tipping[1] < 0.1


def test_a_search_goes_on_where_it_was_broken_off():
    straight, resumed = Search(**SETTINGS), Search(**SETTINGS)
    generations = [straight.step() for _ in range(4)]
    for generation in generations[:3]:
        assert resumed.step(generation.fitness) is None
    assert resumed.step() == generations[3]
    assert resumed.result() == straight.result()
    assert len(generations[0].fitness) == straight.candidates
    assert generations[0] != generations[1]


def test_a_search_learns():
    search = Search(**SETTINGS | {"episodes": 1, "steps": 80})
    first = search.step()
    for _ in range(14):
        last = search.step()
    assert np.median(last.fitness) > np.median(first.fitness)
    score = Judge(ROBOTS["bastion"], 2, 2, 80)([search.result(), TUNINGS["bastion"]["medium"]], [0, 1])
    tuned, medium = score.rewards.mean(axis=-1)
    assert tuned > medium


GENERATIONS = [Generation([1.0, 2.0], 2.0, 0.0, [0.5, 0.25]), Generation([1.5, 3.0], 3.0, 0.5, [1.0, 1.0])]


def test_journal_keeps_what_was_written_when_broken_off(tmp_path):
    path = tmp_path / "journal.jsonl"
    journal = Journal(path, SETTINGS)
    for generation in GENERATIONS:
        journal.append(generation)
    whole = path.read_bytes()
    with pytest.raises(ValueError, match="journal.jsonl: another process goes on with this search$"):
        Journal(path, SETTINGS)
    journal.close()
    again = Journal(path, SETTINGS)
    assert again.generations == GENERATIONS
    again.close()
    for cut in range(len(whole)):
        path.write_bytes(whole[:cut])
        again = Journal(path, SETTINGS)
        assert again.generations == GENERATIONS[: max(whole[:cut].count(b"\n") - 1, 0)]
        for generation in GENERATIONS[len(again.generations) :]:
            again.append(generation)
        again.close()
        assert path.read_bytes() == whole


def test_a_journal_of_something_else_is_refused_and_left_alone(tmp_path):
    path = tmp_path / "journal.jsonl"
    journal = Journal(path, SETTINGS)
    journal.append(GENERATIONS[0])
    journal.close()
    whole = path.read_bytes()
    with pytest.raises(ValueError, match=r"of a search with seed 3, not 4; delete it or write to another folder$"):
        Journal(path, SETTINGS | {"seed": 4})
    assert path.read_bytes() == whole
    for text in ("notes\n", "[]\n", '{"robot": "bastion"}\n', whole.decode() + "notes\n", whole.decode() + "{}\n"):
        path.write_text(text)
        with pytest.raises(ValueError, match=r"^.*journal.jsonl: no journal of a search; delete it or write"):
            Journal(path, SETTINGS)
        assert path.read_text() == text
