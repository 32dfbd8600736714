"""An imported robot has the file's physics to the last bit, the suite's names, and a sketch that stands as the file."""

import importlib.util
import pathlib
import re
import struct
import sys

import mujoco
import numpy as np
import pytest

from arc_suite import registry
from arc_suite.importing import import_robot
from arc_suite.models import source
from arc_suite.models.standing import stability_margin
from arc_suite.robots import sources
from arc_suite.robots.spec import SpecError
from arc_suite.robots.spec_files import body_from_json, body_to_json

TESTS = pathlib.Path(__file__).parents[1]
FOLDER = TESTS / "fixtures" / "robots"
GO2, A1, HEXAPOD = (FOLDER / name for name in ("go2_like.xml", "a1_like.urdf", "hexapod.urdf"))
THREE = pytest.mark.parametrize("path", [GO2, A1, HEXAPOD], ids=lambda path: path.stem)

# A robot whose hips turn about two axes in one body, with an arm, springs, a mesh, and masses of geoms.
ODD = """
<mujoco model="Odd Robot!">
  <compiler angle="degree"/>
  <asset><mesh name="hull" file="hull.stl" scale="0.1 0.2 0.1"/></asset>
  <default>
    <joint armature="0.01" damping="0.3" range="-80 80" limited="true"/>
    <position kp="40" kv="1.5" forcerange="-20 20"/>
  </default>
  <worldbody>
    <geom type="plane" size="0 0 1"/>
    <body name="table" pos="3 0 0"><geom size="0.2"/></body>
    <body name="base" pos="0.3 0.1 0.5" euler="0 0 30">
      <geom type="mesh" mesh="hull" pos="0.01 0 0.02" euler="10 20 30" density="2000"/>
      <geom type="box" size="0.2 0.1 0.02" contype="0" conaffinity="0" mass="2"/>
      {legs}
      <body name="arm" pos="0.2 0 0.1"><joint name="Arm joint" type="hinge" axis="0 1 0" stiffness="3" springref="20"/>
        <geom type="capsule" fromto="0 0 0 0.1 0 0.1" size="0.02"/>
        <body name="grip" pos="0.1 0 0.1"><joint name="grip" type="slide" axis="1 0 0" range="-0.01 0.02"/>
          <geom size="0.01" mass="0.05"/></body></body>
    </body>
  </worldbody>
  <actuator>{motors}<motor joint="Arm joint" gear="5" ctrlrange="-1 1" ctrllimited="true"/></actuator>
</mujoco>"""
LEG = """
<body name="{name} thigh" pos="{x} {y} 0" euler="0 {bend} 0">
  <joint name="{name} roll" axis="1 0 0" frictionloss="0.2"/><joint name="{name} pitch" axis="0 1 0" ref="10"/>
  <geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.02" margin="0.001"/>
  <body pos="0 0 -0.2" euler="0 {back} 0"><joint name="{name} knee" axis="0 1 0"/>
    <geom type="capsule" fromto="0 0 0 0 0 -0.2" size="0.015"/><geom name="{name} tip" size="0.03" pos="0 0 -0.2"/>
  </body>
</body>"""
PLACES = {"FL": (0.2, 0.1), "FR": (0.2, -0.1), "HL": (-0.2, 0.1), "HR": (-0.2, -0.1)}
DOOR = '<body name="door" pos="3 0 1"><joint name="door" axis="0 0 1"/><geom type="box" size="0.4 0.02 1"/></body>'


def reference():
    """The program that compares a file and its import, as a module."""
    spec = importlib.util.spec_from_file_location("reference", TESTS / "robots_of_others" / "reference.py")
    module = sys.modules.setdefault("reference", importlib.util.module_from_spec(spec))
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def odd(tmp_path):
    """Write the odd robot with its mesh, motors in another order than joints, and return its path."""
    points = np.array([(-1, -1, -1), (1.2, -1, -1), (0, 1, -1), (0.1, 0, 0.5)], np.float32)
    faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
    rows = [struct.pack("<12fH", 0, 0, 0, *points[list(face)].ravel(), 0) for face in faces]
    (tmp_path / "hull.stl").write_bytes(bytes(80) + struct.pack("<I", len(faces)) + b"".join(rows))
    legs = [LEG.format(name=name, x=x, y=y, bend=35, back=-70) for name, (x, y) in PLACES.items()]
    motors = [f'<position joint="{name} {joint}"/>' for joint in ("knee", "pitch", "roll") for name in PLACES]
    path = tmp_path / "odd.xml"
    path.write_text(ODD.format(legs="".join(legs), motors="".join(motors)))
    return path


def model(body):
    return mujoco.MjModel.from_xml_string(body.source)


@THREE
def test_the_physics_are_the_files_to_the_last_bit(path):
    assert reference().same_bits(path, import_robot(path).body) == 200


def test_they_are_so_with_meshes_springs_and_masses_of_geoms(odd):
    body = import_robot(odd).body
    assert reference().same_bits(odd, body) == 200
    assert model(body).body_mass.sum() == pytest.approx(mujoco.MjModel.from_xml_path(str(odd)).body_subtreemass[2])


@THREE
def test_a_file_of_the_body_gives_the_same_body(path):
    body = import_robot(path).body
    assert body_from_json(body_to_json(body)) == body
    assert sources.check(body) is body


@THREE
def test_parts_and_joints_have_the_names_and_places_of_the_sketch(path):
    body = import_robot(path).body
    found = model(body)
    data = mujoco.MjData(found)
    mujoco.mj_resetDataKeyframe(found, data, 0)
    mujoco.mj_kinematics(found, data)
    assert list(data.qpos[:7]) == [0, 0, body.torso.standing_height, 1, 0, 0, 0]
    origin = data.body("torso").xpos
    for leg in body.legs:
        for link, point in zip(leg.links, leg.points[:-1], strict=True):
            joint = data.joint(leg.full_name(link.joint))
            assert point == pytest.approx(joint.xanchor - origin, abs=2e-4)
            assert link.joint.axis == pytest.approx(joint.xaxis)
            assert found.body(leg.full_name(link)).id >= 0
        assert leg.foot_position == pytest.approx(data.body(leg.full_name(leg.foot)).xpos - origin)
        assert data.site(leg.full_name(leg.foot)).xpos[2] == pytest.approx(leg.foot.radius, abs=0.02)
        assert found.site(leg.full_name(leg.foot)).size[0] == leg.foot.radius
    assert found.joint("root").type == mujoco.mjtJoint.mjJNT_FREE
    collides = found.geom_group != 2  # others are only shown
    assert (found.geom_contype == collides).all() and (found.geom_conaffinity == 0).all()
    assert found.nu == found.nsensor == found.ncam == found.nlight == found.ntendon == found.neq == 0


@THREE
def test_legs_are_named_from_front_to_rear_and_all_stand(path):
    body = import_robot(path).body
    feet = {leg.name: leg.foot_position for leg in body.legs}
    for side, sign in (("l", 1), ("r", -1)):
        own = [feet[f"{side}{rank + 1}"] for rank in range(len(feet) // 2)]
        assert own == sorted(own, reverse=True) and all(sign * foot[1] > 0 for foot in own)
    soles = np.array([leg.foot_position for leg in body.legs])
    assert np.ptp(soles[:, 2]) < 0.05 * body.torso.standing_height
    assert stability_margin((0, 0), soles) > 0.02 * body.torso.standing_height


def test_ranges_count_from_the_standing_pose():
    knee = import_robot(GO2).body.legs[0].joints[2]
    assert knee.range_deg == pytest.approx(np.degrees((-2.7227 + 1.8, -0.83776 + 1.8)))
    assert knee.alias == "FL_calf_joint" and (knee.armature, knee.damping) == (0.032, 0.2)


def test_parts_of_an_odd_robot_have_names(odd):
    body, notes = import_robot(odd)
    assert body.name == "odd_robot"
    assert [leg.name for leg in body.legs] == ["l1", "r1", "l2", "r2"]
    found = model(body)
    assert found.joint("l1_joint1").bodyid == found.joint("l1_joint2").bodyid == found.body("l1_link2").id
    assert found.body("l1_link1").mass == 0 and found.body("l1_link1").parentid == found.body("l1_link2").id
    assert [joint.name for joint in body.held] == ["arm_joint"]
    assert found.joint("arm_joint").type == mujoco.mjtJoint.mjJNT_HINGE
    assert "held: 1 joints outside of the legs stay in the standing pose (Arm joint)" in notes
    assert "passive: 1 joints without a motor keep their springs and damping (grip)" in notes
    assert "left out: 1 other bodies in the world" in notes


def test_the_order_of_joints_is_that_of_the_files_motors(odd):
    body, notes = import_robot(odd)
    assert body.file_joints[:5] == ("FL knee", "FR knee", "HL knee", "HR knee", "FL pitch")
    assert {joint.alias for leg in body.legs for joint in leg.joints} == set(body.file_joints)
    assert "joint map: places of the file in an action: [2, 5, 8, 11, 1, 4, 7, 10, 0, 3, 6, 9]" in notes
    assert import_robot(A1).body.file_joints[:3] == ("FR_hip_joint", "FR_thigh_joint", "FR_calf_joint")


def test_gains_and_limits_are_those_of_position_actuators(odd):
    body, notes = import_robot(odd)
    servo = body.legs[0].joints[0].servo
    assert (servo.stiffness, servo.damping, servo.limit) == (40.0, 1.5, 20.0)
    assert body.held[0].servo.limit == 5.0
    assert "limits: 20 N m of 12 motors, from forcerange" in notes
    assert "gains: all servos have those of the file's position actuators" in notes


def test_gains_that_the_file_does_not_have_are_sized():
    knee = import_robot(GO2).body.legs[0].joints[2]
    assert knee.servo.limit == 45.43
    assert 0.0 < knee.servo.stiffness <= 10.0 * knee.servo.limit
    body, notes = import_robot(A1)
    assert "limits: 1000 N m of 12 motors is a placeholder, far above their load" in notes
    stiffnesses = [joint.servo.stiffness for joint in body.joints]
    (note,) = [note for note in notes if note.startswith("gains: ")]
    span = f"{min(stiffnesses):.4g} to {max(stiffnesses):.4g} N m/rad"
    assert note.startswith(f"gains: none in the file: sized stiffness {span}, sized damping ")


def test_gains_that_the_file_does_not_have_can_be_chosen(odd):
    body, notes = import_robot(A1, stiffness=60.0, damping=2.0)
    assert {(joint.servo.stiffness, joint.servo.damping) for joint in body.joints} == {(60.0, 2.0)}
    (note,) = [note for note in notes if note.startswith("gains: ")]
    assert note == "gains: none in the file: chosen stiffness 60 N m/rad, chosen damping 2 N m s/rad"
    sized = import_robot(A1).body.joints[0].servo
    damped = import_robot(A1, damping=2.0).body.joints[0].servo
    assert (damped.stiffness, damped.damping) == (sized.stiffness, 2.0)
    kept = import_robot(odd, stiffness=60.0, damping=2.0).body.legs[0].joints[0].servo
    assert (kept.stiffness, kept.damping) == (40.0, 1.5)
    with pytest.raises(SpecError, match="stiffness: expected a number from"):
        import_robot(A1, stiffness=float("nan"))


def test_a_keyframe_that_is_named_is_the_standing_pose(tmp_path):
    path = tmp_path / "go2.xml"
    keys = '<key name="low" qpos="0 0 0.2 1 0 0 0 0 1.2 -2.4 0 1.2 -2.4 0 1.2 -2.4 0 1.2 -2.4"/></keyframe>'
    path.write_text(GO2.read_text().replace("</keyframe>", keys))
    high, low = import_robot(path), import_robot(path, home="low")
    assert low.body.torso.standing_height < 0.8 * high.body.torso.standing_height
    assert any(note.startswith("standing pose: keyframe low, torso 0.1") for note in low.notes)
    with pytest.raises(
        SpecError, match=r"go2\.xml: unknown keyframe 'lo'; did you mean 'low'\? \(there are: lying, home, low\)$"
    ):
        import_robot(path, home="lo")


POSES = pytest.mark.parametrize(
    ("path", "home"),
    [(GO2, "*_thigh_joint=0.7, *_calf_joint=-1.5, F?_thigh_joint=0.8"), (A1, "*_thigh*=0.7,*_calf*=-1.5,F*thigh*=0.8")],
    ids=["mjcf", "urdf"],
)


@POSES
def test_angles_that_are_given_are_the_standing_pose(path, home):
    body, notes = import_robot(path, home=home)
    home_angles = source.angles_at_home(body)
    for leg in body.legs:
        thigh = 0.8 if leg.name in ("l1", "r1") else 0.7
        assert [home_angles[leg.full_name(joint)] for joint in leg.joints] == pytest.approx([0.0, thigh, -1.5])
    assert any(note.startswith("standing pose: angles of --home, torso 0.") for note in notes)


def test_joints_without_an_angle_are_at_zero_or_as_near_as_their_range():
    home_angles = source.angles_at_home(import_robot(GO2, home="*_thigh_joint=0.8").body)
    assert home_angles["l1_joint1"] == 0.0 and home_angles["l1_joint3"] == pytest.approx(-0.83776)


@pytest.mark.parametrize(
    ("home", "line"),
    [
        ("FL_claf_joint=-1", r"home: unknown joint 'FL_claf_joint'; did you mean 'FL_calf_joint'\?"),
        ("*_knee=-1", r"home: unknown joint '\*_knee'"),
        ("*_calf_joint=0", r"home: joint 'FL_calf_joint': expected -2.723 to -0.8378 rad, got 0$"),
        ("*_calf_joint=-80", r"home: joint .* got -80; angles are in rad, not in degrees$"),
        ("*_calf_joint=nan", r"home: joint 'FL_calf_joint': expected .* got nan$"),
        ("FL_calf_joint=-1,FR_calf_joint", r"home: expected joint=angle in rad, got 'FR_calf_joint'$"),
    ],
)
def test_angles_that_are_wrong_are_named(home, line):
    with pytest.raises(SpecError, match=rf"^\S*go2_like\.xml: {line}"):
        import_robot(GO2, home=home)


def test_feet_can_be_named_by_geom_or_body():
    assert import_robot(GO2, feet=["FL", "FR", "RL", "RR"]).body == import_robot(GO2).body
    assert import_robot(GO2, feet=["FL_calf", "FR_calf", "RL_calf", "RR_calf"]).body == import_robot(GO2).body
    with pytest.raises(SpecError, match=r"go2_like\.xml: unknown foot 'FL_claf'; did you mean 'FL_calf'\?"):
        import_robot(GO2, feet=["FL_claf"])


def test_a_text_is_the_name_of_a_foot():
    with pytest.raises(SpecError, match=r"go2_like\.xml: unknown foot 'FL_claf'; did you mean 'FL_calf'\?"):
        import_robot(GO2, feet="FL_claf")


def test_heel_and_toe_of_a_leg_are_one_foot(tmp_path):
    text = GO2.read_text()
    names = []
    for leg in ("FL", "FR", "RL", "RR"):
        foot = f'<geom name="{leg}" class="foot"'
        assert foot in text
        text = text.replace(foot, f'<geom name="{leg}_heel" class="foot" pos="-0.05 0 -0.213"/>{foot}')
        names += [leg, f"{leg}_heel"]
    path = tmp_path / "heels.xml"
    path.write_text(text)
    both, reverse, toes = (
        [leg.foot_position for leg in import_robot(path, feet=feet).body.legs]
        for feet in (names, names[::-1], names[::2])
    )
    assert both == reverse != toes


def test_a_link_that_is_fixed_to_another_one_means_that_one(tmp_path):
    feet = ["FR", "FL", "RR", "RL"]
    links = [
        f'<link name="{leg}_toe"/><joint name="{leg}_toe_fixed" type="fixed"><parent link="{leg}_calf"/>'
        f'<child link="{leg}_toe"/></joint>'
        for leg in feet
    ]
    path = tmp_path / "a1.urdf"
    path.write_text(A1.read_text().replace("</robot>", "".join(links) + "</robot>"))
    body = import_robot(path, feet=[f"{leg}_toe" for leg in feet]).body
    assert body == import_robot(path, feet=[f"{leg}_calf" for leg in feet]).body
    with pytest.raises(SpecError, match="unknown foot 'FR_tow'"):
        import_robot(path, feet=["FR_tow"])


def test_two_feet_of_four_do_not_stand():
    with pytest.raises(
        SpecError, match=r"no standing pose \(keyframe home: the center of mass is -0.194 m inside of the feet"
    ):
        import_robot(GO2, feet=["FL", "FR"])


def test_a_urdf_whose_y_axis_points_up_is_turned(tmp_path):
    path = tmp_path / "up.urdf"
    turned = '<link name="first"/><joint name="turn" type="fixed"><origin rpy="-1.5707963267948966 0 0"/>'
    turned += '<parent link="first"/><child link="base"/></joint></robot>'
    path.write_text(A1.read_text().replace("</robot>", turned))
    body, notes = import_robot(path)
    assert "turned: the file's y axis points up, the torso's frame has z there" in notes
    assert body.torso.standing_height == pytest.approx(import_robot(A1).body.torso.standing_height, rel=0.02)
    assert reference().same_bits(path, body) == 200


@pytest.mark.parametrize(("door", "angle"), [("", ""), (DOOR, "0.5 ")], ids=["alone", "beside a door"])
def test_keyframes_of_a_fixed_torso_are_standing_poses(door, angle, tmp_path):
    text = GO2.read_text().replace("<freejoint/>", "").replace("<worldbody>", f"<worldbody>{door}")
    text = re.sub(r'qpos="\S+ \S+ \S+ 1 0 0 0 ', f'qpos="{angle}', text)
    path = tmp_path / "fixed.xml"
    path.write_text(text.replace("<keyframe>", '<keyframe><key name="zero"/>'))
    for home in (None, "home"):
        body, notes = import_robot(path, home=home)
        assert "standing pose: keyframe home, torso 0.288 m above the floor" in notes
        assert list(model(body).key_qpos[0]) == list(model(import_robot(GO2).body).key_qpos[0])


@pytest.mark.parametrize(
    ("given", "name"), [("queen", "queen_imported"), ("Über-Bot 3000", "ber_bot_3000"), ("!", "a")]
)
def test_names_are_cleaned_and_no_robots(given, name, tmp_path):
    path = tmp_path / "a.xml"
    path.write_text(GO2.read_text().replace("quadruped 15 kg", given))
    assert import_robot(path).body.name == name


def test_paths_are_bodies_everywhere_and_follow_the_file(tmp_path):
    path = tmp_path / "robot.xml"
    path.write_text(GO2.read_text())
    body = registry.body_of(str(path))
    assert body == import_robot(path).body
    assert registry.body_of(path) is body
    path.write_text(GO2.read_text().replace("quadruped 15 kg", "other"))
    assert registry.body_of(path).name == "other"
    with pytest.raises(OSError, match=r"^cannot read .*none\.urdf: no such file or directory$"):
        registry.body_of(str(tmp_path / "none.urdf"))


def test_a_link_in_the_file_system_has_its_own_name_and_neighbors(tmp_path, monkeypatch):
    box, mesh = '<geom type="box" size="0.19 0.0468 0.057"/>', '<geom type="mesh" mesh="shell"/>'
    text = GO2.read_text().replace('<mujoco model="quadruped 15 kg">', "<mujoco>").replace(box, box + mesh)
    for folder, radius in (("first", 0.05), ("second", 0.07)):
        (tmp_path / folder).mkdir()
        write_ball(tmp_path / folder / "shell.stl", radius)
    first, second = tmp_path / "first" / "one.xml", tmp_path / "second" / "two.xml"
    first.write_text(text.replace("<asset>", '<asset><mesh name="shell" file="shell.stl"/>'))
    second.symlink_to(first)
    for path, name in ((first, "one"), (second, "two")):
        body = registry.body_of(path)
        assert body == import_robot(path).body and body.name == name
    assert registry.body_of(first).source != registry.body_of(second).source
    monkeypatch.chdir(first.parent)
    assert registry.body_of("one.xml") is registry.body_of(first)


def test_all_files_that_a_robot_is_made_of_are_followed(tmp_path):
    """A file that is included, one that is included there, a mesh, one that was missing, and the mesh of a URDF."""
    main, include, deeper, mesh, late = (
        tmp_path / name for name in ("robot.xml", "part.xml", "deeper.xml", "shell.stl", "late.stl")
    )
    text = GO2.read_text()
    trunk = '<geom type="box" size="0.19 0.0468 0.057"/>'
    assert trunk in text
    shapes = '<geom type="mesh" mesh="shell" pos="0 0 0.1"/><geom type="mesh" mesh="late" pos="0 0 0.1"/>'
    text = text.replace(trunk, trunk + shapes)
    main.write_text(text.replace("<asset>", '<include file="part.xml"/><asset>', 1))
    include.write_text('<mujoco><include file="deeper.xml"/></mujoco>')
    deeper.write_text(
        '<mujoco><asset><mesh name="shell" file="shell.stl"/><mesh name="late" file="late.stl"/></asset></mujoco>'
    )
    write_ball(mesh, 0.05)
    first = registry.body_of(main)
    assert registry.body_of(main) is first
    write_ball(mesh, 0.06)
    with_mesh = registry.body_of(main)
    assert with_mesh != first
    write_ball(late, 0.05)
    with_late_mesh = registry.body_of(main)
    assert with_late_mesh != with_mesh
    deeper.write_text(deeper.read_text().replace('file="late.stl"', 'file="late.stl" scale="2 2 2"'))
    with_scale = registry.body_of(main)
    assert with_scale != with_late_mesh
    include.write_text('<mujoco><include file="deeper.xml"/><option timestep="0.001"/></mujoco>')
    assert registry.body_of(main) != with_scale
    assert registry.body_of(main) is registry.body_of(str(main))


def test_the_meshes_of_a_urdf_are_followed(tmp_path):
    robot, mesh = tmp_path / "urdf" / "robot.urdf", tmp_path / "meshes" / "shell.stl"
    robot.parent.mkdir(), mesh.parent.mkdir()
    box = '<box size="0.267 0.194 0.114"/>'
    text = A1.read_text()
    assert box in text
    robot.write_text(text.replace(box, '<mesh filename="package://a1/meshes/shell.stl"/>'))
    without = registry.body_of(robot)
    write_ball(mesh, 0.05)
    first = registry.body_of(robot)
    assert first != without
    write_ball(mesh, 0.06)
    assert registry.body_of(robot) != first


def write_ball(path, radius):
    """Write a mesh of four points."""
    points = np.array([(-1, -1, -1), (1.2, -1, -1), (0, 1, -1), (0.1, 0, 0.5)], np.float32) * radius
    faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
    rows = [struct.pack("<12fH", 0, 0, 0, *points[list(face)].ravel(), 0) for face in faces]
    path.write_bytes(bytes(80) + struct.pack("<I", len(faces)) + b"".join(rows))


def test_a_mesh_that_touches_by_a_contact_pair_alone_is_a_collider(tmp_path):
    text = GO2.read_text()
    text = text.replace("<asset>", '<asset><mesh name="tip" vertex="0 0 0 0.03 0 0 0 0.03 0 0 0 0.03"/>', 1)
    shape = '<geom name="tip" type="mesh" mesh="tip" contype="0" conaffinity="0" mass="0"/>'
    calf = '<body name="FL_calf" pos="0 0 -0.213">'
    text = text.replace("<worldbody>", '<worldbody><geom name="plate" type="plane" size="0 0 1"/>', 1)
    text = text.replace(calf, calf + shape, 1)
    text = text.replace("</worldbody>", '</worldbody><contact><pair geom1="tip" geom2="plate"/></contact>', 1)
    path = tmp_path / "tipped.xml"
    path.write_text(text)
    model = mujoco.MjModel.from_xml_string(import_robot(path).body.source)
    meshes = [geom for geom in range(model.ngeom) if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH]
    assert [model.body(model.geom_bodyid[geom]).name for geom in meshes] == ["l1_link3"]
    assert (model.geom_contype[meshes], model.geom_conaffinity[meshes]) == (1, 0)
