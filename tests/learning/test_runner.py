"""The files of a policy for a robot: the observation from sensors, the motors, and what stops the robot."""

import json
import math
import os
import pathlib
import re
import subprocess
import sys
import types

import imports
import mujoco
import numpy as np
import programs
import pytest
from networks import made

import arc_suite
from arc_suite import policies, rotations
from arc_suite.bodies import generator
from arc_suite.importing import import_robot
from arc_suite.learning import onnx_file, runner, runner_files
from arc_suite.policies import alone
from arc_suite.policies.network import save

BODIES = {
    "go2": imports.quadruped,
    "a1": lambda: imports.body("a1_like.urdf"),
    "hexapod": imports.hexapod,
    "arm": imports.with_arm,
    "tick": lambda: "tick",
    "generated": lambda: generator.generate(5, 2),
}
SENSED = {"sensors_only": True, "exclude_blocks": "contact_forces"}


def machine(body, task, **settings):
    """A drawn policy, its runner, and the environment of its training."""
    network = made(body, task, **settings)
    facts = json.loads(json.dumps(runner_files.describe_machine(network)))
    seen = []

    def infer(observation):
        seen.append(observation)
        return network.actions(observation[None])[0]

    player = runner.Policy(facts, infer)
    player.seen = seen
    player.reset(heading=0.0)
    return network, player, network.setup.load()


def sense(environment, player):
    """What the sensors of a robot would show, its joints in the order of its file."""
    physics = environment.physics
    joints = [physics.model.joint(motor["joint"]) for motor in player.facts["motors"]]
    return runner.Sensors(
        angles=np.array([physics.data.qpos[joint.qposadr[0]] for joint in joints]),
        speeds=np.array([physics.data.qvel[joint.dofadr[0]] for joint in joints]),
        quaternion=physics.data.qpos[3:7].copy(),
        rates=physics.data.qvel[3:6].copy(),
    )


def flat(timestep):
    return np.concatenate(list(timestep.observation.values()))


@pytest.mark.parametrize("settings", [{}, {"history": 3}], ids=["alone", "history"])
@pytest.mark.parametrize("task", ["walk", "steer"])
@pytest.mark.parametrize("name", BODIES)
def test_observations_and_actions_from_sensors_are_those_of_the_suite(name, task, settings):
    """With commands that change, stops among them; the signs of quaternions may be any."""
    network, player, environment = machine(BODIES[name](), task, **SENSED, **settings)
    act = alone(network)
    timestep = environment.reset(2)
    command = (0.9, -0.2, 0.5)
    if task == "steer":
        environment.command("command", command)
        timestep.observation["command"][:3] = command
    for step in range(25):
        if timestep.last():  # it fell
            break
        expected = act(timestep)
        sensors = sense(environment, player)
        if step % 2:
            sensors = sensors._replace(quaternion=-sensors.quaternion)
        player.act(sensors, np.array(command) * player.facts["command_units"])
        np.testing.assert_allclose(player.seen[-1], flat(timestep), atol=1e-6)
        np.testing.assert_allclose(player._action, expected, atol=1e-5)
        command = (0.0, 0.0, 0.0) if 1 <= step < 3 else (0.9, -0.2, 0.5)
        if task == "steer":
            environment.command("command", command)
        timestep = environment.step(expected)
    assert step >= 5


@pytest.mark.parametrize(
    ("forward", "rows"),
    [
        ("y", ((0, 1, 0), (-1, 0, 0), (0, 0, 1))),
        ("-x", ((-1, 0, 0), (0, -1, 0), (0, 0, 1))),
        ("-y", ((0, -1, 0), (1, 0, 0), (0, 0, 1))),
    ],
)
def test_an_imu_has_the_axes_of_the_robots_file(forward, rows):
    """Where the front of the file is not x; the rows are axes of the torso in the frame of the file."""
    body = import_robot(imports.FILES / "go2_like.xml", forward=forward).body
    network, player, environment = machine(body, "steer", **SENSED)
    act, timestep = alone(network), environment.reset(0)
    for _ in range(5):
        sensors = sense(environment, player)
        matrix = rotations.matrix(sensors.quaternion) @ rows
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, matrix.ravel())
        sensors = sensors._replace(quaternion=quaternion, rates=sensors.rates @ rows)
        command = timestep.observation["command"][:3] * player.facts["command_units"]
        assert player.find_fault(sensors) == ""
        player.act(sensors, command)
        np.testing.assert_allclose(player.seen[-1], flat(timestep), atol=1e-6)
        timestep = environment.step(act(timestep))
    assert runner_files.describe_machine(made(imports.quadruped(), **SENSED))["imu"] == [1.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize(("name", "error"), [("go2", 0.13), ("a1", 0.13), ("tick", 0.05), ("hexapod", 0.3)])
def test_height_and_velocity_are_estimated_from_the_feet_that_stand(name, error):
    """Of a robot that walks: errors of its speed, as shares; feet of the hexapod slip."""
    network, player, environment = machine(BODIES[name](), "steer", exclude_blocks="contact_forces")
    definition = environment.task.definition
    act = alone(policies.policy("cpg", definition.scene.body, task=definition))
    timestep = environment.reset(0)
    errors = []
    for _ in range(120):
        environment.command("command", (1.0, 0.0, 0.0))
        player.act(sense(environment, player), np.array((1.0, 0.0, 0.0)) * player.facts["command_units"])
        errors.append(player.seen[-1] - flat(timestep))
        timestep = environment.step(act(timestep))
    assert player.facts["estimated"] == ["height", "velocity", "motion"]
    assert timestep.observation["command"][3] > 0.8
    errors, joints = np.array(errors)[60:], len(player.home)
    assert np.abs(errors[:, 0]).max() < 0.07 * definition.scene.body.torso.standing_height
    motion = network.blocks["posture"] + network.blocks["velocities"] + 2 + 3
    assert np.abs(errors[:, motion:].mean(axis=0)).max() < error
    assert np.abs(errors[:, np.r_[1 : 5 + joints, 8 + joints : motion]]).max() < 1e-5


def go2_of_an_sdk(folder):
    """Write a Go2 whose motors have the order of its SDK, right before left, and return the path."""
    head, rest = (imports.FILES / "go2_like.xml").read_text(encoding="utf-8").split("<actuator>")
    section, tail = rest.split("</actuator>")
    lines = section.strip().splitlines()
    lines = [line for leg in ("FR", "FL", "RR", "RL") for line in lines if f'"{leg}_' in line]
    path = folder / "go2.xml"
    path.write_text("".join([head, "<actuator>", *lines, "</actuator>", tail]), encoding="utf-8")
    return path


def test_motors_are_in_the_order_of_the_robots_file(tmp_path):
    body = import_robot(go2_of_an_sdk(tmp_path)).body
    facts = runner_files.describe_machine(made(body, **SENSED))
    assert tuple(motor["motor"] for motor in facts["motors"]) == body.file_joints
    assert [motor["action"] for motor in facts["motors"]] == [3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8]
    motor = facts["motors"][1]
    assert (motor["motor"], motor["joint"]) == ("FR_thigh_joint", "r1_joint2")
    assert (motor["low"], motor["high"], motor["home"]) == pytest.approx((-1.5708, 3.4907, 0.9), abs=1e-4)
    model = arc_suite.load(body, "walk").physics.model.ptr
    home = model.key("home").qpos
    for motor in facts["motors"]:
        assert motor["home"] == home[model.joint(motor["joint"]).qposadr[0]]


def test_the_delay_is_that_of_training(tmp_path):
    """A policy's own setup, in which it is judged, has none."""
    pytest.importorskip("onnx", reason="of the extra learn: make check-agents")
    network = made(imports.quadruped(), "steer", **SENSED)
    training = network.setup.with_settings({"delay": [0, 2]})
    assert runner_files.describe_machine(network)["delay"] == [0, 0]
    assert runner_files.describe_machine(network, training)["delay"] == [0, 2]
    onnx_file.save(tmp_path / "policy.onnx", network, training)
    import onnx

    texts = {entry.key: entry.value for entry in onnx.load(tmp_path / "policy.onnx").metadata_props}
    assert json.loads(texts["delay"]) == [0, 2]


def test_joints_outside_of_the_legs_are_told(tmp_path):
    pytest.importorskip("onnx", reason="of the extra learn: make check-agents")
    notes = runner_files.save(tmp_path, made(imports.with_arm(), **SENSED))
    assert notes[-1] == "held in training, and not moved by run.py: arm at 0"


@pytest.mark.parametrize("settings", [{}, {"actions": "position"}])
def test_motors_of_torque_get_the_torques_of_training(settings):
    network, player, environment = machine("tick", "walk", **SENSED, **settings)
    timestep, act = environment.reset(0), alone(network)
    for _ in range(5):
        output = player.act(sense(environment, player))
        timestep = environment.step(act(timestep))
        np.testing.assert_allclose(output.torques, environment.physics.data.qfrc_actuator[6:], rtol=1e-4, atol=1e-3)
        assert not output.stiffness.any() and not output.damping.any()


@pytest.mark.parametrize(
    ("task", "settings", "line"),
    [
        ("steer", {}, "block contact_forces: sensors do not give it; train with exclude_blocks=contact_forces or "),
        ("rough", SENSED, "block scan: run.py cannot build it from sensors; train with exclude_blocks=scan"),
        ("navigate", SENSED, "block goal: run.py cannot build it from sensors; train with exclude_blocks=goal"),
        ("directed", SENSED, "block gait_clock: run.py cannot build it from sensors; train with exclude_blocks=gait_"),
    ],
)
def test_what_sensors_do_not_give_is_refused(task, settings, line):
    with pytest.raises(ValueError) as caught:
        runner_files.describe_machine(made("tick", task, **settings))
    assert str(caught.value).startswith(line)


class Robot:
    """A robot that follows its targets at once, within its range, and a clock that a sleep moves on.

    Its gyroscope has noise, as those of robots have.
    """

    def __init__(self, facts, angles):
        self.angles, self.time, self.written, self.quaternion = angles, 10.0, [], np.array((1.0, 0.0, 0.0, 0.0))
        self.low, self.high = ([motor[end] for motor in facts["motors"]] for end in ("low", "high"))
        self.late = 0.0
        self.noise = np.random.RandomState(0)

    def read(self):
        zeros = np.zeros(len(self.angles))
        return runner.Sensors(self.angles, zeros, self.quaternion, 1e-6 * self.noise.randn(3))

    def write(self, output):
        self.written.append(output)
        self.angles = output.targets.clip(self.low, self.high)
        self.time += 0.001 + self.late

    def sleep(self, seconds):
        self.time += seconds

    def play(self, player, steps, command=lambda: (0.1, 0.0, 0.0)):
        return runner.run(player, self.read, self.write, command, steps)


@pytest.fixture
def robot(monkeypatch):
    _, player, _ = machine(imports.quadruped(), "steer", **SENSED)
    robot = Robot(player.facts, player.home + 0.1)
    clock = types.SimpleNamespace(perf_counter=lambda: robot.time, sleep=robot.sleep)
    monkeypatch.setattr(runner, "time", clock)
    return player, robot


def test_it_ramps_to_the_standing_pose_then_acts_at_the_rate(robot):
    player, robot = robot
    assert robot.play(player, 10) == ""
    ramp = math.ceil(runner.RAMP_TIME / player.facts["control_timestep"])
    assert len(robot.written) == ramp + 10 + 1
    targets = np.array([output.targets for output in robot.written])
    np.testing.assert_allclose(targets[0] - player.home, 0.1 * (1.0 - 1.0 / ramp))
    np.testing.assert_allclose(targets[ramp - 1], player.home, atol=1e-12)
    assert np.abs(np.diff(targets[:ramp], axis=0)).max() < 0.1001 / ramp
    assert len(player.seen) == 10
    assert robot.time - 10.0 == pytest.approx((ramp + 10) * player.facts["control_timestep"], abs=0.002)
    for output in robot.written[:-1]:
        assert (output.stiffness > 0.0).all() and (output.limits > 0.0).all()
    last = robot.written[-1]
    assert not last.stiffness.any() and (last.damping >= 0.0).all() and not last.torques.any()


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"quaternion": np.array((0.5, 0.866, 0.0, 0.0))}, "the torso tilts by 120 degrees"),
        ({"quaternion": np.array((np.nan, 0.0, 0.0, 0.0))}, "a sensor shows no number"),
        ({"angles": np.full(12, 3.0)}, "motor FL_calf_joint is at 3.00 rad, beyond -2.72 to -0.84"),
        ({"late": 0.05}, "a control step took longer than 0.04 s"),
    ],
)
def test_it_stops_on_limits_and_relaxes(robot, change, line):
    player, robot = robot
    for name, value in change.items():
        setattr(robot, name, value)
    assert robot.play(player, 10) == line
    assert not robot.written[-1].stiffness.any()
    assert len(robot.written) <= 2


@pytest.mark.parametrize("repeats", [False, True])
def test_a_robot_without_new_messages_relaxes(robot, repeats):
    """Whether reading gives None, or the latest message again; before the first message nothing is written."""
    player, robot = robot
    messages = [robot.read() for _ in range(20)]
    late = messages[-1] if repeats else None
    robot.read = lambda: messages.pop(0) if messages else late
    assert robot.play(player, 300) == "no new message of the sensors in 0.1 s"
    assert len(robot.written) == 20 - 1 + runner.MAX_SILENCE + 1
    assert not robot.written[-1].stiffness.any()
    robot.written.clear()
    robot.read = lambda: None
    assert robot.play(player, 300) == "no message of the sensors"
    assert not robot.written


def test_a_message_may_be_missing(robot):
    player, robot = robot
    read = robot.read
    numbers = iter(range(1000))
    robot.read = lambda: None if next(numbers) % 3 == 1 else read()
    assert robot.play(player, 10) == ""
    assert len(player.seen) == 10


def test_commands_are_cut_to_those_of_training():
    _, player, _ = machine(imports.quadruped(), "steer", **SENSED, commands={"forward": [-0.2, 1.5]})
    ranges = np.array(player.facts["command_ranges"])
    units = np.array(player.facts["command_units"])
    np.testing.assert_allclose(ranges / units[:, None], [(-0.2, 1.5), (-0.5, 0.5), (-1.0, 1.0)])
    zeros = np.zeros(12)
    sensors = runner.Sensors(player.home, zeros, np.array((1.0, 0.0, 0.0, 0.0)), np.zeros(3))
    observations = []
    for factor in (1.0, 3.0):
        player.reset()
        observations.append(player.observe(sensors, factor * ranges[:, 1]))
    np.testing.assert_array_equal(*observations)


def test_an_interrupt_relaxes_the_motors(robot):
    player, robot = robot

    def stop():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        robot.play(player, 10, stop)
    assert not robot.written[-1].stiffness.any()


def test_the_page_of_imported_robots_plays_a_policy(tmp_path, monkeypatch):
    """Its code, and its table of motors and actions, for a Go2 with the order of the SDK."""
    pytest.importorskip("onnxruntime", reason="runs policies in a test: make check-agents")
    page = (pathlib.Path(__file__).parents[2] / "docs" / "imported.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([\d, ]+) \| `(\w+)` \| ([\d, ]+) \|$", page, re.MULTILINE)
    (code,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    network = made(import_robot(go2_of_an_sdk(tmp_path)).body, "steer", **SENSED)
    runner_files.save(tmp_path, network)
    facts = json.loads((tmp_path / "policy.json").read_text())
    for numbers, leg, actions in rows:
        for number, action, joint in zip(
            numbers.split(", "), actions.split(", "), ("hip", "thigh", "calf"), strict=True
        ):
            motor = facts["motors"][int(number)]
            assert (motor["motor"], motor["action"]) == (f"{leg}_{joint}_joint", int(action))
    assert len(rows) == 4
    robot = Robot(facts, np.array([motor["home"] for motor in facts["motors"]]))
    calls = []

    def send(*output):
        if len(calls) >= 105:
            robot.quaternion = np.array((0.0, 1.0, 0.0, 0.0))
        calls.append(output)

    monkeypatch.setitem(sys.modules, "my_robot", types.SimpleNamespace(read_state=robot.read, send=send))
    monkeypatch.setitem(
        sys.modules, "time", types.SimpleNamespace(perf_counter=lambda: 0.0, sleep=lambda seconds: None)
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "run", raising=False)
    exec(compile(code, "imported.md", "exec"), {})
    monkeypatch.delitem(sys.modules, "run")
    assert len(calls) == 107 and not calls[-1][1].any()


def test_run_prints_motors_without_onnxruntime_and_absent_parts_have_names(tmp_path):
    facts = runner_files.describe_machine(made(imports.body("a1_like.urdf"), "steer", sensors_only=True))
    names = [name for name, _ in facts["observation"] if name.startswith("absent")]
    assert names == ["absent height", "absent velocity", "absent forces", "absent motion"]
    assert facts["substeps"] == round(facts["control_timestep"] / imports.body("a1_like.urdf").simulation.timestep)
    (tmp_path / "policy.json").write_text(json.dumps(facts))
    (tmp_path / "run.py").write_bytes(runner_files.RUNNER.read_bytes())
    (tmp_path / "onnxruntime.py").write_text("raise ImportError('onnxruntime')")
    done = subprocess.run([sys.executable, "run.py"], cwd=tmp_path, capture_output=True, text=True)
    assert programs.passed(done).startswith("0 motor FR_hip_joint, joint r1_joint1, action 0, home ")


def test_export_writes_a_folder_that_needs_no_suite(tmp_path):
    pytest.importorskip("onnxruntime", reason="runs policies in a test: make check-agents")
    save(tmp_path / "policy.npz", made(imports.body("a1_like.urdf"), "steer", delay=(0, 2), **SENSED))
    lines = programs.passed(programs.arc_suite("export", "policy.npz", "--runner=robot", cwd=tmp_path)).splitlines()
    assert lines[0] == "wrote robot: policy.onnx, policy.json, run.py; 43 observations"
    assert lines[1] == "motor 0 FR_hip_joint: action 0 r1_joint1"
    assert lines[-1] == "delay: trained with 0 to 2 control steps between an action and the motors"
    assert lines[-2].startswith("commands of training, m/s and rad/s: forward -0.")
    assert len(lines) == 15
    (tmp_path / "arc_suite.py").write_text("raise ImportError('the suite')")
    environ = os.environ | {"PYTHONPATH": str(tmp_path)}
    done = subprocess.run([sys.executable, "robot/run.py"], cwd=tmp_path, env=environ, capture_output=True, text=True)
    assert programs.passed(done).startswith("0 motor FR_hip_joint, joint r1_joint1, action 0, home ")
    refused = programs.arc_suite("export", "policy.npz", "--runner=robot", "--output=a.onnx", cwd=tmp_path)
    programs.refused(refused, "arc-suite export: --output a.onnx: goes without --runner, which names a folder\n")
    save(tmp_path / "seeing.npz", made("tick", "steer", exclude_blocks="contact_forces"))
    lines = programs.passed(programs.arc_suite("export", "seeing.npz", "--runner=robot", cwd=tmp_path)).splitlines()
    estimates = "torso's height, torso's velocity, mean velocity"
    assert lines[-2] == f"estimated from the feet that stand: {estimates}; training saw those of the simulation"
