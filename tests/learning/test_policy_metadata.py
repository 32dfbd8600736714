"""The metadata of a policy's file say what the machine that it is for has to do."""

import imports
import numpy as np
import pytest
from limited import with_drives
from networks import made

from arc_suite.bodies import generator
from arc_suite.learning.policy_metadata import metadata
from arc_suite.robots import ROBOTS


def torques(facts, action, angles, speeds):
    """What the metadata say of the torques of an action, N m."""
    if facts["actions"] == "torque":
        return action * facts["gears"]
    home, reach, stiffness, damping, limit = (
        np.array([servo[name] for servo in facts["servos"].values()])
        for name in ("home", "reach", "stiffness", "damping", "limit")
    )
    wanted = stiffness * (home + reach * action - angles) - damping * speeds
    for index, servo in enumerate(facts["servos"].values()):
        if "no_load_speed" in servo:
            fall = servo["stall"] * speeds[index] / servo["no_load_speed"]
            wanted[index] = wanted[index].clip(-servo["stall"] - fall, servo["stall"] - fall)
    return wanted.clip(-limit, limit)


@pytest.mark.parametrize(
    ("body", "settings"),
    [
        ("tick", {}),
        ("tick", {"actions": "torque"}),
        ("leaper", {"actions": "position"}),
        (generator.generate(5, 2), {"actions": "position"}),
        (imports.quadruped(), {}),
        (imports.hexapod(), {"actions": "position"}),
    ],
    ids=["tick", "torque", "leaper", "generated", "mjcf", "urdf"],
)
def test_torques_of_an_action_follow_from_the_metadata(body, settings):
    policy = made(body, "steer", **settings)
    facts = metadata(policy)
    environment = policy.setup.load()
    environment.reset(0)
    joints = [f"{name}" for name in facts["joints"]]
    assert ("gears" in facts) != ("servos" in facts)
    assert facts["torque_held"] == ("substep" if facts.get("file_joints") else "control step")
    action = np.random.default_rng(0).uniform(-1.0, 1.0, len(joints))
    for _ in range(3):
        physics = environment.physics.copy()
        layout = environment.task.definition.scene.layout
        before = physics.data.qpos[layout.joint_angles].copy(), physics.data.qvel[layout.joint_velocities].copy()
        environment.step(action)
        if facts["torque_held"] == "substep":
            physics.data.ctrl[: len(joints)] = action
            physics.forward()
            made_torques = physics.data.qfrc_actuator[layout.joint_velocities]
        else:
            made_torques = environment.physics.data.qfrc_actuator[layout.joint_velocities]
        np.testing.assert_allclose(made_torques, torques(facts, action, *before), rtol=1e-6, atol=1e-9)


def test_torques_have_no_servos_and_positions_no_gears():
    assert "servos" not in metadata(made("tick"))
    facts = metadata(made("tick", actions="position"))
    assert "gears" not in facts and facts["actions"] == "position"
    assert set(facts["servos"]["l1_hip"]) == {"alias", "home", "reach", "stiffness", "damping", "limit"}
    assert facts["servos"]["l1_hip"]["limit"] == 120.0
    assert facts["servos"]["l1_hip"]["reach"] == pytest.approx(np.radians(40.0))


def test_history_has_the_layout_that_the_metadata_tell():
    policy = made("tick", history=3, exclude_blocks="velocities")
    facts = metadata(policy)
    environment = policy.setup.load()
    timestep = environment.reset(0)
    actions = [np.zeros(18)]
    seen = [timestep.observation]
    for step in range(1, 6):
        actions.append(np.full(18, 0.1 * step))
        timestep = environment.step(actions[-1])
        seen.append(timestep.observation)
        rows = []
        for age in range(1, facts["history"]["steps"] + 1):
            before = max(step - age, 0)
            action = actions[step - age + 1] if step >= age else actions[0]
            rows += [*(seen[before][name] for name in facts["history"]["blocks"]), action]
        np.testing.assert_array_equal(timestep.observation["history"], np.concatenate(rows))
    assert "history" not in metadata(made("tick"))


def test_delay_is_that_of_training():
    assert metadata(made("tick", delay=(1, 3)))["delay"] == [1, 3]
    assert metadata(made("tick", delay=2))["delay"] == [2, 2]
    assert "delay" not in metadata(made("tick"))


@pytest.mark.parametrize("body", [ROBOTS["tick"], imports.quadruped()], ids=["tick", "mjcf"])
def test_motors_that_are_late_say_so(body):
    assert "motor_delays" not in metadata(made(body))
    late_body = with_drives(body, delay=0.01)
    assert metadata(made(late_body))["motor_delays"] == dict.fromkeys(body.joint_names, 0.01)


def test_the_clock_of_a_command_stands_still_at_a_stop():
    policy = made("tick", "steer")
    facts = metadata(policy)
    environment = policy.setup.load()
    environment.reset(0)
    ticks = 0
    for step in range(30):
        going = step < 10 or step >= 20
        environment.command("command", (1.0, 0.0, 0.0) if going else (0.0, 0.0, 0.0))
        timestep = environment.step(np.zeros(18))
        ticks += going
        phase = 2.0 * np.pi * facts["gait_clock"]["frequency"] * ticks * facts["control_timestep"]
        clock = (np.sin(phase), np.cos(phase)) if going else (0.0, 0.0)
        np.testing.assert_allclose(timestep.observation["gait_clock"], clock, atol=1e-9)
    assert facts["gait_clock"]["rule"].endswith("in which the command is no stop; zeros while it is a stop")
    assert metadata(made("tick"))["gait_clock"]["rule"].endswith("control steps since the start")
