"""Policies as ONNX, run by onnxruntime: the same actions, all along an episode."""

import json

import imports
import numpy as np
import programs
import pytest
import tiny_studies
from networks import made, of_many_bodies

import arc_suite
from arc_suite import policies
from arc_suite.bodies import generator, universal
from arc_suite.bodies.universal import Universal
from arc_suite.envs.setup import Setup
from arc_suite.learning import onnx_file
from arc_suite.policies import alone
from arc_suite.policies.graph import INPUT
from arc_suite.policies.network import PACKAGED

pytest.importorskip("onnx", reason="of the extra learn: make check-agents")
runtime = pytest.importorskip("onnxruntime", reason="runs policies in a test: make check-agents")


def exported(policy, folder):
    """Write a policy as policy.onnx, and return what runs it."""
    onnx_file.save(folder / "policy.onnx", policy)
    options = runtime.SessionOptions()
    options.intra_op_num_threads = 1
    return runtime.InferenceSession(folder / "policy.onnx", options, providers=["CPUExecutionProvider"])


@pytest.mark.parametrize(("robot", "task"), [("queen", "walk"), ("tick", "steer")])
def test_equal_over_an_episode(robot, task, tmp_path):
    policy = made(robot, task, hidden=256)
    run, act, greatest, steps = exported(policy, tmp_path), alone(policy), 0.0, 0
    assert (tmp_path / "policy.onnx").stat().st_size <= 600_000
    walk = alone(policies.policy("cpg", robot))  # who knows nothing yet would fall at once
    environment = arc_suite.load(robot, task)
    timestep = environment.reset(0)
    while not timestep.last():
        flat = np.concatenate([timestep.observation[name] for name in policy.blocks]).astype(np.float32)
        (actions,) = run.run(["actions"], {"observations": flat[None]})
        greatest, steps = max(greatest, np.abs(actions[0] - act(timestep)).max()), steps + 1
        timestep = environment.step(walk(timestep))
    assert steps >= 900
    assert greatest < 1e-5


def test_any_number_of_environments(tmp_path):
    policy = made()
    run = exported(policy, tmp_path)
    for num_envs in (1, 5, 64):
        observations = np.random.default_rng(num_envs).normal(size=(num_envs, policy.size)).astype(np.float32)
        (actions,) = run.run(None, {"observations": observations})
        np.testing.assert_allclose(actions, policy.actions(observations), atol=1e-5)


def test_metadata_tell_what_a_robot_of_others_needs(tmp_path):
    body = imports.quadruped()
    texts = exported(made(body), tmp_path).get_modelmeta().custom_metadata_map
    servos, model = json.loads(texts["servos"]), arc_suite.load(body, "walk").physics.model.ptr
    assert list(servos) == list(body.joint_names)
    assert json.loads(texts["file_joints"]) == list(body.file_joints)
    assert "gears" not in texts
    for leg in body.legs:
        for joint in leg.joints:
            told = servos[leg.full_name(joint)]
            assert told["alias"] == joint.alias
            assert (told["stiffness"], told["damping"], told["limit"]) == (
                joint.servo.stiffness,
                joint.servo.damping,
                joint.servo.limit,
            )
            assert told["home"] == model.key("home").qpos[model.joint(leg.full_name(joint)).qposadr[0]]
            assert told["reach"] == max(map(abs, np.radians(joint.range_deg)))


def test_metadata_tell_what_a_game_needs(tmp_path):
    texts = exported(made("leaper"), tmp_path).get_modelmeta().custom_metadata_map
    assert (texts["robot"], texts["task"]) == ("leaper", "walk")
    environment = arc_suite.load("leaper", "walk")
    timestep = environment.reset(0)
    blocks = json.loads(texts["blocks"])
    assert list(blocks.items()) == [(name, block.size) for name, block in timestep.observation.items()]
    step = float(texts["control_timestep"])
    assert step == environment.control_timestep()
    assert int(texts["substeps"]) == 25
    body = environment.task.body
    assert json.loads(texts["joints"]) == list(body.joint_names)
    assert json.loads(texts["gears"]) == environment.physics.model.actuator_gear[:, 0].tolist()
    # The clock's rule is that of the observation.
    frequency = json.loads(texts["gait_clock"])["frequency"]
    for count in range(1, 60):
        timestep = environment.step(np.zeros(12))
        phase = 2.0 * np.pi * frequency * count * step
        assert np.allclose(timestep.observation["gait_clock"], [np.sin(phase), np.cos(phase)], atol=1e-9)


@pytest.mark.parametrize(
    ("body", "task", "settings"),
    [
        ("leaper", "walk", {}),
        ("tick", "steer", {"actions": "position"}),
        (generator.random_body(3), "walk", {"actions": "position"}),
        (generator.generate(5, 2), "steer", {}),
    ],
)
def test_a_policy_of_many_bodies_for_one_body(tmp_path, body, task, settings):
    """In an episode that the policy itself plays."""
    setup = Setup.of(body, task, settings | {"time_limit": 1.0})
    network = of_many_bodies()
    run, environment, greatest = exported(universal.for_body(network, setup), tmp_path), setup.load(), 0.0
    policy = Universal(network, environment.task.definition)
    timestep = environment.reset(0)
    while not timestep.last():
        blocks = {name: block[None] for name, block in timestep.observation.items()}
        vector = np.concatenate(list(blocks.values()), axis=-1, dtype=np.float32)
        expected = policy.act(blocks)
        (actions,) = run.run(None, {INPUT: vector})
        greatest = max(greatest, abs(actions - expected).max())
        timestep = environment.step(expected[0])
    assert greatest < 1e-4
    texts = run.get_modelmeta().custom_metadata_map
    assert json.loads(texts["joints"]) == list(setup.body.joint_names)


def test_a_policy_of_many_bodies_needs_one_of_them(tmp_path):
    with pytest.raises(ValueError, match=r"^policy of .*: expected one of one body; see universal.for_body$"):
        onnx_file.save(tmp_path / "policy.onnx", of_many_bodies())
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("task", ["walk", "steer"])
def test_flags_give_a_policy_of_many_bodies_its_body_and_task(task, tmp_path):
    size = Setup.of(generator.generate(4, 3), task).definition.size
    done = programs.arc_suite("export", "universal", "--legs=4", f"--task={task}", "--output=a.onnx", cwd=tmp_path)
    assert programs.passed(done).startswith(f"wrote a.onnx: {size} observations, 12 actions, ")


def test_flags_may_name_the_robot_and_task_of_a_policy(tmp_path):
    """Files import nothing, and so flags name parts of other packages; an export keeps the policy's own."""
    policy = PACKAGED / "tick-walk.npz"
    done = programs.arc_suite("export", policy, "--robot=tick", "--task=walk", "--output=b.onnx", cwd=tmp_path)
    assert programs.passed(done).startswith("wrote b.onnx: ")
    done = programs.arc_suite("export", policy, "--robot=queen", "--output=c.onnx", cwd=tmp_path)
    programs.refused(done, f"arc-suite export: policy {policy}: trained on tick, walk, ")


def test_files_of_a_run_have_the_delay_of_its_training(tmp_path):
    """Those of `train` and of `export`, whichever of its policies is named."""
    arguments = ["--robot=tick", "--algorithm=tiny_studies:climb", "--set", "time_limit=0.25", "--steps=20"]
    command = ["train", *arguments, "--train_set", "delay=[1,2]", "--best", "--output=run"]
    programs.passed(programs.arc_suite(*command, cwd=tmp_path, path=tiny_studies.__file__.rpartition("/")[0]))
    files = ["run/policy.onnx"]
    for policy in ("run", "run/policy.npz", "run/best", "run/checkpoints/20"):
        file = f"{len(files)}.onnx"
        programs.passed(programs.arc_suite("export", policy, f"--output={file}", cwd=tmp_path))
        files.append(file)
    for file in files:
        session = runtime.InferenceSession(tmp_path / file, providers=["CPUExecutionProvider"])
        assert json.loads(session.get_modelmeta().custom_metadata_map["delay"]) == [1, 2], file
