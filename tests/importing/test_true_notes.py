"""One true line on what is as in the file, or is not: masses, joints, motors, floors, drag in a fluid."""

import imports
import mujoco
import pytest

from arc_suite.importing import import_robot

KNEE_MOTOR = '<motor gear="45.43" forcerange="-45.43 45.43"/>'
FLOOR = 'type="plane" size="0 0 1"'
TRUNK = '<geom type="box" size="0.19 0.0468 0.057"/>'
GRIPPER = """
  <link name="arm"><inertial><mass value="0.2"/>{inertia}</inertial></link>
  <link name="left"><inertial><mass value="0.02"/>{inertia}</inertial></link>
  <link name="right"><inertial><mass value="0.02"/>{inertia}</inertial></link>
  <joint name="arm" type="revolute"><parent link="trunk"/><child link="arm"/><origin xyz="0.1 0 0.1"/>{limit}</joint>
  <joint name="left" type="revolute"><parent link="arm"/><child link="left"/>{limit}</joint>
  <joint name="right" type="revolute"><parent link="arm"/><child link="right"/>{limit}
    <mimic joint="left" multiplier="-1"/></joint>"""
GRIPPER = GRIPPER.format(
    inertia='<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/>',
    limit='<limit lower="-1" upper="1" effort="5" velocity="3"/>',
)
LEGS = [f"{leg}_{joint}_joint" for leg in ("FR", "FL", "RR", "RL") for joint in ("hip", "thigh", "calf")]


def change(folder, name, *replacements):
    """Write a file with texts replaced wherever they are, and return what is imported from it."""
    text = (imports.FILES / name).read_text()
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    path = folder / name
    path.write_text(text)
    return import_robot(path)


def of_kind(notes, *kinds):
    return [note for note in notes if note.startswith(kinds)]


def test_joints_of_legs_that_follow_others_get_motors_and_one_line(tmp_path):
    mimics = []
    for leg in ("FR", "FL", "RR", "RL"):
        joint = f'<joint name="{leg}_calf_joint" type="revolute">'
        mimics.append((joint, f'{joint}<mimic joint="{leg}_thigh_joint" multiplier="-2"/>'))
    body, notes = change(tmp_path, "a1_like.urdf", *mimics)
    names = "FR_calf_joint, FL_calf_joint, RR_calf_joint, RL_calf_joint"
    assert f"motors: 4 joints of legs follow others in the file, not here ({names})" in notes
    assert len(body.joint_names) == 12
    assert not of_kind(notes, "kept", "passive", "left out: 4")


def gripper_of_mjcf(folder):
    """Import the robot with two fingers. One finger has a motor, the other follows it."""
    text = (imports.FILES / "go2_like.xml").read_text()
    finger = '<body><joint name="{0}" range="-1 1"/><geom type="sphere" size="0.01" pos="0 0 0.05" mass="0.02"/></body>'
    fingers = f'<body pos="0.1 0 0.1">{finger.format("left")}{finger.format("right")}</body>'
    equality = '<equality><joint joint1="right" joint2="left" polycoef="0 -1 0 0 0"/></equality></mujoco>'
    keyframes = text[text.index("<keyframe>") :]  # of fewer joints
    motor = ("</actuator>", '<motor class="robot" joint="left"/></actuator>')
    return change(folder, "go2_like.xml", (TRUNK, TRUNK + fingers), motor, (keyframes, equality))


def gripper_of_urdf(folder):
    return change(folder, "a1_like.urdf", ("</robot>", f"{GRIPPER}</robot>"))


@pytest.mark.parametrize("gripper", [gripper_of_mjcf, gripper_of_urdf])
def test_fingers_that_follow_others_do_so(gripper, tmp_path):
    body, notes = gripper(tmp_path)
    assert "kept: 1 joints follow others (right)" in notes
    assert not of_kind(notes, "passive", "left out: 1")
    assert "right" not in [joint.name for joint in body.held]
    model = mujoco.MjModel.from_xml_string(body.source)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.joint("left").qvel = 1.0
    mujoco.mj_step(model, data, 20)
    assert data.joint("left").qpos > 0.005
    assert -data.joint("right").qpos > 0.3 * data.joint("left").qpos  # constraints are soft


def test_reductions_are_told_where_there_are_some(tmp_path):
    transmission = '<transmission><joint name="{}"/><actuator><mechanicalReduction>{}</mechanicalReduction></actuator>'
    line = "reductions: 12 transmissions have gears, such as 9.1; effort is the torque at the joint, behind them"
    for reduction, expected in (("9.1", [line]), ("1.0", []), ("nan", []), ("gear", [])):
        elements = "".join(transmission.format(name, reduction) + "</transmission>" for name in LEGS)
        body, notes = change(tmp_path, "a1_like.urdf", ("</robot>", f"{elements}</robot>"))
        assert of_kind(notes, "reductions") == expected
        assert body.legs[0].joints[0].servo.limit == 1000.0


@pytest.mark.parametrize(
    "motor",
    ['ctrlrange="-5 30" gear="1" forcerange="-90 90"', 'ctrlrange="-30 5" gear="-1"', 'gear="60" forcerange="-5 30"'],
    ids=["ctrlrange", "a gear below 0", "forcerange"],
)
def test_motors_that_are_stronger_one_way_are_told(motor, tmp_path):
    forces = "" if "forcerange" in motor else 'forcerange="-90 90"'
    body, notes = change(tmp_path, "go2_like.xml", (KNEE_MOTOR, f"<motor {motor} {forces}/>"))
    factor = 60 if "60" in motor else 1  # of the force at the joint
    place = f"such as FL_calf_joint with {-5 * factor} to {30 * factor} N m"
    if factor == 1:
        line = f"limits: 4 motors are stronger one way in the file, {place}; here they have 30 N m both ways"
        assert line in notes and body.legs[0].joints[2].servo.limit == 30.0
    else:  # the controls bind first
        assert not [note for note in notes if "one way" in note]
    mirrored = "mirrored: 4 motors have a gear below 0 in the file, such as FL_calf_joint; "
    expected = [f"{mirrored}actions count along the joints' axes"] if "-1" in motor else []
    assert of_kind(notes, "mirrored") == expected


def test_controls_that_reach_less_far_than_joints_are_told(tmp_path):
    knees = '<position kp="60" kv="2" ctrlrange="-2 -1"/>'
    motors = [(f'<motor name="{leg}_calf"', f'<position name="{leg}_calf"') for leg in ("FL", "FR", "RL", "RR")]
    _, notes = change(tmp_path, "go2_like.xml", (KNEE_MOTOR, knees), *motors)
    line = "left out: ctrlrange of 4 position actuators, less than the joint's range, such as FL_calf_joint"
    assert line in notes


WORLDS = {
    "a floor that slopes": (f'{FLOOR} euler="0 0.3 0"', "left out: a floor that slopes by 17.2 degrees"),
    "a wall": (
        f'{FLOOR}/><geom type="plane" size="0 0 1" pos="9 0 0" euler="0 -0.7 0"',
        "left out: 1 shapes of the world",
    ),
    "a stair": (f'{FLOOR}/><geom type="box" size="1 1 0.1"', "left out: 1 shapes of the world"),
    "paint on the floor": (f'{FLOOR}/><geom type="box" size="1 1 0.1" contype="0" conaffinity="0"', None),
}


@pytest.mark.parametrize("case", WORLDS)
def test_what_the_world_has_is_told(case, tmp_path):
    floor, expected = WORLDS[case]
    _, notes = change(tmp_path, "go2_like.xml", (FLOOR, floor))
    lines = [note for note in notes if note.endswith(", as arenas have their own ground")]
    assert lines == ([] if expected is None else [f"{expected}, as arenas have their own ground"])


@pytest.mark.parametrize("density", [0.0, 1000.0])
def test_drag_of_ellipsoids_is_told_in_a_fluid_alone(density, tmp_path):
    ellipsoid = TRUNK.replace("/>", ' fluidshape="ellipsoid"/>')
    medium = ("<option cone", f'<option density="{density}" cone')
    body, notes = change(tmp_path, "go2_like.xml", (TRUNK, ellipsoid), medium)
    line = "fluid: 1 shapes have the drag of ellipsoids in the file, here that of their inertia"
    assert of_kind(notes, "fluid") == ([line] if density else [])
    model = mujoco.MjModel.from_xml_string(body.source)
    assert model.opt.density == density and not model.geom_fluid.any()


MASS = '<inertial><mass value="0"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial>'
CUBE = '<collision><geometry><box size="0.1 0.1 0.1"/></geometry></collision>'
PART = """<link name="{0}">{1}</link><joint name="{0}_to_trunk" type="fixed">
  <origin xyz="0 0 0.1"/><parent link="trunk"/><child link="{0}"/></joint>"""


def mass_of(body):
    return mujoco.MjModel.from_xml_string(body.source).body_mass.sum()


def test_links_without_a_mass_and_what_they_weigh_are_told(tmp_path):
    plain_mass = mass_of(change(tmp_path, "a1_like.urdf").body)
    empty = "masses: {} links have no mass and no collider in the file, and weigh nothing here ({})"
    for inertial in ("", MASS):
        parts = PART.format("lid", inertial + CUBE) + PART.format("lamp", inertial)
        body, notes = change(tmp_path, "a1_like.urdf", ("</robot>", f"{parts}</robot>"))
        lid = "masses: 1 links with colliders have none in the file, and get 1000 kg/m^3 (lid)"
        assert of_kind(notes, "masses") == [lid, empty.format(2, "base, lamp")]
        assert mass_of(body) == pytest.approx(plain_mass + 1.0)  # a cube of a liter
    many = "".join(PART.format(name, "") for name in "abcde")
    _, notes = change(tmp_path, "a1_like.urdf", ("</robot>", f"{many}</robot>"))
    assert of_kind(notes, "masses") == [empty.format(6, "base, a, b, c, ...")]


def test_bodies_that_weigh_what_their_shapes_do_are_told(tmp_path):
    body, notes = change(tmp_path, "go2_like.xml")
    assert not of_kind(notes, "masses")
    inertial = '<inertial pos="-0.0037 -0.0223 -0.0327" mass="1.152"'
    box = '<geom type="box" size="0.0123 0.017 0.1065"'
    heavy_box = box.replace("<geom", '<geom mass="2.152"')
    text = (imports.FILES / "go2_like.xml").read_text()
    thigh = text[text.index(inertial) : text.index("/>", text.index(inertial)) + 2]
    heavier_body, notes = change(tmp_path, "go2_like.xml", (thigh, ""), (box, heavy_box))
    count = text.count(thigh)
    line = f"masses: {count} of 13 bodies have no inertial in the file: they have the mass or density of their shapes"
    assert of_kind(notes, "masses") == [line]
    assert mass_of(heavier_body) == pytest.approx(mass_of(body) + count)


def test_damping_friction_and_springs_of_joints_are_told(tmp_path):
    _, notes = change(tmp_path, "a1_like.urdf")
    assert of_kind(notes, "joint damping", "joint friction", "joint springs") == [
        "joint damping: none in the file; servos alone damp",
        "joint friction: none in the file",
    ]
    joint = '<joint name="FR_{}_joint" type="revolute">'
    dynamics = '<dynamics damping="{}" friction="{}"/>'
    changes = [
        (joint.format("hip"), joint.format("hip") + dynamics.format(0.05, 0.0)),
        (joint.format("calf"), joint.format("calf") + dynamics.format(0.2, 0.1)),
    ]
    _, notes = change(tmp_path, "a1_like.urdf", *changes)
    assert "joint damping: that of the file, 0.05 to 0.2 N m s/rad at 2 of 12 joints; servos damp in addition" in notes
    assert "joint friction: that of the file, 0.1 N m at 1 of 12 joints" in notes
    torso = ("<freejoint/>", '<joint type="free" damping="3"/>')
    springs = ('<joint axis="0 1 0"', '<joint stiffness="5" axis="0 1 0"')
    body, notes = change(tmp_path, "go2_like.xml", torso, springs)
    assert "joint springs: those of the file, 5 N m/rad at 12 of 12 joints" in notes
    assert "torso damping: the file resists its movement by 3 N s/m, kept" in notes
    model = mujoco.MjModel.from_xml_string(body.source)
    assert model.dof_damping[:6].tolist() == [3.0] * 6 and model.jnt_stiffness[1:].tolist() == [5.0] * 12
