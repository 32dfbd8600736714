"""Steer: commands that are drawn, held, set from outside and obeyed."""

import contextlib
import types

import gymnasium
import numpy as np
import pytest
from crossings import walked
from episodes import begun, opened
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused

import arc_suite
from arc_suite import rotations
from arc_suite.cpg import Demonstrator
from arc_suite.envs.vector import VectorEnv
from arc_suite.robots import ROBOTS
from arc_suite.tasks import command
from arc_suite.tasks.health import Upright

NUMBERS = "command 'command': expected 3 numbers from -1e+06 to 1e+06"


def commands(environment):
    return environment.task.memory.core.desired


def test_commands_are_within_their_ranges_and_one_in_ten_stops():
    random = np.random.RandomState(0)
    drawn = np.array([command.draw_command(random) for _ in range(4000)])
    stops = ~drawn.any(axis=-1)
    assert 0.07 < stops.mean() < 0.13
    sizes = np.hypot(drawn[:, 0], drawn[:, 1]) + abs(drawn[:, 2])
    assert sizes.max() <= 1.0 + 1e-12 and sizes[~stops].min() >= 0.2
    assert (drawn[~stops, 1] == 0.0).mean() == pytest.approx(0.5, abs=0.05)
    assert (drawn[~stops, 2] == 0.0).mean() == pytest.approx(0.3, abs=0.05)
    assert drawn[:, 0].min() < -0.4 and drawn[:, 0].max() > 0.9


def test_the_schedule_holds_each_command_and_begins_again():
    _, task, memory = opened("tick", "steer")
    memory = memory.command
    held = np.diff(memory.ends, prepend=0)
    assert held.min() >= 60 and held.max() <= 160

    def desired(steps):
        return task.command.desired(task.context, memory, np.int64(steps), np.zeros(3))

    for expected, end, length in zip(memory.schedule, memory.ends, held, strict=True):
        for tick in (end - length, end - 1):
            assert_array_equal(desired(tick), expected)
    assert_array_equal(desired(memory.ends[-1]), memory.schedule[0])


@pytest.mark.parametrize("settings", [{}, {"motor_strength": 0.9}])
def test_vectors_tell_which_steps_began_another_command(settings):
    """Those in which the observed command changes within an episode."""
    with contextlib.closing(
        VectorEnv("tick", "steer", num_envs=4, task_kwargs=settings, max_episode_steps=300, autoreset_mode="SameStep")
    ) as envs:
        before, _ = envs.reset(seed=0)
        assert not envs.resampled().any()
        count = 0
        for _ in range(500):
            after, _, terminated, truncated, _ = envs.step(np.zeros((4, 18)))
            one, other = (envs.task.split(each)["command"][:, :3] for each in (before, after))
            within = ~(terminated | truncated)
            assert not envs.resampled()[~within].any()
            told = within & (one.any(axis=-1) | other.any(axis=-1))  # a stop may follow a stop
            assert_array_equal(envs.resampled()[told], (one != other).any(axis=-1)[told])
            before, count = after, count + envs.resampled().sum()
        assert count > 8


def test_environments_that_rest_began_no_other_command(monkeypatch):
    monkeypatch.setattr(command, "SHORTEST", 3)
    monkeypatch.setattr(command, "LONGEST", 4)
    with contextlib.closing(VectorEnv("tick", "steer", num_envs=3, autoreset_mode="Disabled")) as envs:
        envs.reset(seed=0)
        for _ in range(3):
            envs.step(np.zeros((3, 18)))
        assert envs.resampled().all()
        assert envs.call("resampled") == (True, True, True)
        envs.resampled()[:] = False
        assert envs.resampled().all()
        envs.reset(options={"reset_mask": np.array([True, False, False])})
        assert envs.resampled().tolist() == [False, True, True]
        envs.rest([False, True, False])
        assert envs.resampled().tolist() == [False, False, True]
        snapshot = envs.snapshot()
        for _ in range(3):
            envs.step(np.zeros((3, 18)))
        assert envs.resampled().tolist() == [True, False, True]
        envs.restore(snapshot)
        assert envs.resampled().tolist() == [False, False, True]


def test_a_schedule_begins_again_as_another_command_and_a_live_one_is_none():
    schedule = command.Schedule()
    memory = command.Scheduled(np.array([60, 130]), np.zeros((2, 3)), np.full(3, np.nan), np.float64(0.0))
    begun = [bool(schedule.resampled(memory, np.int64(steps))) for steps in range(300)]
    assert np.flatnonzero(begun).tolist() == [60, 130, 190, 260]
    live = memory._replace(live=np.ones(3))
    assert not any(schedule.resampled(live, np.int64(steps)) for steps in range(300))
    partly = memory._replace(live=np.array([1.0, np.nan, np.nan]))
    assert schedule.resampled(partly, np.int64(60))


def test_motion_is_measured_in_the_frame_of_the_heading():
    environment, task, memory = opened("tick", "steer", base_noise=0.0, joint_noise=0.0)
    heading = 2.0
    place = np.array([5.0, -3.0, heading])
    memory = memory._replace(core=memory.core._replace(place=place, motion=np.zeros(3)))
    readings = task.read(environment.physics.data.ptr)
    forward, left, turn = 0.4, -0.1, 0.2  # units a step
    step = task.scene.control_timestep * task.context.units
    moved = place[:2] + forward * step[0] * np.array([np.cos(heading), np.sin(heading)])
    moved += left * step[1] * np.array([-np.sin(heading), np.cos(heading)])
    readings = readings._replace(frame_position=np.array([*moved, 0.2]), heading=np.float64(heading + turn * step[2]))
    leak = task.parameters.gait_frequency * task.scene.control_timestep
    assert_allclose(task.after(memory, readings).core.motion, leak * np.array([forward, left, turn]), atol=1e-12)


@pytest.mark.parametrize(
    ("wanted", "motion", "tracking"),
    [
        ((1.0, 0.0, 0.0), (1.0, 0.0, 0.0), 1.0),
        ((1.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0),
        ((1.0, 0.0, 0.0), (0.625, 0.0, 0.0), 0.5),
        ((0.0, 0.0, 1.0), (0.0, 0.0, 0.0), 0.0),
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 1.0),
        ((0.6, 0.0, 0.4), (0.6, 0.0, 0.4 - 0.1875), 0.5),
    ],
)
def test_tracking_is_the_product_of_course_and_turning(wanted, motion, tracking):
    assert_allclose(command.tracking(np.array(wanted), np.array(motion)), tracking, atol=1e-12)


@pytest.mark.parametrize(
    ("wanted", "motion", "along"),
    [
        ((1.0, 0.0, 0.0), (0.1, 0.0, 0.0), 0.1),  # where tracking is still 0
        ((1.0, 0.0, 0.0), (-0.1, 0.5, 0.5), -0.1),
        ((0.2, 0.0, 0.0), (0.2, 0.0, 0.0), 1.0),
        ((0.6, 0.0, 0.4), (0.3, 0.0, 0.2), 0.5),
        ((0.6, 0.0, 0.4), (-0.4, 0.3, 0.6), 0.0),
        ((0.0, 0.0, 0.0), (0.3, 0.2, 0.1), 0.0),
    ],
)
def test_progress_is_the_projection_of_the_motion_onto_the_command(wanted, motion, along):
    assert_allclose(command.projected_share(np.array(wanted), np.array(motion)), along, atol=1e-12)


def test_progress_is_paid_from_the_first_step_and_at_most_in_full():
    environment = begun("tick", "steer")
    environment.command("command", (0.6, 0.0, 0.4))
    task, memory = environment.task.definition, environment.task.memory
    readings = task.read(environment.physics.data.ptr)

    def paid(share):
        """What a step without displacement earns whose mean motion is a share of the command."""
        motion = share * memory.core.desired / (1.0 - task.context.leak)
        after = task.after(memory._replace(core=memory.core._replace(motion=motion)), readings)
        return task.terms(after, readings)["progress"] / after.health.upright

    assert_allclose([paid(share) for share in (-0.5, 0.0, 0.1, 2.0)], [-0.5, 0.0, 0.1, 1.0], atol=1e-12)


def test_a_live_command_takes_the_place_of_the_schedule_until_the_next_episode():
    environment = begun("leaper", "steer", random=1, time_limit=1.0)
    scheduled = commands(environment).copy()
    environment.command("command", (0.5, np.nan, -0.25))
    timestep = environment.step(np.zeros(12))
    assert_array_equal(timestep.observation["command"][:3], [0.5, scheduled[1], -0.25])
    environment.command("command", None)
    assert_array_equal(commands(environment), scheduled)
    environment.command("command", (1.0, 0.0, 0.0))
    environment.reset()
    assert np.isnan(environment.task.memory.command.live).all()


def test_live_commands_of_environments_are_those_of_single_environments():
    envs = gymnasium.make_vec("arc_suite/tick-steer-v0", num_envs=3)
    env = gymnasium.make("arc_suite/tick-steer-v0")
    envs.reset(seed=5), env.reset(seed=6)
    desired = np.array([0.3, 0.1, -0.2])
    envs.command("command", desired, mask=np.array([False, True, False]))
    env.unwrapped.command("command", desired)
    for _ in range(5):
        observations, rewards, *_ = envs.step(np.zeros(envs.action_space.shape))
        observation, reward, *_ = env.step(np.zeros(18, np.float32))
        assert_array_equal(observations[1], observation)
        assert rewards[1] == reward
    blocks = envs.task.split(observations)
    assert_array_equal(blocks["command"][1, :3], desired.astype(np.float32))
    assert not np.array_equal(blocks["command"][0, :3], blocks["command"][1, :3])
    for value, mask in ((0.25, [True, True, False]), (0.5, [False, True, True])):  # which add up
        envs.command("command", (value, 0.0, 0.0), mask=np.array(mask))
    blocks = envs.task.split(envs.step(np.zeros(envs.action_space.shape))[0])
    assert_array_equal(blocks["command"][:, :3], [[0.25, 0, 0], [0.5, 0, 0], [0.5, 0, 0]])


@pytest.mark.parametrize(
    ("task", "name", "value", "message"),
    [
        ("walk", "command", (1, 0, 0), "command 'command': task walk has no commands"),
        ("steer", "comand", (1, 0, 0), "unknown command 'comand'; did you mean 'command'? (there are: command)"),
        ("steer", "command", (1, 0), f"{NUMBERS}, got (1, 0)"),
    ],
)
def test_a_wrong_command_is_one_line_and_changes_nothing(task, name, value, message):
    single = begun("tick", task)
    envs = gymnasium.make_vec(f"arc_suite/tick-{task}-v0", num_envs=2)
    envs.reset(seed=0)
    for environment in (single, envs):
        with refused(message):
            environment.command(name, value)


@pytest.mark.long
def test_an_obedient_body_earns_what_a_standing_or_a_deaf_one_does_not():
    obedient, deaf, standing = (
        sum(rewards.sum() for rewards, *_ in walked(VectorEnv("tick", "steer", 6), preset, 300))
        for preset in ("steered", "tuned", None)
    )
    assert standing < 0.55 * obedient
    assert deaf < 0.45 * obedient


def test_at_a_stop_all_feet_are_to_stand_and_the_clock_rests():
    environment, policy = arc_suite.load("queen", "steer", {"random": 0}), Demonstrator("queen", "steered")
    timestep = environment.reset()
    for steps, desired in ((40, (1.0, 0.0, 0.0)), (80, (0.0, 0.0, 0.0))):
        environment.command("command", desired)
        for _ in range(steps):
            timestep = environment.step(policy(timestep))
    memory = environment.task.memory
    assert (memory.core.tick, memory.core.steps) == (40, 120)
    assert_array_equal(timestep.observation["gait_clock"], [0.0, 0.0])
    assert environment.task.terms["gait_cost"] == 0.0, "it stands, as it is to"
    assert environment.task.terms["tracking"] > 0.95
    assert environment.task.terms["obedient_gait"] == environment.task.terms["tracking"]


@pytest.mark.parametrize("robot", ["queen", "leaper"])
def test_nothing_tells_where_the_body_heads(robot):
    """The same state, turned about the vertical: the same observation."""
    environment = begun(robot, "steer", random=3)
    for _ in range(10):
        environment.step(np.full(len(ROBOTS[robot].joint_names), 0.1))
    task, memory, turn = environment.task.definition, environment.task.memory, 1.234
    data = types.SimpleNamespace(**{name: getattr(environment.physics.data.ptr, name).copy() for name in task.reads})
    before = task.observe(memory, task.read(data))
    data.qpos[3:7] = rotations.turn_about_z(data.qpos[3:7], turn)
    forces = data.cfrc_ext
    for array in (data.qpos[None, :2], data.qvel[None, :2], data.xpos[:, :2], forces[:, :2], forces[:, 3:5]):
        array[:] = rotations.to_heading_frame(array.copy(), -turn)
    assert np.abs(before["contact_forces"]).max() > 0.01
    for name, block in task.observe(memory, task.read(data)).items():
        assert_allclose(block, before[name], atol=1e-12, err_msg=name)


def test_who_is_carried_by_the_torso_has_fallen():
    environment, task, _ = opened("tick", "steer")
    readings = task.read(environment.physics.data.ptr)
    for share, healthy in ((0.4, True), (0.6, False)):
        forces = np.zeros_like(readings.contact_forces)
        forces[5] = share  # upwards, on the first part, in the body's weight
        carried = readings._replace(contact_forces=forces)
        assert task.health.after(task.context, task.health.start(), carried, 1).fell != healthy


def test_a_body_that_lies_on_its_torso_is_not_healthy():
    """Tick draws its legs up, and rests on its torso at 0.39 of its height."""
    environment = arc_suite.load("tick", "steer", {"random": 0})
    timestep, data, joints = environment.reset(), environment.physics.data.ptr, environment.physics.model.jnt_range[1:]
    while not timestep.last():
        error = joints[:, 1] - data.qpos[7:]
        timestep = environment.step((3.0 * error - 0.2 * data.qvel[6:]).clip(-1.0, 1.0))
    assert timestep.discount == 0.0
    assert timestep.observation["posture"][0] > Upright().lowest * ROBOTS["tick"].torso.standing_height
    assert environment.task.progress["fell"] == 1.0


def test_pictures_show_the_command_as_arrows():
    environment = begun("queen", "steer")
    environment.command("command", (0.5, -0.25, 0.5))
    task, memory = environment.task.definition, environment.task.memory
    readings, heading, reach = task.read(environment.physics.data.ptr), memory.core.place[2], task.context.reach
    hub, going, turning = task.markers(memory, readings)
    assert (hub.shape, going.shape, turning.shape) == ("cylinder", "arrow", "arrow")
    assert_array_equal(hub.start[:2], going.start[:2])
    assert_array_equal(going.end, turning.start)
    ahead = rotations.to_heading_frame(hub.start[:2] - readings.torso_position[:2], heading)
    assert ahead[0] > 0.5 * reach and abs(ahead[1]) < 1e-12  # in front of the torso
    assert hub.start[2] == 0.0
    assert_allclose([going.start[2], going.end[2], turning.end[2]], going.radius)  # they lie on the ground
    assert_allclose(rotations.to_heading_frame((going.end - going.start)[:2], heading), (0.5 * reach, -0.25 * reach))
    assert_allclose(
        rotations.to_heading_frame((turning.end - turning.start)[:2], heading), (0.0, 0.5 * reach), atol=1e-12
    )
    shown = environment.physics.render(60, 80)
    environment.command("command", (0.0, 0.0, 0.0))
    assert [mark.shape for mark in task.markers(environment.task.memory, readings)] == ["cylinder"]
    stopped = environment.physics.render(60, 80)
    assert not np.array_equal(shown, stopped)
