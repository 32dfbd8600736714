"""Joints that a file does not drive are passive; constraints between links stay, or the robot is refused by name."""

import imports
import mujoco
import numpy as np
import pytest
from robots_of_others import reference
from sprung_robots import CASES, CONNECT, CRANK, DRIVEN, FOOT, PLACES, ROBOT, write

import arc_suite
from arc_suite import models
from arc_suite.cpg import Demonstrator
from arc_suite.envs.vector import VectorEnv
from arc_suite.importing import import_robot
from arc_suite.robots.spec import SpecError

PASSIVE = {
    "sprung ankles": 4,
    "sprung shanks": 4,
    "rods that connections close": 8,
    "ankles that welds hold": 12,
    "a tail": 1,
}


@pytest.mark.parametrize("case", CASES)
def test_motors_are_the_files_and_other_joints_keep_their_springs(case, tmp_path):
    path = write(tmp_path, **CASES[case])
    body, notes = import_robot(path)
    assert len(body.joint_names) == 12 and not body.held
    assert {joint.alias.split("_")[1] for leg in body.legs for joint in leg.joints} == set(DRIVEN)
    assert reference.same_bits(path, body) == reference.STATES
    (note,) = [note for note in notes if note.startswith("passive:")]
    assert note.startswith(f"passive: {PASSIVE[case]} joints without a motor keep their springs and damping (")
    environment = arc_suite.load(body, "walk")
    model, data = environment.physics.model.ptr, environment.physics.data.ptr
    assert environment.action_spec().shape == (12,)
    environment.reset()
    environment.step(np.full(12, 0.2))
    driven = [model.joint(name).dofadr[0] for name in body.joint_names]
    passive = np.setdiff1d(np.arange(6, model.nv), driven)
    assert len(passive) == PASSIVE[case] and (data.qfrc_actuator[passive] == 0.0).all()
    assert data.qfrc_actuator[driven].all()


@pytest.mark.parametrize("case", ["sprung ankles", "rods that connections close"])
def test_kicks_change_the_velocity_of_the_torso_alone(case, tmp_path):
    """The simulation has more velocities than the robot has joints with a motor."""
    body, _ = import_robot(write(tmp_path, **CASES[case]))
    kicked = arc_suite.load(body, "walk", {"kicks": 1.0, "random": 3})
    calm = arc_suite.load(body, "walk", {"random": 3})
    batch = VectorEnv(body, "walk", 1, task_kwargs={"kicks": 1.0})
    kicked.reset()
    calm.reset()
    batch.reset(seed=3)
    largest_difference = 0.0  # m/s
    for _ in range(125):
        kicked.step(np.zeros(12))
        calm.step(np.zeros(12))
        observations, *_ = batch.step(np.zeros((1, 12)))
        difference = kicked.physics.data.qvel[:2] - calm.physics.data.qvel[:2]
        largest_difference = max(largest_difference, abs(difference).max())
    assert largest_difference > 0.02
    assert np.isfinite(observations).all()


@pytest.mark.parametrize("case", CASES)
def test_the_robot_stands_with_its_springs_and_loops(case, tmp_path):
    body = import_robot(write(tmp_path, **CASES[case])).body
    model = mujoco.MjModel.from_xml_string(models.text(body))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    loops = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
    assert model.neq == (4 if "equality" in CASES[case] else 0)
    assert abs(data.efc_pos[loops]).max(initial=0.0) < 1e-4
    for leg in body.legs:  # the feet of the sketch are those of the simulation
        foot = data.body(leg.full_name(leg.foot)).xpos - data.body("torso").xpos
        assert leg.foot_position == pytest.approx(foot, abs=1e-9)
    mujoco.mj_step(model, data, 500)
    assert data.qpos[2] > 0.8 * body.torso.standing_height


FIVE_BAR = """
<body name="{name}_front_thigh" pos="{x} {y} 0" euler="0 -40 0"><joint name="{name}_front_hip" axis="0 1 0"/>
  <geom type="capsule" fromto="0 0 0 0 0 -0.15" size="0.015" mass="0.3"/>
  <body name="{name}_front_shank" pos="0 0 -0.15" euler="0 75 0"><joint name="{name}_front_knee" axis="0 1 0"/>
    <geom type="capsule" fromto="0 0 0 0 0 -0.25" size="0.012" mass="0.1"/><geom size="0.02" pos="0 0 -0.25"/></body>
</body>
<body name="{name}_rear_thigh" pos="{x} {y} 0" euler="0 40 0"><joint name="{name}_rear_hip" axis="0 1 0"/>
  <geom type="capsule" fromto="0 0 0 0 0 -0.15" size="0.015" mass="0.3"/>
  <body name="{name}_rear_shank" pos="0 0 -0.15" euler="0 -75 0"><joint name="{name}_rear_knee" axis="0 1 0"/>
    <geom type="capsule" fromto="0 0 0 0 0 -0.24" size="0.012" mass="0.1"/></body></body>"""


def refuse_five_bars(folder, motors=("front_hip", "rear_hip")):
    """Import a robot of five-bar legs, and return the line that refuses it."""
    legs, equalities, actuators = [], [], []
    for name, (x, y) in PLACES.items():
        legs.append(FIVE_BAR.format(name=name, x=x, y=y))
        equalities.append(f'<connect body1="{name}_front_shank" body2="{name}_rear_shank" anchor="0 0 -0.25"/>')
        actuators += [f'<motor joint="{name}_{motor}"/>' for motor in motors]
    texts = {"legs": "".join(legs), "equalities": "".join(equalities), "motors": "".join(actuators), "further": ""}
    path = folder / "minitaur.xml"
    path.write_text(ROBOT.format(**texts))
    with pytest.raises(SpecError) as error:
        import_robot(path)
    return str(error.value).removeprefix(f"{path}: ")


LINE = "joint 'FL_{joint}' of a leg is moved by the loop of {parts}: "
LINE += "expected a motor at each joint between the torso and a foot"


def test_legs_that_a_loop_moves_are_refused_by_name(tmp_path):
    parts = "FL_front_shank and FL_rear_shank"
    assert refuse_five_bars(tmp_path) == LINE.format(joint="front_knee", parts=parts)
    assert refuse_five_bars(tmp_path, motors=()) == LINE.format(joint="front_hip", parts=parts)
    path = write(tmp_path, FOOT, CRANK, CONNECT, driven=("roll", "pitch", "rod"))  # a crank that drives the knee
    with pytest.raises(SpecError) as error:
        import_robot(path)
    assert str(error.value) == f"{path}: {LINE.format(joint='knee', parts='FL_end and FL_shank')}"


@pytest.mark.parametrize("anchor", ["0.1 0 0.2", "0.1 0.1 0.2"])
def test_a_constraint_that_no_joint_moves_keeps_no_robot_out(anchor, tmp_path):
    pod = '<body name="pod" pos="0.1 0 0.2"><joint name="pod" axis="0 1 0"/><geom size="0.02" mass="0.2"/></body>'
    constraint = f'<connect body1="trunk" body2="pod" anchor="{anchor}"/>'  # on the pod's hinge
    source = import_robot(write(tmp_path, equality=constraint, further=pod)).body.source
    expected_source = import_robot(write(tmp_path, further=pod)).body.source
    model, expected_model = map(mujoco.MjModel.from_xml_string, (source, expected_source))
    assert (model.neq, expected_model.neq) == (4, 0)
    assert model.key_qpos[0] == pytest.approx(expected_model.key_qpos[0], abs=1e-9)


def toes(folder, declared="", limit="", joint=""):
    """Write a URDF whose feet are sprung toes, with further elements, and return the path."""
    text = (imports.FILES / "a1_like.urdf").read_text()
    for name in ("FR", "FL", "RR", "RL"):
        fixed = f'<joint name="{name}_foot_fixed" type="fixed">'
        assert fixed in text
        hinge = f'<joint name="{name}_toe" type="revolute"><axis xyz="0 1 0"/>{limit}'
        hinge += '<dynamics damping="0.7" friction="0.2"/>'
        text = text.replace(fixed, hinge)
    path = folder / "toes.urdf"
    path.write_text(text.replace("</robot>", f"{declared}</robot>"))
    return path


def declare(*tags, joints=("hip", "thigh", "calf")):
    """Return elements that declare motors of joints; %s in the innermost tag stands for its name."""
    names = [f"{leg}_{joint}_joint" for leg in ("FR", "FL", "RR", "RL") for joint in joints]
    return "".join(tag % name if "%s" in tag else tag for name in names for tag in tags)


TRANSMISSION = '<transmission name="t"><type>SimpleTransmission</type><joint name="%s"/></transmission>'
COMMAND = (
    '<ros2_control name="c" type="system"><joint name="%s"><command_interface name="effort"/></joint></ros2_control>'
)
LIMIT = '<limit lower="-0.3" upper="0.3" effort="{}" velocity="1"/>'


@pytest.mark.parametrize(
    ("declared", "effort"),
    [(declare(TRANSMISSION), "20"), (declare(COMMAND), "20"), ("", "0")],
    ids=["transmission", "ros2_control", "effort"],
)
def test_a_urdf_says_what_it_drives(declared, effort, tmp_path):
    path = toes(tmp_path, declared, LIMIT.format(effort))
    body, notes = import_robot(path)
    assert len(body.joint_names) == 12 and not body.held
    assert "passive: 4 joints without a motor keep their springs and damping (FR_toe, FL_toe, RR_toe, RL_toe)" in notes
    model = mujoco.MjModel.from_xml_string(body.source)
    toe = model.joint("fr_toe").dofadr[0]
    assert (model.dof_damping[toe], model.dof_frictionloss[toe]) == (0.7, 0.2)


def test_legs_that_are_mostly_passive_get_a_cure(tmp_path):
    knees = declare(TRANSMISSION, joints=["calf"])
    _, notes = import_robot(toes(tmp_path, knees, LIMIT.format("20")))
    (note,) = [note for note in notes if note.startswith("passive:")]
    assert note == (
        "passive: 12 joints without a motor keep their springs and damping (FR_hip_joint, FR_thigh_joint, FR_toe, "
        "FL_hip_joint, ...): most joints of the legs; add a transmission for each joint that has a motor, or remove "
        "all of them; an effort of 0 means no motor"
    )
    assert "legs: 4 (r1, l1, r2, l2), 1 joint each" in notes


def test_a_urdf_that_drives_no_legs_says_nothing_of_motors(tmp_path):
    transmission = TRANSMISSION % "FR_toe"
    body, notes = import_robot(toes(tmp_path, transmission, LIMIT.format("20")))
    assert len(body.joint_names) == 16
    assert not [note for note in notes if note.startswith("passive:")]


@pytest.mark.slow
@pytest.mark.parametrize("case", ["sprung ankles", "rods that connections close"])
def test_the_robot_walks(case, tmp_path):
    environment = arc_suite.load(import_robot(write(tmp_path, **CASES[case])).body, "walk")
    act = Demonstrator(environment, "medium")
    timestep = environment.reset()
    for _ in range(300):
        timestep = environment.step(act(timestep))
        assert not timestep.last()
    target = environment.task.definition.target_velocity
    assert environment.task.progress["speed"] > 0.75 * target
