"""The four robots' compiled models against the published figures, by formulas of their own."""

import functools
import math

import mujoco
import numpy as np
import pytest

from arc_suite import models
from arc_suite.robots import ROBOTS

HIP_AXIS = (0.0, 0.0, 1.0)

# Left legs: name, name of the mirrored leg, mount, yaw in degrees, foot radius, and the chain of
# (part, end of its capsule, radius, joint, axis, range in degrees); `None` for a rigid part.
TICK_LEG = (
    ("upper", (0.0, 0.08, 0.14), 0.025, "hip", HIP_AXIS, (-40, 40)),
    ("middle", (0.0, 0.18, -0.1), 0.025, "knee", (-1, 0, 0), (-80, 0)),
    ("lower", (0.0, -0.03, -0.22), 0.025, "ankle", (-1, 0, 0), (0, 100)),
)
LEFT_LEGS = {
    "queen": (
        (
            *("l1", "r1", (0.25, 0.35, 0.0), 0, 0.05),
            ("upper", (0.3, 0.3, -0.15), 0.08, "hip", HIP_AXIS, (-30, 30)),
            ("middle", (0.1, 0.1, -0.35), 0.06, "knee", (-1, 1, 0), (-80, 0)),
            ("lower", (0.02, 0.02, -0.25), 0.04, "ankle", (-1, 1, 0), (0, 70)),
        ),
        (
            *("l2", "r2", (0.0, 0.4, 0.0), 0, 0.05),
            ("upper", (0.0, 0.4, -0.15), 0.08, "hip", HIP_AXIS, (-30, 30)),
            ("middle", (0.0, 0.15, -0.35), 0.06, "knee", (-1, 0, 0), (-80, 0)),
            ("lower", (0.0, 0.03, -0.25), 0.04, "ankle", (-1, 0, 0), (0, 100)),
        ),
        (
            *("l3", "r3", (-0.25, 0.35, 0.0), 0, 0.05),
            ("upper", (-0.3, 0.3, -0.15), 0.08, "hip", HIP_AXIS, (-30, 30)),
            ("middle", (-0.1, 0.1, -0.35), 0.06, "knee", (1, 1, 0), (0, 80)),
            ("lower", (-0.02, 0.02, -0.25), 0.04, "ankle", (1, 1, 0), (-70, 0)),
        ),
    ),
    "bastion": (
        (
            *("l1", "r1", (0.2, 0.28, 0.0), 0, 0.05),
            ("upper", (0.15, 0.2, -0.1), 0.06, "hip", HIP_AXIS, (-30, 30)),
            ("lower", (0.05, 0.05, -0.3), 0.05, "ankle", (1, -1, 0), (0, 100)),
        ),
        (
            *("l2", "r2", (0.0, 0.3, 0.0), 0, 0.05),
            ("upper", (0.08, 0.25, -0.1), 0.06, "hip", HIP_AXIS, (-45, 45)),
            ("lower", (0.0, 0.05, -0.3), 0.05, "ankle", (1, 0, 0), (0, 100)),
        ),
        (
            *("l3", "r3", (-0.2, 0.28, 0.0), 0, 0.05),
            ("upper", (-0.15, 0.2, -0.1), 0.06, "hip", HIP_AXIS, (-30, 30)),
            ("lower", (-0.05, 0.05, -0.3), 0.05, "ankle", (1, 1, 0), (0, 100)),
        ),
    ),
    "tick": (
        ("l1", "r1", (0.13, 0.09, 0.02), -35, 0.03, *TICK_LEG),
        ("l2", "r2", (0.0, 0.1, 0.02), 0, 0.03, *TICK_LEG),
        ("l3", "r3", (-0.13, 0.09, 0.02), 35, 0.03, *TICK_LEG),
    ),
    "leaper": (
        (
            *("fl", "fr", (0.0, 0.0, 0.1), 0, 0.045),
            ("aux", (0.05, 0.15, 0.0), 0.05, None, None, None),
            ("upper", (0.15, 0.15, 0.0), 0.05, "hip", HIP_AXIS, (-30, 30)),
            ("middle", (0.12, 0.12, -0.25), 0.045, "knee", (-1, 1, 0), (-80, 0)),
            ("lower", (0.06, 0.06, -0.18), 0.035, "ankle", (-1, 1, 0), (0, 100)),
        ),
        (
            *("rl", "rr", (0.0, 0.0, 0.1), 0, 0.045),
            ("aux", (-0.05, 0.15, 0.0), 0.05, None, None, None),
            ("upper", (-0.15, 0.15, 0.0), 0.05, "hip", HIP_AXIS, (-30, 30)),
            ("middle", (-0.12, 0.12, -0.25), 0.045, "knee", (1, 1, 0), (-80, 0)),
            ("lower", (-0.06, 0.06, -0.18), 0.035, "ankle", (1, 1, 0), (-100, 0)),
        ),
    ),
}

# Torso shapes: name, kind, size, center, pitch in degrees, and the mass of those that touch nothing.
TORSOS = {
    "queen": (
        ("chassis", "ellipsoid", (0.35, 0.45, 0.15), (0.0, 0.0, -0.05), 0, None),
        ("carapace_main", "ellipsoid", (0.55, 0.65, 0.15), (0.0, 0.0, 0.25), 0, 10.0),
    ),
    "bastion": (
        ("chassis", "box", (0.25, 0.25, 0.1), (0.0, 0.0, 0.0), 0, None),
        ("carapace_center", "ellipsoid", (0.38, 0.2, 0.2), (-0.05, 0.0, 0.15), 10, 3.0),
    ),
    "tick": (("chassis", "ellipsoid", (0.18, 0.115, 0.055), (0.0, 0.0, -0.005), 0, None),),
    "leaper": (("torso_geom", "sphere", (0.15,), (0.0, 0.0, 0.0), 0, None),),
}

# Standing height, density, gear, damping of knees and ankles, mass, bodies, camera position.
FIGURES = {
    "queen": (0.75, 10.0, 120.0, 10.0, 12.0866, 25, (0.0, -7.0, 3.0)),
    "bastion": (0.5, 25.0, 150.0, 10.0, 5.3677, 19, (0.0, -5.0, 2.0)),
    "tick": (0.18, 6.0, 120.0, 8.0, 0.0814, 25, (0.0, -3.0, 1.2)),
    "leaper": (0.5, 5.0, 150.0, 10.0, 0.2224, 21, (0.0, -4.0, 1.5)),
}

each_robot = pytest.mark.parametrize("robot", list(FIGURES))


@functools.cache
def model_of(robot):
    return mujoco.MjModel.from_xml_string(models.assemble(ROBOTS[robot]).to_xml_string())


def expected_legs(robot):
    """All legs of the facts as (name, mount, yaw, foot radius, chain), right ones mirrored here."""
    for left, right, mount, yaw, foot, *chain in LEFT_LEGS[robot]:
        yield left, mount, yaw, foot, chain
        mirrored = []
        for part, (x, y, z), radius, joint, axis, limits in chain:
            if axis is not None and axis != HIP_AXIS:
                axis = (-axis[0], axis[1], 0)
            mirrored.append((part, (x, -y, z), radius, joint, axis, limits))
        yield right, (mount[0], -mount[1], mount[2]), -yaw, foot, mirrored


def matrix(quat):
    result = np.empty(9)
    mujoco.mju_quat2Mat(result, quat)
    return result.reshape(3, 3)


@each_robot
def test_masses_are_the_published_ones(robot):
    """Those of parts follow from their shapes by one density, and are golden numbers."""
    _, density, _, _, total, _, _ = FIGURES[robot]
    model = model_of(robot)
    assert model.body_mass.sum() == pytest.approx(total, abs=5e-5)
    for name, _, _, radius, _ in expected_legs(robot):
        assert model.body(f"{name}_foot").mass[0] == pytest.approx(density * 4.0 / 3.0 * math.pi * radius**3, rel=1e-12)


@each_robot
def test_links_lie_where_the_facts_say(robot):
    model = model_of(robot)
    for name, mount, yaw, foot_radius, chain in expected_legs(robot):
        parent, position, turn = "torso", mount, math.radians(yaw)
        for part, end, radius, *_ in chain:
            body, geom = model.body(f"{name}_{part}"), model.geom(f"{name}_{part}")
            assert model.body(body.parentid[0]).name == parent
            assert body.pos == pytest.approx(position, abs=1e-15)
            quat = [math.cos(turn / 2.0), 0.0, 0.0, math.sin(turn / 2.0)]
            assert body.quat == pytest.approx(quat, abs=1e-15)
            assert geom.type[0] == mujoco.mjtGeom.mjGEOM_CAPSULE
            assert geom.size[:2] == pytest.approx((radius, math.hypot(*end) / 2.0), rel=1e-12)
            assert geom.pos == pytest.approx(np.array(end) / 2.0, abs=1e-12)
            axis = matrix(geom.quat)[:, 2]
            assert abs(axis @ end) == pytest.approx(math.hypot(*end), rel=1e-12)
            parent, position, turn = f"{name}_{part}", end, 0.0
        foot = model.body(f"{name}_foot")
        assert model.body(foot.parentid[0]).name == parent
        assert foot.pos == pytest.approx(position, abs=1e-15)
        assert foot.jntnum[0] == 0
        geom = model.geom(f"{name}_foot")
        assert (geom.type[0], geom.size[0]) == (mujoco.mjtGeom.mjGEOM_SPHERE, foot_radius)
    for name, kind, size, position, pitch, _ in TORSOS[robot]:
        geom = model.geom(name)
        assert geom.type[0] == getattr(mujoco.mjtGeom, f"mjGEOM_{kind.upper()}")
        assert geom.size[: len(size)] == pytest.approx(size)
        assert geom.pos == pytest.approx(position)
        half = math.radians(pitch) / 2.0
        assert geom.quat == pytest.approx([math.cos(half), 0.0, math.sin(half), 0.0])


@each_robot
def test_joints_and_motors_are_the_published_ones(robot):
    model = model_of(robot)
    _, _, gear, damping, _, _, _ = FIGURES[robot]
    moving = {}
    for name, _, _, _, chain in sorted(expected_legs(robot)):
        for part, _, _, joint, axis, limits in chain:
            if joint is None:
                assert model.body(f"{name}_{part}").jntnum[0] == 0
            else:
                moving[f"{name}_{joint}"] = (f"{name}_{part}", np.array(axis), limits, joint == "hip")
    assert [model.actuator(i).name for i in range(model.nu)] == list(moving)
    assert [model.joint(i).name for i in range(1, model.njnt)] == list(moving)
    for name, (part, axis, limits, is_hip) in moving.items():
        joint = model.joint(name)
        assert joint.type[0] == mujoco.mjtJoint.mjJNT_HINGE
        assert model.body(joint.bodyid[0]).name == part
        assert joint.axis == pytest.approx(axis / np.linalg.norm(axis), abs=1e-15)
        assert joint.pos == pytest.approx((0.0, 0.0, 0.0))
        assert joint.limited[0]
        assert joint.range == pytest.approx(np.radians(limits), abs=1e-15)
        assert (joint.armature[0], joint.damping[0]) == ((1.0, 1.0) if is_hip else (2.0, damping))
        assert (joint.stiffness[0], joint.frictionloss[0]) == (0.0, 0.0)
        motor = model.actuator(name)
        assert (motor.trntype[0], motor.trnid[0]) == (mujoco.mjtTrn.mjTRN_JOINT, joint.id)
        assert motor.gear == pytest.approx([gear, 0, 0, 0, 0, 0])
        assert motor.ctrllimited[0]
        assert motor.ctrlrange == pytest.approx((-1.0, 1.0))
        # a torque motor: force = control, without states or bias
        assert motor.gainprm[0] == 1.0
        assert not motor.biasprm.any()
        assert motor.dyntype[0] == mujoco.mjtDyn.mjDYN_NONE
        assert not motor.forcelimited[0]
    root = model.joint("root")
    assert root.type[0] == mujoco.mjtJoint.mjJNT_FREE
    assert not model.dof_armature[:6].any()
    assert not model.dof_damping[:6].any()


@each_robot
def test_the_robot_stands_at_its_height_with_all_joints_at_zero(robot):
    model = model_of(robot)
    height, *_, bodies, _ = FIGURES[robot]
    assert model.nbody - 1 == bodies
    legs = [(name, [part for part, *_ in chain]) for name, _, _, _, chain in sorted(expected_legs(robot))]
    expected = ["world", "torso", *(f"{name}_{part}" for name, parts in legs for part in (*parts, "foot"))]
    assert [model.body(i).name for i in range(model.nbody)] == expected
    assert model.qpos0 == pytest.approx([0, 0, height, 1, 0, 0, 0] + [0] * model.nu)


@each_robot
def test_contacts_and_options_are_the_published_ones(robot):
    model = model_of(robot)
    option = model.opt
    assert option.timestep == 0.002
    assert option.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    assert option.solver == mujoco.mjtSolver.mjSOL_NEWTON
    assert option.iterations == 200
    assert option.cone == mujoco.mjtCone.mjCONE_PYRAMIDAL
    assert option.gravity == pytest.approx((0.0, 0.0, -9.81))
    assert not option.disableflags & mujoco.mjtDisableBit.mjDSBL_FILTERPARENT
    assert option.disableflags & mujoco.mjtDisableBit.mjDSBL_ISLAND
    weights_only = {name for name, *_, mass in TORSOS[robot] if mass is not None}
    for i in range(model.ngeom):
        geom = model.geom(i)
        if geom.name in weights_only:
            assert (geom.contype[0], geom.conaffinity[0]) == (0, 0)
            continue
        assert (geom.contype[0], geom.conaffinity[0]) == ((1, 1) if geom.name == "floor" else (1, 0))
        assert geom.condim[0] == 3
        assert geom.friction == pytest.approx((1.0, 0.5, 0.5))
        assert geom.margin[0] == 0.005
        assert geom.gap[0] == 0.0
    floor = model.geom("floor")
    assert floor.type[0] == mujoco.mjtGeom.mjGEOM_PLANE
    assert (floor.bodyid[0], floor.pos[2]) == (0, 0.0)


@each_robot
def test_the_tracking_camera_is_the_published_one(robot):
    model = model_of(robot)
    camera = model.camera("tracking")
    assert camera.mode[0] == mujoco.mjtCamLight.mjCAMLIGHT_TRACKCOM
    assert camera.pos == pytest.approx(FIGURES[robot][-1])
    side, up = np.array((1.0, 0.0, 0.0)), np.array((0.0, 0.5, 1.0)) / math.sqrt(1.25)
    np.testing.assert_allclose(matrix(camera.quat), np.stack([side, up, np.cross(side, up)], axis=1), atol=1e-12)
    assert model.ncam >= 2
