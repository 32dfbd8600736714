"""Poses and gaits by command: how they glide, what they earn, and which are refused."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused

import arc_suite
from arc_suite.bodies import generator
from arc_suite.cpg import Demonstrator
from arc_suite.envs.vector import VectorEnv
from arc_suite.models.posture import measure_room, move_ground_points
from arc_suite.robots import ROBOTS, gaits, mirror
from arc_suite.tasks import mirrors
from arc_suite.tasks.gait_and_pose import CYCLE, glide_gait, to_clock_units

STILL = {"poses": 0.0, "gaits": ()}


def directed(robot, **commands):
    """An environment of which nothing is drawn, with live commands, and a function that walks in it."""
    environment = arc_suite.load(robot, "directed", {"random": 1, **STILL})
    policy, timestep = Demonstrator(environment, "steered"), environment.reset()
    for name, value in commands.items():
        environment.command(name, value)

    def walk(steps):
        nonlocal timestep
        for _ in range(steps):
            timestep = environment.step(policy(timestep))
            assert not timestep.last()
        return timestep

    return environment, walk


@pytest.mark.parametrize("command", [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)])
def test_a_walk_keeps_the_pose(command):
    pose = (-0.2, 0.0, 0.0, 0.05, -0.1, 0.1)
    environment, walk = directed("tick", command=command, pose=pose)
    timestep = walk(120)
    assert_allclose(timestep.observation["pose"], pose)
    off = environment.task.memory.gait_and_pose.pose_error
    assert abs(off[[0, 3, 4]]).max() <= 0.01 and environment.task.memory.gait_and_pose.pose_tracking >= 0.7
    assert timestep.observation["posture"][0] == pytest.approx(0.18 * (0.71 - 0.2), abs=0.003)


def test_nan_leaves_a_number_to_the_task():
    environment, walk = directed("tick", pose=(-0.2, np.nan, np.nan, np.nan, 0.1, np.nan))
    assert_allclose(walk(30).observation["pose"], (-0.2, 0.0, 0.0, 0.0, 0.1, 0.0))
    environment.command("pose", None)
    assert_allclose(walk(30).observation["pose"], np.zeros(6))


def test_a_gait_by_name_takes_hold_within_a_cycle():
    environment, walk = directed("queen", command=(0.7, 0.0, 0.0))
    walk(40)
    before = environment.task.memory.gait_and_pose
    environment.command("gait", "ripple")
    walk(1)
    clock = environment.task.memory.gait_and_pose
    assert clock.phase == (before.phase + clock.gait[-1]) % CYCLE  # it goes on
    cycle = int(np.ceil(CYCLE / clock.gait[-1]))
    walk(cycle)
    made = gaits.gait(ROBOTS["queen"], "ripple")
    step = environment.control_timestep()
    asked = to_clock_units(np.array((*made.offsets, made.duty_factor, 1.5)), step)
    assert_array_equal(environment.task.memory.gait_and_pose.gait, asked)
    errors = [int(walk(1) and environment.task.memory.core.schedule_errors) for _ in range(2 * cycle)]
    assert np.mean(errors) / 6 <= 0.2


def test_every_gait_has_exact_edges():
    """The share of the steps of many cycles that a foot stands is the duty factor, whatever the frequency."""
    gait = to_clock_units(np.array((0.0, 1.0 / 3.0, 0.6, 1.37)), 0.02)
    phases = gait[-1] * np.arange(CYCLE // 4) % CYCLE
    for offset in gait[:-2]:
        assert ((phases + offset) % CYCLE < gait[-2]).mean() == pytest.approx(0.6, abs=1e-4)


def test_offsets_go_the_short_way():
    now = to_clock_units(np.array((0.9, 0.2, 0.6, 1.5)), 0.02)
    asked = to_clock_units(np.array((1.1, 0.8, 0.6, 1.5)), 0.02)
    offsets = [now[:-2]]
    while not np.array_equal(now, asked):
        now = glide_gait(now, asked)
        offsets.append(now[:-2])
    turned = np.diff(np.unwrap(np.array(offsets) * 2 * np.pi / CYCLE, axis=0), axis=0).sum(axis=0) / (2 * np.pi)
    assert_allclose(turned, (0.2, -0.4), atol=1e-5)
    assert len(offsets) - 1 <= np.ceil(CYCLE / now[-1])


def test_commands_of_each_environment():
    envs = VectorEnv("tick", "directed", 3, task_kwargs=STILL)
    envs.reset(seed=0)
    envs.command("pose", (-0.1, 0, 0, 0, 0, 0), mask=[True, False, False])
    envs.command("gait", "wave", mask=[False, True, False])
    still = np.zeros(envs.action_space.shape)
    for _ in range(30):
        blocks = envs.task.split(envs.step(still)[0])
    assert_allclose(blocks["pose"][:, 0], (-0.1, 0.0, 0.0), atol=1e-7)
    assert_allclose(blocks["gait"][:, -2], (0.6, 5.0 / 6.0, 0.6), atol=1e-6)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("gait", "trot", "gait 'trot' does not fit tick with its 6 legs (fit: tripod, tetrapod, ripple, wave)"),
        ("gait", "gallop", "unknown gait 'gallop'"),
        ("gait", (0, 0, 0, 0, 0, 0, 1.5, 1), "command 'gait': expected number 6 between 0.05 and 0.95, got 1.5"),
        ("pose", (0, 0, 0, 0, 3, 0), "command 'pose': expected number 4 between -1 and 1, got 3"),
        ("pose", "low", "command 'pose': expected numbers, got 'low'"),
        ("pose", (0, 0), "command 'pose': expected 6 numbers"),
        ("command", "ahead", "command 'command': expected numbers, got 'ahead'"),
    ],
)
def test_commands_that_do_not_fit(name, value, message):
    environment = arc_suite.load("tick", "directed")
    with refused(message, begins=True):
        environment.command(name, value)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"poses": 2.0}, "poses: expected a number from 0 to 1, got 2.0"),
        ({"gaits": ("trot",)}, "unknown gait of gaits 'trot'"),
        ({"gaits": 3}, "gaits: expected names of gaits, got 3"),
        ({"start": "back"}, "unknown start 'back'"),
    ],
)
def test_settings_that_do_not_fit(settings, message):
    with refused(message, begins=True):
        arc_suite.load("tick", "directed", settings)


def test_the_room_of_a_body():
    planted, sliding = measure_room(ROBOTS["queen"]), measure_room(ROBOTS["queen"], planted=False)
    assert_allclose(planted[:, 0], (-0.12, -0.27, -0.21, -0.06, -0.12, -0.3), atol=1e-9)
    assert_allclose(sliding[0], (-0.48, 0.09), atol=1e-9)
    assert (planted[:, 0] >= sliding[:, 0]).all() and (planted[:, 1] <= sliding[:, 1]).all()
    body = generator.generate(6, 3)
    assert_allclose(measure_room(generator.scaled(body, 3.0)), measure_room(body), atol=1e-9)


def test_drawn_poses_lie_within_the_room():
    task = arc_suite.load("queen", "directed", {"poses": 1.0}).task.definition
    low, high = measure_room(ROBOTS["queen"], planted=False).T
    starts = [task.start(np.random.RandomState(seed), None) for seed in range(30)]
    poses = np.concatenate([start.memory.gait_and_pose.poses for start in starts])
    assert ((low - 1e-9 <= poses) & (poses <= high + 1e-9)).all()
    assert (np.ptp(poses, axis=0) >= 0.8 * (high - low)).all()


def test_a_pose_moves_the_ground_under_the_torso():
    places = np.array([[0.3, 0.2, -0.5]])
    assert_allclose(move_ground_points(places, np.array((0.1, 0.0, 0.0, 0.0, 0.0, 0.0)), 0.5), [[0.3, 0.2, -0.55]])
    # With its nose down, what lies ahead is higher in its frame.
    assert move_ground_points(places, np.array((0.0, 0.0, 0.0, 0.0, 0.1, 0.0)), 0.5)[0, 2] > -0.5


def test_the_mirror_image_of_a_directed_walk():
    one, other = (arc_suite.load("queen", "directed", {"random": 0}) for _ in range(2))
    task, image = one.task.definition, mirror.image(ROBOTS["queen"])
    observation, action = task.symmetry
    start = other.task.definition.start
    poses = mirrors.join([mirrors.POLAR, mirrors.QUATERNION, action])
    velocities = mirrors.join([mirrors.POLAR, mirrors.AXIAL, action])

    def gait(numbers):
        offsets = (numbers[..., :-2][..., image.legs] + CYCLE // 2) % CYCLE
        return np.concatenate([offsets, numbers[..., -2:]], axis=-1)

    def mirrored(random, stream):
        begun = start(random, stream)
        command, asked = begun.memory.command, begun.memory.gait_and_pose
        command = command._replace(schedule=command.schedule * (1, -1, -1))
        asked = asked._replace(
            poses=task.blocks["pose"].mirror(image)(asked.poses),
            gaits=gait(asked.gaits),
            gait=gait(asked.gait),
            phase=np.int64(CYCLE // 2),
        )
        memory = begun.memory._replace(command=command, gait_and_pose=asked)
        return begun._replace(qpos=poses(begun.qpos), qvel=velocities(begun.qvel), memory=memory)

    vars(other.task.definition)["start"] = mirrored
    random, timestep, seen = np.random.RandomState(1), one.reset(), other.reset()
    for _ in range(100):
        there = observation(task.vector(timestep.observation))
        assert_allclose(task.vector(seen.observation), there, atol=1e-9)
        acts = random.uniform(-0.1, 0.1, action.signs.shape)
        timestep, seen = one.step(acts), other.step(action(acts))
        assert seen.reward == pytest.approx(timestep.reward, abs=1e-8)


@pytest.mark.parametrize("task", ["steer", "directed"])
def test_a_body_rises_from_its_belly(task):
    environment = arc_suite.load("queen", task, {"random": 2, "start": "belly"} | ({} if task == "steer" else STILL))
    timestep = environment.reset()
    environment.command("command", (0.0, 0.0, 0.0))
    policy = Demonstrator(environment, "steered")
    assert timestep.observation["posture"][0] < 0.6 * 0.75
    for _ in range(80):
        timestep = environment.step(policy(timestep))
        assert not timestep.last()
    assert timestep.observation["posture"][0] == pytest.approx(0.97 * 0.75, rel=0.05)


def test_a_body_that_does_not_rise_has_fallen_when_its_time_is_up():
    environment = arc_suite.load("tick", "steer", {"random": 2, "start": "belly"})
    task, steps = environment.task.definition, 1
    environment.reset()
    while not environment.step(np.zeros(18)).last():
        steps += 1
        assert environment.task.progress["fell"] == 0.0
    assert task.context.tempo * task.health.patience <= steps <= 100
