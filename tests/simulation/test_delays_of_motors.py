"""Controls of motors that act later, by MuJoCo's own delays of actuators, and tables of torque by speed."""

import copy
import pickle

import imports
import mujoco
import numpy as np
import pytest
from limited import with_drives
from numpy.testing import assert_allclose, assert_array_equal

import arc_suite
from arc_suite import models
from arc_suite.envs.vector import VectorEnv
from arc_suite.importing import import_robot
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Motor, SpecError
from arc_suite.robots.spec_files import body_from_json, body_to_json
from arc_suite.simulation.batch import Batch
from arc_suite.simulation.model import compile_model

TIMESTEP = 0.002  # s, of the bodies here
SUBSTEPS = 3
LATE = with_drives(ROBOTS["tick"], delay=SUBSTEPS * TIMESTEP)
JOINTS = len(LATE.joints)


@pytest.mark.parametrize("speed", [None, 8.0])
def test_controls_act_after_the_delay(speed):
    body = with_drives(ROBOTS["tick"], delay=SUBSTEPS * TIMESTEP, no_load_speed=speed)
    model = compile_model(body)
    data = mujoco.MjData(model)
    gear = model.actuator_gear[0, 0]
    torques = []
    for step in range(500):  # rounding of times must not move a control to another substep
        data.ctrl[:] = 1e-3 * (step % 7)
        mujoco.mj_step(model, data)
        torques.append(data.qfrc_actuator[6])
    expected = 1e-3 * gear * (np.arange(500 - SUBSTEPS) % 7)
    assert not any(torques[:SUBSTEPS])
    assert_allclose(torques[SUBSTEPS:], expected, atol=1e-12)
    assert_array_equal(model.actuator_delay[JOINTS:], 0.0)  # drags measure the joint as it is


def test_servos_follow_targets_later_and_measure_at_once():
    body = with_drives(imports.quadruped(), delay=0.01)
    environment = arc_suite.load(body, "steer", {"random": 0})
    environment.reset()
    model, data = environment.physics.model.ptr, environment.physics.data.ptr
    count = len(body.joints)
    substeps = round(0.01 / model.opt.timestep)
    assert (model.actuator_history[: 2 * count, 0] == substeps + 1).all()
    qpos, qvel = data.qpos.copy(), data.qvel.copy()
    data.ctrl[:count] = 0.01
    torques = []
    for step in range(substeps + 1):
        data.qpos[:], data.qvel[:] = qpos, qvel
        data.qvel[6] += 0.1 * (step == 1)
        mujoco.mj_step(model, data)
        torques.append(data.actuator_force[0])
    servo = body.joints[0].servo
    reach = np.radians(np.abs(body.joints[0].range_deg)).max()
    expected = np.full(substeps + 1, torques[0])
    expected[-1] += 0.01 * servo.stiffness * reach
    expected[1] -= servo.damping * 0.1
    assert_allclose(torques, expected, atol=1e-9)


def test_one_environment_is_a_batch_and_copies_continue():
    single = arc_suite.load(LATE, "walk", {"random": 0})
    batch = VectorEnv(LATE, "walk", 2, 1)
    single.reset()
    batch.reset(seed=0)
    actions = np.random.RandomState(0).uniform(-1.0, 1.0, (12, JOINTS))
    for action in actions[:6]:
        timestep = single.step(action)
        observation, reward, *_ = batch.step(np.stack([action, action]))
    other = copy.deepcopy(single)
    saved = pickle.loads(pickle.dumps(batch))
    for action in actions[6:]:
        timestep = single.step(action)
        observation, reward, *_ = batch.step(np.stack([action, action]))
        vector = np.concatenate([np.ravel(block) for block in timestep.observation.values()])
        assert_array_equal(observation[0], vector.astype(np.float32))
        assert reward[0] == timestep.reward == other.step(action).reward
        assert_array_equal(saved.step(np.stack([action, action]))[0], observation)
    # Costs are those of torques that the motors gave.
    torques = np.array([joint.torque for joint in LATE.joints])
    efforts = single.task.definition.read(single.physics.data.ptr).effort(action)
    assert_allclose(efforts * torques, single.physics.data.qfrc_actuator[6:], rtol=1e-12)


def test_the_model_is_that_of_the_text():
    model = compile_model(LATE)
    other = mujoco.MjModel.from_xml_string(models.assemble(LATE).to_xml_string())
    for name in ("actuator_delay", "actuator_history", "actuator_historyadr", "jnt_actfrcrange"):
        assert_array_equal(getattr(model, name), getattr(other, name))
    assert not compile_model(ROBOTS["tick"]).nhistory


@pytest.mark.parametrize("cursor", [1e9, -1.0, 0.5])
def test_snapshots_with_wrong_cursors_are_refused(cursor):
    batch = Batch(compile_model(LATE), 1, 1)
    arrays = batch.snapshot()
    assert batch.check_snapshot(arrays) is arrays
    model = compile_model(LATE)
    history = 1 + model.nq + model.nv + model.na
    arrays["state"][0, history + model.actuator_historyadr[2] + 1] = cursor
    with pytest.raises(ValueError, match="cursors of delays"):
        batch.check_snapshot(arrays)


def test_delays_come_in_with_a_file(tmp_path):
    text = (imports.FILES / "go2_like.xml").read_text(encoding="utf-8")
    path = tmp_path / "late.xml"
    path.write_text(text.replace("<motor name=", '<motor delay="0.01" nsample="9" name='), encoding="utf-8")
    robot = import_robot(path)
    assert {joint.servo.delay for joint in robot.body.joints} == {0.01}
    assert "delays: controls of 12 motors act after 0.01 s" in "\n".join(robot.notes)


def test_numbers_are_fields_of_spec_files():
    assert body_from_json(body_to_json(LATE)) == LATE
    with pytest.raises(SpecError, match="delay: expected a number from 0 to 1, got 2"):
        Motor(gear=1.0, delay=2.0)
    with pytest.raises(SpecError, match="at most 0.001 s, 1000 substeps, got 0.006"):
        LATE.replace(simulation=LATE.simulation.replace(timestep=1e-6))


@pytest.mark.parametrize(
    ("table", "speed", "stall"),
    [
        ([(0.0, 2.0), (10.0, 2.0), (20.0, 0.0)], 20.0, 4.0),  # flat, then a line
        ([(0.0, 3.0), (30.0, 0.0)], 30.0, 3.0),  # a line
        ([(5.0, 2.0), (10.0, 1.5)], 25.0, 2.5),  # ends before the speed without load
        ([(0.0, 2.0), (10.0, 2.0), (15.0, 1.1), (20.0, 0.0)], 20.0, 4.0),  # nearly a line
    ],
)
def test_a_table_of_torques_is_a_line(table, speed, stall):
    motor = Motor(gear=2.0, torque_by_speed=table)
    assert (motor.no_load_speed, motor.stall) == pytest.approx((speed, stall))
    assert motor == Motor(gear=2.0, no_load_speed=motor.no_load_speed, stall=motor.stall)
    assert motor.replace(gear=1.0).stall == motor.stall


@pytest.mark.parametrize(
    ("table", "reason"),
    [
        ([(0.0, 2.0), (1.0, 2.0), (19.9, 1.0), (20.0, 0.0)], "within 10% of a falling line, got "),
        ([(0.0, 2.0), (5.0, 2.0), (10.0, 1.0), (40.0, 0.2)], "within 10% of a falling line, got "),
        ([(0.0, 1.0), (10.0, 0.0)], "fall from at least the largest torque, 2"),
        ([(0.0, 2.0), (10.0, 2.5)], "fall from at least the largest torque, 2"),
        ([(0.0, 2.0), (0.0, 1.0)], "expected rising speeds up to 1e+06, got 0 after 0"),
        ([(0.0, 2.0)], r"expected 2 to 64 pairs of speed and torque"),
        ([(0.0, float("nan")), (1.0, 0.0)], "expected a number from 0"),
        ([(0.0, 2.0), "ab"], "expected 2 numbers, got 'ab'"),
        ({"0": 2.0}, "expected 2 to 64 pairs of speed and torque, got a dict"),
    ],
)
def test_tables_that_are_no_line_are_refused(table, reason):
    with pytest.raises(SpecError) as caught:
        Motor(gear=2.0, torque_by_speed=table)
    assert str(caught.value).startswith("Motor.torque_by_speed: ")
    assert reason in str(caught.value)


def test_a_table_goes_alone():
    with pytest.raises(SpecError, match="expected none next to a no_load_speed or a stall"):
        Motor(gear=2.0, no_load_speed=9.0, torque_by_speed=[(0.0, 2.0), (9.0, 0.0)])
