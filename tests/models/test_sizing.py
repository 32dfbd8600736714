"""What a body leaves open is sized by rules without dimension; the four robots leave nothing open."""

import math

import mujoco
import numpy as np
import pytest

from arc_suite import models
from arc_suite.bodies import generator
from arc_suite.models import stride
from arc_suite.models.sizing import control_timestep, natural_frequency, size_body
from arc_suite.models.standing import measure_standing, pose_mechanics, stability_margin
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Motor, Simulation

BODY = generator.generate(6, 3)


def compiled(body):
    return mujoco.MjModel.from_xml_string(models.assemble(body).to_xml_string())


@pytest.mark.parametrize("robot", ROBOTS)
def test_published_robots_are_not_sized(robot):
    assert size_body(ROBOTS[robot]) is ROBOTS[robot]
    assert ROBOTS[robot].simulation == Simulation(
        timestep=0.002, contact_time=0.02, contact_width=0.001, contact_margin=0.005
    )


def test_constants_scale_with_the_height():
    body = generator.scaled(BODY, 0.3 / 0.4 * 9.0)  # nine times the height at which MuJoCo's defaults hold
    model = compiled(body)
    assert model.opt.timestep == pytest.approx(0.006, rel=1e-12)
    assert control_timestep(body) == pytest.approx(0.15, rel=1e-12)
    for geom in [model.geom("floor"), *(model.geom(name) for name in body.foot_names)]:
        assert geom.solref == pytest.approx([0.06, 1.0], rel=1e-12)
        assert geom.solimp == pytest.approx([0.9, 0.95, 0.009, 0.5, 2.0], rel=1e-12)
        assert geom.margin[0] == pytest.approx(0.045, rel=1e-12)
    assert model.joint("l1_knee").solref == pytest.approx([0.06, 1.0], rel=1e-12)


def test_motors_armature_and_damping_follow_the_rules():
    model = compiled(BODY)
    data = mujoco.MjData(model)
    weight = 9.81 * model.body_mass.sum()
    largest = np.zeros(18)
    for angles, stands in stride.stride_poses(BODY):
        data.qpos[7:] = angles
        mujoco.mj_forward(model, data)
        feet = [model.body(f"{leg.name}_foot").id for leg in BODY.legs]
        # The least forces under the feet that stand which carry the weight, and no moment about its center.
        places = data.xpos[feet][stands, :2] - data.subtree_com[1, :2]
        balance = np.vstack([np.ones(len(places)), places.T])
        forces = np.linalg.pinv(balance) @ [weight, 0.0, 0.0]
        forces = np.maximum(forces, 0.25 * weight / len(places))
        torques = data.qfrc_bias[6:].copy()
        for foot, force in zip(np.array(feet)[stands], forces, strict=True):
            jacobian = np.empty((3, model.nv))
            mujoco.mj_jacBody(model, data, jacobian, None, foot)
            torques -= force * jacobian[2, 6:]
        largest = np.maximum(largest, abs(torques))
    inertias = measure_standing(BODY).inertias
    loads = np.maximum(largest, inertias * stride.swing_accelerations(BODY)).reshape(6, 3)
    loads = np.maximum(loads, 0.25 * loads.max(axis=1, keepdims=True)).ravel()
    assert model.actuator_gear[:, 0] == pytest.approx(30.0 * loads, rel=1e-6)
    frequency = natural_frequency(BODY)
    assert frequency == pytest.approx(0.5 / control_timestep(BODY), rel=1e-12)
    armature = np.maximum(0.3 * inertias, loads / (0.035 * frequency**2) - inertias)
    assert model.dof_armature[6:] == pytest.approx(armature, rel=1e-6)
    assert model.dof_damping[6:] == pytest.approx(0.1 * frequency * (inertias + model.dof_armature[6:]), rel=1e-9)


def test_loads_are_those_of_a_stride():
    """Of six legs of three joints, at the target velocity: 0.65 of a cycle on the ground, at 0.27 sqrt(g / h)."""
    poses = list(stride.stride_poses(BODY))
    stands = np.array([feet for _, feet in poses])
    assert stands.mean() == pytest.approx(0.65, abs=0.02)
    assert stands.sum(axis=1).min() == 3
    ahead = stride.half_stroke(BODY, stride.fitted_gait(BODY))
    assert ahead == pytest.approx(0.5 * 0.2 / 0.27 * 0.65 * 0.4)
    soles = np.array([pose_mechanics(BODY, angles).soles for angles, _ in poses]) - measure_standing(BODY).soles
    assert abs(soles[stands][:, 0]).max() == pytest.approx(ahead, rel=0.1)
    assert soles[~stands][:, 2].max() == pytest.approx(0.12 * 0.4, rel=0.3)
    # On three feet each bears twice as much as on six, and two to three times on the single one of its side.
    share = stride.stride_loads(BODY).reshape(6, 3)[:, 1:] / abs(measure_standing(BODY).loads.reshape(6, 3)[:, 1:])
    assert share.min() > 2.0 and share.max() < 3.1


def test_armature_follows_from_the_load_and_not_from_a_motor_that_is_given():
    legs = size_body(BODY).legs
    strong = tuple(
        leg.replace(links=tuple(link.replace(joint=link.joint.replace(motor=Motor(gear=99.0))) for link in leg.links))
        for leg in BODY.legs
    )
    for leg, other in zip(legs, size_body(BODY.replace(legs=strong)).legs, strict=True):
        assert [joint.armature for joint in leg.joints] == [joint.armature for joint in other.joints]
        assert {joint.motor.gear for joint in other.joints} == {99.0}


def test_what_a_body_says_is_kept():
    knee = BODY.legs[0].links[1].joint.replace(motor=Motor(gear=7.0), armature=0.5, damping=0.0)
    legs = list(BODY.legs)
    legs[0] = legs[0].replace(links=(legs[0].links[0], legs[0].links[1].replace(joint=knee), legs[0].links[2]))
    simulation = Simulation(timestep=0.001)
    body = size_body(BODY.replace(legs=tuple(legs), simulation=simulation))
    assert body.legs[0].links[1].joint == knee
    assert body.simulation == simulation
    assert body.legs[1].links[1].joint.motor is not None
    assert size_body(body) is body


def test_sizing_keeps_dimensionless_ratios_when_a_body_grows():
    small, large = (size_body(generator.scaled(BODY, scale)) for scale in (0.1, 10.0))
    for leg, giant in zip(small.legs, large.legs, strict=True):
        for joint, other in zip(leg.joints, giant.joints, strict=True):
            # torque ~ mass x length, inertia ~ mass x length^2, time ~ sqrt(length); mass ~ length^3
            assert other.motor.gear / joint.motor.gear == pytest.approx(100.0**4, rel=1e-6)
            assert other.armature / joint.armature == pytest.approx(100.0**5, rel=1e-6)
            assert other.damping / joint.damping == pytest.approx(100.0**4.5, rel=1e-6)


@pytest.mark.parametrize(("scale", "density"), [(0.05, 10.0), (0.025, 300.0), (100.0, 10.0), (100.0, 1e9)])
def test_sizing_finds_no_number_that_a_spec_refuses(scale, density):
    body = size_body(generator.scaled(BODY.replace(density=density), scale))  # 2 cm, 1 cm and 40 m high
    assert min(joint.motor.gear for leg in body.legs for joint in leg.joints) > 0.0
    wide = generator.scaled(generator.generate(12, 3, "radial"), 100.0)
    assert size_body(wide).camera.position[1] < -100.0
    tall = BODY.replace(torso=BODY.torso.replace(standing_height=100.0), density=density)
    assert size_body(tall).simulation.contact_margin > 1.0


def test_a_leg_in_which_nothing_carries_gets_motors_too():
    body = size_body(generator.generate(6, 1))
    gears = {round(leg.joints[0].motor.gear / measure_standing(body).mass, 6) for leg in body.legs}
    assert min(gears) > 0.01


def test_stance_is_measured():
    pose = measure_standing(BODY)
    model = compiled(BODY)
    assert pose.mass == pytest.approx(model.body_mass.sum(), rel=1e-12)
    assert pose.height == 0.4
    for leg, sole in zip(BODY.legs, pose.soles, strict=True):
        assert sole + (0.0, 0.0, leg.foot.radius) == pytest.approx(leg.foot_position, abs=1e-12)


@pytest.mark.parametrize(
    ("point", "margin"),
    [((0.0, 0.0), 1.0), ((0.5, 0.0), 0.5), ((0.9, -0.8), 0.1), ((1.0, 0.3), 0.0), ((1.5, 0.0), -0.5)],
)
def test_stability_margin_is_the_distance_from_the_nearest_edge(point, margin):
    square = [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0), (0.2, 0.1)]
    assert stability_margin(point, square) == pytest.approx(margin, abs=1e-12)


def test_stability_margin_of_few_feet():
    triangle = [(math.cos(angle), math.sin(angle)) for angle in (0.0, 2.0 * math.pi / 3.0, -2.0 * math.pi / 3.0)]
    assert stability_margin((0.0, 0.0), triangle) == pytest.approx(0.5)
    assert stability_margin((0.0, 0.3), [(-1.0, 0.0), (1.0, 0.0)]) == pytest.approx(-0.3)
    assert stability_margin((0.0, 0.0), [(3.0, 4.0)]) == pytest.approx(-5.0)
    assert stability_margin((0.0, 0.0), np.empty((0, 2))) == -math.inf
