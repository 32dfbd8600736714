"""Demonstrators: the published law, environments and single ones, any control step."""

import math
import warnings
from typing import NamedTuple

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused
from tiers import tiers

import arc_suite
from arc_suite import rotations
from arc_suite.bodies import generator
from arc_suite.cpg import Demonstrator
from arc_suite.cpg.prescribed import Bend, Prescribed, Preset, lay_out_pattern
from arc_suite.cpg.presets import PRESETS
from arc_suite.cpg.selection import presets_of, suited_preset
from arc_suite.models.sizing import control_timestep
from arc_suite.robots import ROBOTS
from arc_suite.style import record


class Medium(NamedTuple):
    """Preset medium: of knees and ankles the center, stance and swing bends in degrees by rank from the front."""

    kd: float
    settle: int
    frequency: float
    hip: int
    ankle: tuple
    knee: tuple = ()


MEDIUM = {
    "queen": Medium(
        *(0.18, 15, 1.5, 26),
        ankle=((15, 35, 35), (30, 0, 55), (-15, -35, -35)),
        knee=((-25, 15, -45), (-25, 15, -45), (25, -15, 45)),
    ),
    "bastion": Medium(0.15, 15, 1.5, 26, ankle=((30, -20, 45),) * 3),
    "tick": Medium(0.18, 15, 1.5, 40, ankle=((0, 0, 45),) * 3, knee=((0, 12, -40),) * 3),
    "leaper": Medium(0.15, 0, 1.2, 30, ankle=((0, 25, 75), (0, 0, -75)), knee=((0, 0, -55),) * 2),
}
OFFSETS = {"l1": 0.5, "r1": 0, "l2": 0, "r2": 0.5, "l3": 0.5, "r3": 0, "fl": 0, "fr": 0.5, "rl": 0.5, "rr": 0}
UPRIGHT = np.array((1.0, 0.0, 0.0, 0.0))
RANKS = {"l1": 0, "r1": 0, "l2": 1, "r2": 1, "l3": 2, "r3": 2, "fl": 0, "fr": 0, "rl": 1, "rr": 1}
LEFT = ("l1", "l2", "l3", "fl", "rl")


@pytest.mark.parametrize(
    ("body", "task", "settings", "preset"),
    [
        (ROBOTS["queen"], "walk", {}, "refined"),
        (ROBOTS["queen"], "shoved", {}, "braced"),
        (ROBOTS["queen"], "roam", {}, "braced"),
        (generator.generate(4, 2), "steer", {}, "steered"),
        (ROBOTS["tick"], "rough", {}, "climbing"),
        (ROBOTS["tick"], "rough", {"exclude_blocks": "command"}, "refined"),
        (ROBOTS["leaper"], "rough", {}, "climbing"),
        (ROBOTS["leaper"], "directed", {}, "posed"),
        (generator.generate(4, 2), "directed", {}, "posed"),
        (ROBOTS["queen"], "directed", {}, "steered"),
        (ROBOTS["tick"], "gaps", {}, "sighted"),
        (ROBOTS["tick"], "navigate", {}, "planned"),
        (generator.generate(4, 2), "walk", {}, "straight"),
    ],
)
def test_whom_to_watch_and_to_imitate(body, task, settings, preset):
    assert suited_preset(arc_suite.load(body, task, settings).task.definition) == preset


def expected_target(robot, joint, step):
    """A joint's target by the law of the published demonstrators, rad."""
    figures = MEDIUM[robot]
    leg, part = joint.rsplit("_", 1)
    hip = part == "hip"
    center, stance, swing = (0, 0, 0) if hip else getattr(figures, part)[RANKS[leg]]
    if step < figures.settle:
        return math.radians(center)
    cycle = (figures.frequency * 0.05 * step + OFFSETS[leg]) % 1.0
    if cycle < 0.6:
        s = cycle / 0.6
        sweep, bend = 1 - 2 * s, stance * math.sin(math.pi * s)
    else:
        w = (cycle - 0.6) / 0.4
        sweep, bend = 2 * w - 1, swing * math.sin(math.pi * w)
    angle = figures.hip * sweep * (-1 if leg in LEFT else 1) if hip else center + bend
    return math.radians(angle)


@pytest.mark.parametrize("robot", MEDIUM)
def test_action_is_the_published_law(robot):
    joints = ROBOTS[robot].joint_names
    n = len(joints)
    task = arc_suite.load(robot, "walk").task.definition
    demonstrator = Demonstrator(robot, "medium")
    rng = np.random.default_rng(1)
    ramp, start = (15, 0.2) if robot == "leaper" else (20, 0.3)
    for step in range(200):
        observation = rng.normal(0, 0.2, task.size)
        angles, velocities = observation[5 : 5 + n], observation[11 + n : 11 + 2 * n]
        targets = [expected_target(robot, joint, step) for joint in joints]
        kp = 0.8 * (start + (1 - start) * min(1.0, step / ramp))
        expected = np.clip(kp * (targets - angles) - MEDIUM[robot].kd * velocities, -1, 1)
        cycle_edges = [(MEDIUM[robot].frequency * 0.05 * step + OFFSETS[j.rsplit("_", 1)[0]]) % 1 for j in joints]
        sure = [min(abs(c - edge) for edge in (0.0, 0.6, 1.0)) > 1e-9 for c in cycle_edges]
        action = demonstrator.act(task.split(observation))
        assert action.shape == (n,)
        assert_allclose(action[sure], expected[sure], atol=1e-12, err_msg=f"step {step}")


@pytest.mark.filterwarnings("ignore:.*another robot")  # what is felt here is drawn at random
def test_batches_are_single_demonstrators_and_restart_alone():
    rng = np.random.default_rng(0)
    batch, singles = Demonstrator("tick", "medium"), [Demonstrator("tick", "medium") for _ in range(3)]
    split = arc_suite.load("tick", "walk").task.definition.split
    for step in range(60):
        observations = rng.normal(0, 0.3, (3, 199))
        restarting = {25: [1], 40: [0, 2]}.get(step, [])
        batch.reset(restarting)
        for index in restarting:
            singles[index].reset([0])
        actions = batch.act(split(observations))
        for index, single in enumerate(singles):
            assert_array_equal(actions[index], single.act(split(observations[index])))


def test_first_timestep_restarts_the_clock():
    environment = arc_suite.load("leaper", "walk", {"random": 0})
    demonstrator = Demonstrator("leaper", "medium")
    first = environment.reset()
    before = demonstrator(first)
    for _ in range(7):
        demonstrator(environment.step(before))
    assert_array_equal(demonstrator(first), before)


def test_presets_of_other_bodies_are_one_line_errors():
    with pytest.raises(ValueError, match=r"^walk: expected a body named 'queen' to have the 18 joints of queen, g"):
        Demonstrator(ROBOTS["bastion"].replace(name="queen"))
    with pytest.raises(ValueError, match=r"^preset: queen has 6 legs, and phase_offsets is for 4$"):
        Demonstrator("queen", PRESETS["leaper"]["medium"])
    with pytest.raises(ValueError, match=r"^preset: does not fit queen: KeyError: 'knee'$"):
        Demonstrator("queen", PRESETS["bastion"]["tuned"])


# A robot of another package: its control step follows from its size, and its presets from nowhere.
CREEPER = generator.generate(4, 2).replace(name="creeper")
CREEPING = Preset(
    stiffness=0.6,
    damping=0.1,
    settle=0,
    ramp=1,
    ramp_start=1.0,
    frequency=1.2,
    duty_factor=0.6,
    phase_offsets=(0.0, 0.5, 0.5, 0.0),
    sweep=20,
    center={"knee": 0},
    bends={"knee": Bend(stance=0, swing=30)},
)


@pytest.mark.parametrize("height", tiers([None, 0.05, 4.0], lambda height: height == 4.0))
def test_a_registered_robot_moves_at_the_frequency_that_its_preset_asks_for(height, monkeypatch):
    body = CREEPER if height is None else generator.scaled(CREEPER, height / 0.4).replace(name="creeper")
    monkeypatch.setitem(ROBOTS, "creeper", body)
    monkeypatch.setitem(PRESETS, "creeper", {"medium": CREEPING, "fast": CREEPING._replace(frequency=1.8)})
    environment = arc_suite.load("creeper", "walk", {"time_limit": 400 * control_timestep(body)})
    step = environment.control_timestep()
    assert step == pytest.approx(control_timestep(body)) and abs(step - 0.05) > 0.005
    for preset, frequency in (("medium", 1.2), ("fast", 1.8)):
        track = record(environment, Demonstrator("creeper", preset), seed=0)
        actions = track.actions[:, 0] - track.actions[:, 0].mean()
        spectrum = abs(np.fft.rfft(actions))
        found = np.fft.rfftfreq(len(actions), track.time_step)[spectrum.argmax()]
        assert found == pytest.approx(frequency, abs=1.0 / (len(actions) * step)), preset


def test_a_robots_numbers_go_by_its_name():
    queen = ROBOTS["queen"]
    heavier = queen.replace(density=10.001)
    assert presets_of(heavier) == PRESETS["queen"]
    blocks = {name: block[None] for name, block in arc_suite.load("queen", "steer").reset(0).observation.items()}
    for preset in [name for name, preset in PRESETS["queen"].items() if isinstance(preset, Preset)]:
        ours, theirs = (Demonstrator(body, preset) for body in (queen, heavier))
        for _ in range(20):
            assert_array_equal(ours.act(blocks), theirs.act(blocks))


def test_ranks_and_sides_of_a_hip():
    medium = PRESETS["queen"]["medium"]
    led = medium._replace(sweep=(1.0, 2.0, 3.0), center=medium.center | {"hip": (10.0, 20.0, 30.0)})
    hips = [i for i, name in enumerate(ROBOTS["queen"].joint_names) if name.endswith("hip")]
    laid = lay_out_pattern(ROBOTS["queen"], led)
    assert_allclose(np.degrees(laid.sweep[hips]), [-1, -2, -3, 1, 2, 3])
    assert_allclose(np.degrees(laid.center[hips]), [-10, -20, -30, 10, 20, 30])


def test_settling_is_a_crouch_or_the_center():
    medium = PRESETS["bastion"]["medium"]
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
    body, presets = ROBOTS["queen"], [preset for preset in PRESETS["queen"].values() if isinstance(preset, Preset)]
    controls = [Prescribed.fit(body, preset) for preset in presets]
    stacked = Prescribed.stack(controls)
    random = np.random.default_rng(0)
    for clock in (0, 3, 14, 15, 40, 500):
        quaternions = rotations.turn_about_z(UPRIGHT, random.uniform(-1.0, 1.0, len(presets)))
        angles, velocities = random.normal(0.0, 0.3, (2, len(presets), 18))
        actions = stacked(np.full(len(presets), clock), quaternions, angles, velocities)
        for index, control in enumerate(controls):
            alone = control(np.array(clock), quaternions[index], angles[index], velocities[index])
            assert_array_equal(actions[index], alone)


def test_torques_ahead_are_harmonics_of_the_legs_phase_and_steering_by_yaw():
    body, medium = ROBOTS["leaper"], PRESETS["leaper"]["medium"]
    rows = {
        "hip": ((0.1, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.02)),
        "knee": ((0.0, 0.03, 0.0, 0.0), (0.0, 0.0, 0.04, 0.0)),
        "ankle": ((0.0, 0.0, 0.0, 0.0), (0.005, 0.0, 0.0, 0.006)),
    }
    limp = medium._replace(stiffness=0.0, damping=0.0, torques=rows, steering=-0.2)
    control, still, yaw = Prescribed.fit(body, limp), np.zeros(12), 0.3
    offsets = dict(zip((leg.name for leg in body.legs), medium.phase_offsets, strict=True))
    for clock in (0, 1, 7, 123):
        action = control(np.array(clock), rotations.turn_about_z(UPRIGHT, np.array(yaw)), still, still)
        for name, found in zip(body.joint_names, action, strict=True):
            leg, _, joint = name.partition("_")
            phase = 2.0 * np.pi * (medium.frequency * 0.05 * clock + offsets[leg])
            waves = np.array([np.cos(phase), np.cos(2 * phase), np.sin(phase), np.sin(2 * phase)])
            expected = waves @ rows[joint][0 if leg[0] == "f" else 1]
            if joint == "hip":
                expected = (-expected if leg[1] == "l" else expected) - 0.2 * yaw * np.cos(phase)
            assert_allclose(found, expected, atol=1e-12)


def test_torques_ahead_are_added_to_those_of_the_loop_and_clipped_with_them():
    body, medium = ROBOTS["bastion"], PRESETS["bastion"]["medium"]
    rows = {"hip": ((0.3, 0.1),) * 3, "ankle": ((-0.2, 0.4),) * 3}
    random = np.random.default_rng(0)
    for clock in (0, 20, 21):
        state = UPRIGHT, random.normal(0.0, 0.3, 12), random.normal(0.0, 0.3, 12)
        tight, weak = medium._replace(damping=1.0), medium._replace(stiffness=0.0, damping=0.0)
        both, loop, ahead = (
            Prescribed.fit(body, preset)(np.array(clock), *state)
            for preset in (tight._replace(torques=rows), tight, weak._replace(torques=rows))
        )
        inside = (abs(loop) < 1.0) & (abs(both) < 1.0)
        assert inside.any() and (abs(both) <= 1.0).all()
        assert_allclose(both[inside], (loop + ahead)[inside], atol=1e-12)


@pytest.mark.slow
def test_steering_turns_back_to_where_the_robot_started():
    def last_yaw(steering):
        environment = arc_suite.load("leaper", "walk", {"time_limit": 20.0})
        demonstrator = Demonstrator("leaper", PRESETS["leaper"]["tuned"]._replace(steering=steering))
        timestep, yaws = environment.reset(1), []
        while not timestep.last():
            timestep = environment.step(demonstrator(timestep))
            yaws.append(rotations.yaw(timestep.observation["posture"][1:5]))
        return abs(np.mean(yaws[-100:]))

    back, straight, away = map(last_yaw, (-0.2, 0.0, 0.1))
    assert back < 0.5 * straight and straight < 0.2 * away


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ({"hip": ((0.0, 0.1),) * 2}, "preset: does not fit leaper: KeyError: 'knee'"),
        ({name: ((0.0, 0.1),) for name in ("hip", "knee", "ankle")}, "preset: does not fit leaper: IndexError: tuple "),
        ({name: ((0.0,) * 3,) * 2 for name in ("hip", "knee", "ankle")}, "preset: does not fit leaper: ValueError: "),
    ],
)
def test_torques_that_do_not_fit_are_refused_in_one_line(rows, message):
    with refused(message, begins=True):
        Demonstrator("leaper", PRESETS["leaper"]["medium"]._replace(torques=rows))


@pytest.mark.parametrize("preset", ["medium", "steered"])
@pytest.mark.parametrize(("robot", "other"), [("bastion", "leaper"), ("leaper", "bastion")])
def test_another_robot_of_as_many_joints_is_told_by_its_parts(robot, other, preset):
    timestep = arc_suite.load(other, "steer", {"random": 0}).reset()
    parts, theirs = len(ROBOTS[robot].part_names), len(ROBOTS[other].part_names)
    with refused(f"observation: expected contact forces of {parts} rigid bodies, got {theirs}"):
        Demonstrator(robot, preset)(timestep)


@pytest.mark.parametrize(("robot", "other", "stands"), [("queen", "tick", "0.75"), ("tick", "queen", "0.18")])
def test_another_robot_of_as_many_parts_is_warned_of_by_its_height(robot, other, stands):
    environment, demonstrator = arc_suite.load(other, "walk", {"random": 0}), Demonstrator(robot, "medium")
    with pytest.warns(UserWarning) as caught:
        timestep = environment.step(demonstrator(environment.reset()))
        demonstrator(timestep)
    (warning,) = caught
    assert str(warning.message) == (
        f"{robot} stands {stands} m high, and the torso starts below half or above twice that: "
        "is this the demonstrator of another robot?"
    )


@pytest.mark.parametrize("robot", ROBOTS)
def test_nobody_is_warned_of_the_robot_itself(robot):
    demonstrator = Demonstrator(robot, "medium")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        environment = arc_suite.load(robot, "walk", {"random": 0})
        for _ in range(20):
            demonstrator(environment.reset())
        low = environment.reset().observation
        low["posture"][0] *= 0.3  # it may fall once it walks
        demonstrator.act({name: block[None] for name, block in low.items()})


def test_a_snapshot_from_before_the_first_action_goes_back_to_it():
    environment, demonstrator = arc_suite.load("tick", "walk", {"random": 0}), Demonstrator("tick", "tuned")
    timestep = environment.reset()
    arrays = demonstrator.snapshot()
    first_action = demonstrator.act(timestep.observation)
    demonstrator.act(timestep.observation)
    demonstrator.restore(arrays)
    np.testing.assert_array_equal(demonstrator.act(timestep.observation), first_action)
