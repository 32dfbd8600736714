"""A policy as its files play it in plain MuJoCo, on the robot's source file: no suite between sensors and motors."""

import importlib.util
import math
import re
import runpy
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import imports
import mujoco
import numpy as np
import programs
import pytest
from gymnasium.vector import AutoresetMode
from networks import made

from arc_suite import policies
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import evaluate
from arc_suite.learning import runner_files
from arc_suite.policies import alone
from arc_suite.policies.network import Network
from arc_suite.policies.tracing import traced
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec_files import body_to_json
from arc_suite.tasks.modified_task import sensed_mask

pytest.importorskip("onnx", reason="of the extra learn: make check-agents")
pytest.importorskip("onnxruntime", reason="runs policies in a test: make check-agents")

PROGRAM = Path(__file__).parents[2] / "examples" / "robot_in_mujoco.py"
EXAMPLE = runpy.run_path(str(PROGRAM))
SENSED = {"sensors_only": True, "exclude_blocks": "contact_forces"}
SUBSTEP = 0.002  # s, of the files
EPISODES = 20


def write_go2(folder):
    """An MJCF whose motors have another order than its joints, with a floor; return the model's spec."""
    path = folder / "go2.xml"
    head, rest = (imports.FILES / "go2_like.xml").read_text(encoding="utf-8").split("<actuator>")
    section, tail = rest.split("</actuator>")
    lines = section.strip().splitlines()
    lines = [line for leg in ("FR", "FL", "RR", "RL") for line in lines if f'"{leg}_' in line]
    path.write_text("".join([head, "<actuator>", *lines, "</actuator>", tail]), encoding="utf-8")
    return path, mujoco.MjSpec.from_file(str(path))


def write_a1(folder):
    """A URDF; MuJoCo reads it without looks that are missing, with a base that is free, and on a floor."""
    path = folder / "a1.urdf"
    path.write_bytes((imports.FILES / "a1_like.urdf").read_bytes())
    root = ElementTree.parse(path).getroot()
    for link in root.iter("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    root.find("joint[@name='floating_base']").set("type", "floating")
    spec = mujoco.MjSpec.from_string(ElementTree.tostring(root, encoding="unicode"))
    for geom in spec.geoms:
        geom.contype, geom.conaffinity = 1, 0  # parts of the robot do not touch one another
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0.0, 0.0, 1.0), conaffinity=1)
    return path, spec


def write_tick(folder):
    """A spec file, and the MJCF that `build_model` makes of it."""
    path = folder / "beetle.json"
    path.write_text(body_to_json(ROBOTS["tick"].replace(name="beetle")), encoding="utf-8")
    programs.passed(programs.arc_suite("build_model", "--spec=beetle.json", "--output=beetle.xml", cwd=folder))
    return path, mujoco.MjSpec.from_file(str(folder / "beetle.xml"))


class Robot(EXAMPLE["Robot"]):
    """A robot whose motors are MuJoCo's: those of servos are position actuators, which the integrator sees."""

    def __init__(self, spec, facts):
        super().__init__(spec, facts, SUBSTEP)

    def add_motor(self, spec, motor):
        actuator = super().add_motor(spec, motor)
        actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
        actuator.forcerange = (-motor["limit"], motor["limit"])
        if self.facts["torque_held"] == "substep":
            actuator.biastype = mujoco.mjtBias.mjBIAS_AFFINE
            actuator.gainprm[0] = motor["stiffness"]
            actuator.biasprm[:3] = (0.0, -motor["stiffness"], -motor["damping"])

    def write(self, output):
        self.data.ctrl[:] = output.targets if output.stiffness.any() else output.torques
        mujoco.mj_step(self.model, self.data, self.substeps)


def load(folder):
    """The program of a folder, as a module of its own, and its policy."""
    spec = importlib.util.spec_from_file_location("run", folder / "run.py")
    program = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(program)
    return program, program.Policy.load(folder)


class Judge:
    """An environment whose physics are those of the robot: it sees where the robot is, and rewards it."""

    def __init__(self, network, robot, facts):
        self.environment, self.robot = network.setup.load(), robot
        physics = self.environment.physics
        joints = [physics.model.joint(motor["joint"]) for motor in facts["motors"]]
        self.angles, self.speeds = ([getattr(joint, name)[0] for joint in joints] for name in ("qposadr", "dofadr"))
        self.plain_step, self.output = physics.step, None
        physics.step = self.step

    def reset(self, seed):
        """Begin an episode, and put the robot where it begins."""
        timestep = self.environment.reset(seed)
        mujoco.mj_resetData(self.robot.model, self.robot.data)
        for ours, theirs in self._pairs():
            theirs[:] = ours
        return timestep

    def step(self, *_):
        data = self.environment.physics.data.ptr
        self.robot.write(self.output)
        for ours, theirs in self._pairs():
            ours[:] = theirs
        mujoco.mj_forward(self.environment.physics.model.ptr, data)
        mujoco.mj_rnePostConstraint(self.environment.physics.model.ptr, data)

    def _pairs(self):
        """Views of the state in both simulations. A view of joints in another order writes through."""
        ours, theirs = self.environment.physics.data, self.robot.data
        yield ours.qpos[:7], theirs.qpos[:7]
        yield ours.qvel[:6], theirs.qvel[:6]
        yield _Entries(ours.qpos, self.angles), _Entries(theirs.qpos, self.robot.angles)
        yield _Entries(ours.qvel, self.speeds), _Entries(theirs.qvel, self.robot.speeds)


class _Entries:
    """Entries of an array at indices, which an assignment copies."""

    def __init__(self, array, indices):
        self.array, self.indices = array, indices

    def __setitem__(self, key, value):
        self.array[self.indices] = value.array[value.indices]


def play(network, spec, folder, seeds, steps=None):
    """Play episodes by the files in a folder; return the returns, and by how much actions differ from the suite's."""
    runner_files.save(folder, network)
    program, player = load(folder)
    robot = Robot(spec, player.facts)
    judge, act = Judge(network, robot, player.facts), alone(network)
    returns, difference = [], 0.0
    for seed in seeds:
        timestep, total, count = judge.reset(seed), 0.0, 0
        player.reset(heading=0.0)
        while not timestep.last() and count != steps:
            judge.output = player.act(robot.read(program))
            difference = max(difference, np.abs(player._action - act(timestep)).max())
            timestep = judge.environment.step(player._action)
            total, count = total + timestep.reward, count + 1
        returns.append(total)
    return np.array(returns), difference


def imitate(setup, hidden=384, num_envs=16, rounds=6, steps=120):
    """A policy that walks by sensors alone: random features and ridge regression on a demonstrator, as DAgger does."""
    definition, random = setup.definition, np.random.default_rng(0)
    mask, size = sensed_mask(definition), definition.size
    envs = setup.with_settings({"sensors_only": False}).make_vec(
        num_envs, seed=1000, autoreset_mode=AutoresetMode.SAME_STEP
    )
    teacher = policies.policy("cpg", setup.body, num_envs=num_envs, task=envs.task.definition)
    (observation, _), graph = envs.reset(), None
    teacher.reset(range(num_envs), [0] * num_envs)
    observations, labels = [], []
    for _ in range(rounds):
        for _ in range(steps):
            observations.append(np.where(mask, observation, 0.0).astype(np.float32))
            labels.append(teacher.act(envs.task.split(observation), np.zeros(num_envs)).clip(-1.0, 1.0))
            action = labels[-1].copy()
            if graph is not None:
                action[num_envs // 2 :] = graph(observations[-1][num_envs // 2 :])
            action += 0.1 * random.standard_normal(action.shape)
            observation, _, terminated, truncated, _ = envs.step(action.clip(-1.0, 1.0))
            starts = np.flatnonzero(terminated | truncated)
            teacher.reset(starts, [0] * len(starts))
        x, y = np.concatenate(observations), np.concatenate(labels)
        mean, scale = x.mean(axis=0), mask / (x.std(axis=0) + 1e-3)
        weight = (0.6 * random.standard_normal((size, hidden)) / math.sqrt(mask.sum())).astype(np.float32)
        bias = random.uniform(-1.0, 1.0, hidden).astype(np.float32)
        features = np.tanh(((x - mean) * scale).clip(-5.0, 5.0) @ weight + bias)
        features = np.concatenate([features, np.ones((len(x), 1))], axis=1)
        normal = features.T @ features + 1e-5 * len(x) * np.eye(hidden + 1)
        solution = np.linalg.solve(normal, features.T @ y).astype(np.float32)

        def network(x, mean=mean, scale=scale, weight=weight, bias=bias, solution=solution):
            x = ((x - mean) * scale).clip(-5.0, 5.0).node("Linear", weight, bias).node("Tanh")
            return x.node("Linear", solution[:-1], solution[-1]).clip(-1.0, 1.0)

        graph = traced(network, size)
    return Network(graph, setup, dict(definition.sizes))


@pytest.mark.parametrize(
    ("write", "settings"),
    [(write_go2, {}), (write_a1, {"history": 2}), (write_tick, {}), (write_tick, {"actions": "position"})],
)
def test_actions_are_the_suites(write, settings, tmp_path):
    path, spec = write(tmp_path)
    network = made(str(path), "walk", **SENSED, **settings)
    _, difference = play(network, spec, tmp_path / "robot", [0, 1], steps=20)
    assert difference < 1e-5


@pytest.mark.long
@pytest.mark.parametrize("write", [write_go2, write_a1, write_tick])
def test_returns_are_the_suites(write, tmp_path):
    """On floors, and of motors, that the suite did not make."""
    path, spec = write(tmp_path)
    network = imitate(Setup.of(str(path), "walk", SENSED))
    returns, difference = play(network, spec, tmp_path / "robot", range(EPISODES))
    settings = network.setup.task_kwargs
    report = evaluate(network, network.setup.body, task="walk", task_kwargs=settings, episodes=EPISODES)
    assert report.returns.mean > 1.4 * report.zero
    assert returns.mean() == pytest.approx(report.returns.mean, rel=0.02)
    assert difference < 1e-5


def play_example(path, folder, *numbers):
    """Run examples/robot_in_mujoco.py, and return its last line."""
    command = [sys.executable, str(PROGRAM), str(path), str(folder), *numbers]
    return programs.passed(subprocess.run(command, capture_output=True, text=True)).splitlines()[-1]


@pytest.mark.parametrize("name", ["go2_like.xml", "a1_like.urdf"])
def test_the_example_plays_a_policy_on_the_file_of_a_robot(name, tmp_path):
    """A drawn policy; by a command of 0.2 m/s."""
    path = imports.FILES / name
    runner_files.save(tmp_path / "robot", made(str(path), "steer", **SENSED))
    line = play_example(path, tmp_path / "robot", "0.2", "0", "0")
    assert re.fullmatch(r"way \d\.\d\d m in (\d+\.\d\d) s; that of the command is (\d\.\d\d) m", line)
