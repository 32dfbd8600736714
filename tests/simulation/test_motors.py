"""Motors as they are: torques that fall with speed, in every substep, dry friction, and heat of windings."""

import imports
import mujoco
import numpy as np
import pytest
from limited import with_drives
from numpy.testing import assert_allclose, assert_array_equal

import arc_suite
from arc_suite import models
from arc_suite.cpg import Demonstrator
from arc_suite.envs.vector import VectorEnv
from arc_suite.models.sizing import size_body
from arc_suite.models.standing import GRAVITY, measure_standing
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Joint, Motor, SpecError
from arc_suite.robots.spec_files import body_from_json, body_to_json
from arc_suite.simulation.model import compile_model
from arc_suite.tasks import energy

SPEED = 8.0  # rad/s, without load
STALL = 1.5  # largest torques
SLOW = with_drives(ROBOTS["tick"], no_load_speed=SPEED, stall=STALL)
TORQUES = np.array([joint.torque for joint in SLOW.joints])
JOINTS = len(TORQUES)


def within_limits(wanted, speeds, torques, no_load_speed=SPEED, stall=STALL):
    """The torques of motors, given those that are wanted: a trapezoid of torque over speed."""
    fall = stall * torques * speeds / no_load_speed
    return wanted.clip(-stall * torques - fall, stall * torques - fall).clip(-torques, torques)


def test_torques_of_motors_fall_with_speed():
    model = compile_model(SLOW)
    data = mujoco.MjData(model)
    random = np.random.RandomState(0)
    limited = 0
    for _ in range(50):
        speeds, controls = random.uniform(-12.0, 12.0, JOINTS), random.uniform(-1.0, 1.0, JOINTS)
        data.qvel[6:] = speeds
        data.ctrl[:JOINTS] = controls
        data.ctrl[JOINTS:] = random.uniform(-9.0, 9.0, model.nu - JOINTS)  # of drags: without effect
        mujoco.mj_forward(model, data)
        expected = within_limits(controls * TORQUES, speeds, TORQUES)
        assert_allclose(data.qfrc_actuator[6:], expected, atol=1e-12 * TORQUES.max())
        limited += (expected != controls * TORQUES).sum()
    assert 100 < limited < 800


def test_the_model_is_that_of_the_text():
    model = compile_model(SLOW)
    other = mujoco.MjModel.from_xml_string(models.assemble(SLOW).to_xml_string())
    for name in ("actuator_gear", "actuator_gainprm", "actuator_biasprm", "actuator_forcerange", "jnt_actfrcrange"):
        assert_array_equal(getattr(model, name), getattr(other, name))
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST


@pytest.mark.slow
def test_torques_of_servos_fall_with_speed():
    body = with_drives(imports.quadruped(), no_load_speed=SPEED, stall=STALL)
    environment = arc_suite.load(body, "steer", {"random": 0})
    environment.reset()
    physics = environment.physics
    layout = environment.task.definition.scene.layout
    torques = np.array([joint.torque for joint in body.joints])
    reach = abs(np.radians([joint.range_deg for joint in body.joints])).max(axis=-1)
    servos = [joint.servo for joint in body.joints]
    stiffness, damping = np.transpose([(servo.stiffness, servo.damping) for servo in servos])
    random = np.random.RandomState(0)
    count = len(torques)
    for _ in range(20):
        speeds, controls = random.uniform(-12.0, 12.0, count), random.uniform(-1.0, 1.0, count)
        with physics.reset_context():
            physics.data.qvel[layout.joint_velocities] = speeds
        physics.data.ctrl[:count] = controls
        mujoco.mj_forward(physics.model.ptr, physics.data.ptr)
        angles = physics.data.qpos[layout.joint_angles] - layout.home
        wanted = stiffness * (reach * controls - angles) - damping * speeds
        expected = within_limits(wanted, speeds, torques)
        assert_allclose(physics.data.qfrc_actuator[layout.joint_velocities], expected, atol=1e-9 * torques.max())
        # Servos that fail give no torque: the drag is of the limit, not of the joint.
        physics.data.ctrl[:count] = 0.0
        physics.data.ctrl[count : 3 * count] = 1.0
        mujoco.mj_forward(physics.model.ptr, physics.data.ptr)
        assert_allclose(physics.data.qfrc_actuator[layout.joint_velocities], 0.0, atol=1e-9 * torques.max())


def test_one_environment_is_a_batch():
    single = arc_suite.load(SLOW, "walk", {"random": 0})
    batch = VectorEnv(SLOW, "walk", 2, 1)
    timestep = single.reset()
    batch.reset(seed=0)
    policy = Demonstrator(SLOW, "medium")
    for _ in range(30):
        action = policy(timestep)
        timestep = single.step(action)
        observation, reward, *_ = batch.step(np.stack([action, action]))
        vector = np.concatenate([np.ravel(block) for block in timestep.observation.values()])
        assert_array_equal(observation[0], vector.astype(np.float32))
        assert reward[0] == timestep.reward
    # Costs and energy are those of the torques that the motors gave, and not of the action.
    readings = single.task.definition.read(single.physics.data.ptr)
    assert_allclose(readings.effort(action) * TORQUES, single.physics.data.qfrc_actuator[6:], rtol=1e-12)


def test_slow_motors_swing_legs_slowly():
    speeds = {}
    for no_load_speed in (None, 2.0):
        body = with_drives(ROBOTS["tick"], no_load_speed=no_load_speed)
        environment = arc_suite.load(body, "walk", {"random": 0})
        environment.reset()
        fastest = 0.0
        for step in range(40):
            environment.step(np.full(JOINTS, 1.0 if step % 8 < 4 else -1.0))
            fastest = max(fastest, abs(environment.physics.data.qvel[6:]).max())
        speeds[no_load_speed] = fastest
    assert speeds[None] > 2.0 * speeds[2.0]


def test_bodies_without_numbers_have_the_motors_of_before():
    model = compile_model(ROBOTS["tick"])
    assert model.nu == JOINTS
    assert not (model.actuator_biastype.any() or model.actuator_forcelimited.any() or model.jnt_actfrclimited.any())
    text = body_to_json(size_body(ROBOTS["tick"]))
    assert not any(name in text for name in ("stall", "no_load_speed", "winding_loss", "friction_loss"))


def test_numbers_are_fields_of_spec_files():
    body = with_drives(ROBOTS["leaper"], no_load_speed=21.0, stall=1.2, winding_loss=0.3)
    assert body_from_json(body_to_json(body)) == body
    for fields, reason in (
        ({"stall": 9.0}, "expected none without a no_load_speed, got 9"),
        ({"stall": 1.0, "no_load_speed": 9.0}, "expected at least the largest torque, 2, got 1"),
        ({"no_load_speed": 0.0}, "no_load_speed: expected a number from 0.001 to 1e+06, got 0"),
        ({"winding_loss": -1.0}, "winding_loss: expected a number from 0 to 1e+06, got -1"),
    ):
        with pytest.raises(SpecError) as caught:
            Motor(gear=2.0, **fields)
        assert reason in str(caught.value)
    with pytest.raises(SpecError, match="friction_loss"):
        Joint(name="a", axis=(0, 1, 0), range_deg=(-9, 9), friction_loss=float("nan"))


def test_dry_friction_holds_a_joint():
    legs = []
    for leg in size_body(ROBOTS["tick"]).legs:
        links = [
            link.replace(joint=link.joint.replace(friction_loss=0.3)) if link.joint else link for link in leg.links
        ]
        legs.append(leg.replace(links=tuple(links)))
    body = size_body(ROBOTS["tick"]).replace(name="dry", legs=tuple(legs))
    model = compile_model(body)
    assert_array_equal(model.dof_frictionloss, [0.0] * 6 + [0.3] * JOINTS)
    other = mujoco.MjModel.from_xml_string(models.assemble(body).to_xml_string())
    assert_array_equal(model.dof_frictionloss, other.dof_frictionloss)


def test_heat_of_windings_is_work():
    """The cost of transport has the work of before, and the heat of the torques."""
    loss = 0.4
    actions = np.random.RandomState(0).uniform(-0.3, 0.3, (20, JOINTS))
    body = with_drives(ROBOTS["tick"], winding_loss=loss)
    costs = []
    for case in (with_drives(ROBOTS["tick"]), body):
        environment = arc_suite.load(case, "walk", {"random": 0})
        environment.reset()
        for action in actions:
            environment.step(action)
        costs.append(environment.task.progress["cost_of_transport"])
    definition = environment.task.definition
    heat = loss * ((actions * TORQUES) ** 2).sum() * definition.scene.control_timestep  # J
    weight = measure_standing(body).mass * GRAVITY
    seconds = len(actions) * definition.scene.control_timestep
    path = seconds * max(abs(environment.task.progress["speed"]), energy.MIN_PATH * definition.target_velocity)
    assert_allclose(costs[1] - costs[0], heat / weight / path, rtol=1e-6)


@pytest.mark.parametrize("settings", [{"motor_strength": 0.5}, {"joint_strength": 0.5}, {"gains": 0.5}])
def test_weak_servos_ask_for_less_within_their_limits(settings):
    """Strengths scale the torque that a servo wants, and its largest one; gains the torque alone. The line stays."""
    body = with_drives(imports.quadruped(), no_load_speed=SPEED, stall=STALL)
    environment = arc_suite.load(body, "steer", {"random": 0, **settings})
    environment.reset()
    model, data = environment.physics.model.ptr, environment.physics.data.ptr
    layout = environment.task.definition.scene.layout
    torques = np.array([joint.torque for joint in body.joints])
    largest = torques * (1.0 if "gains" in settings else 0.5)
    stiffness, damping = np.transpose([(joint.servo.stiffness, joint.servo.damping) for joint in body.joints])
    speeds = np.linspace(-12.0, 12.0, len(torques))
    data.qvel[layout.joint_velocities] = speeds
    data.ctrl[:] = 0.0
    mujoco.mj_forward(model, data)
    wanted = 0.5 * (-stiffness * (data.qpos[layout.joint_angles] - layout.home) - damping * speeds)
    fall = STALL * torques * speeds / SPEED
    expected = wanted.clip(-STALL * torques - fall, STALL * torques - fall).clip(-largest, largest)
    assert_allclose(data.qfrc_actuator[layout.joint_velocities], expected, atol=1e-9 * torques.max())


def test_weak_motors_ask_for_less():
    environment = arc_suite.load(SLOW, "walk", {"random": 0, "motor_strength": 0.5})
    environment.reset()
    environment.step(np.full(JOINTS, 0.1))
    data = environment.physics.data
    assert_allclose(data.ctrl[:JOINTS], 0.05)


@pytest.mark.slow
@pytest.mark.parametrize("no_load_speed", [None, SPEED])
def test_joints_of_failed_servos_have_their_damping_alone(no_load_speed):
    body = with_drives(imports.quadruped(), no_load_speed=no_load_speed)
    environment = arc_suite.load(body, "limp", {"random": 0, "actuator_failure": 1})
    environment.reset()
    for _ in range(45):
        environment.step(np.full(len(body.joints), 0.05))
    data = environment.physics.data
    failed = environment.task.definition.scene.layout.joint_velocities
    failed = np.arange(environment.physics.model.nv)[failed][3:6]  # of the second leg
    assert abs(data.qvel[failed]).min() > 0.1
    assert_allclose(data.qfrc_actuator[failed], 0.0, atol=1e-9)
    assert_allclose(data.qfrc_passive[failed], -0.2 * data.qvel[failed], rtol=0.02)  # one substep behind
