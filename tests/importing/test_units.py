"""Files in cm, mm, inches or grams, or with y up: the import repairs them, or names the flag that does."""

import math
import pathlib
import re
import struct

import mujoco
import numpy as np
import programs
import pytest

from arc_suite.evaluation import cures
from arc_suite.importing import import_robot
from arc_suite.robots.spec import SpecError

FOLDER = pathlib.Path(__file__).parents[1] / "fixtures" / "robots"
GO2, A1, HEXAPOD = (FOLDER / name for name in ("go2_like.xml", "a1_like.urdf", "hexapod.urdf"))
LENGTHS = {".urdf": "xyz|length|radius|size", ".xml": "pos|size|fromto"}
INERTIAS = {".urdf": "i[xyz][xyz]", ".xml": "diaginertia|fullinertia"}


def multiply(text, attributes, factor):
    """Multiply the numbers of attributes, except those of axes."""

    def change(match):
        return f'{match[1]}="{" ".join(repr(float(word) * factor) for word in match[2].split())}"'

    return re.sub(rf'(?<!axis )\b({attributes})="([-\d. e]*)"', change, text)


def write(folder, source, lengths=1.0, inertias=1.0, masses=1.0):
    """Write a robot with all lengths, inertias and masses multiplied, and return its path."""
    text = multiply(source.read_text(), LENGTHS[source.suffix], lengths)
    text = multiply(text, INERTIAS[source.suffix], inertias)
    path = folder / source.name
    path.write_text(multiply(text, "mass|mass value", masses))
    return path


def unit_notes(notes):
    return [note for note in notes if note.startswith("units: ")]


@pytest.mark.parametrize(
    ("source", "factor", "inertias", "line", "scale"),
    [
        (A1, 100.0, 1e4, "units: stands 26.9 m high at 13.7 kg: lengths in cm? --scale=0.01", 0.01),
        (A1, 100.0, 1.0, "units: stands 26.9 m high at 13.7 kg: lengths in cm? --scale=0.01", 0.01),
        (GO2, 100.0, 1e4, "units: stands 28.8 m high at 15.2 kg: lengths in cm? --scale=0.01", 0.01),
        (HEXAPOD, 1.0 / 0.0254, 0.0254**-2, "units: stands 5.37 m high at 2.24 kg: lengths in inches?", 0.0254),
    ],
    ids=["URDF in cm", "URDF in cm and kg m^2", "MJCF in cm", "in inches"],
)
def test_lengths_in_other_units_are_told_and_a_flag_scales_them(source, factor, inertias, line, scale, tmp_path):
    path = write(tmp_path, source, factor, inertias)
    (note,) = unit_notes(import_robot(path).notes)
    assert note.startswith(line)
    body, notes = import_robot(path, scale=scale)
    assert unit_notes(notes) == []
    expected_body = import_robot(source).body
    assert body.torso.standing_height == pytest.approx(expected_body.torso.standing_height, rel=1e-3)
    for joint, expected_joint in zip(body.joints, expected_body.joints, strict=True):
        assert joint.servo.stiffness == pytest.approx(expected_joint.servo.stiffness, rel=0.02)


@pytest.mark.parametrize("source", [A1, GO2], ids=lambda path: path.stem)
def test_millimeters_are_one_line(source, tmp_path):
    path = write(tmp_path, source, 1000.0, 1e6)
    words = rf"{path.name}: stands 2\d\d m high at 1\d.\d kg: lengths in mm\? --scale=0.001$"
    with pytest.raises(SpecError, match=words):
        import_robot(path)
    assert import_robot(path, scale=0.001).body.torso.standing_height < 0.3


def test_masses_in_grams_are_told(tmp_path):
    path = write(tmp_path, A1, inertias=1000.0, masses=1000.0)
    assert unit_notes(import_robot(path).notes) == ["units: stands 0.269 m high at 1.37e+04 kg: masses in g?"]


def test_meshes_in_millimeters_are_repaired(tmp_path):
    points = 0.5 * np.array([(-267, -194, -114), (267, -194, 114), (-267, 194, 114), (267, 194, -114)], np.float32)
    faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
    rows = [struct.pack("<12fH", 0, 0, 0, *points[list(face)].ravel(), 0) for face in faces]
    (tmp_path / "trunk.stl").write_bytes(bytes(80) + struct.pack("<I", len(faces)) + b"".join(rows))
    path = tmp_path / "robot.urdf"
    path.write_text(A1.read_text().replace('<box size="0.267 0.194 0.114"/>', '<mesh filename="trunk.stl"/>'))
    body, notes = import_robot(path)
    assert any(note.startswith("repaired: 1 meshes are in mm, as ") for note in notes), notes
    assert body.torso.standing_height == pytest.approx(import_robot(A1).body.torso.standing_height)
    assert body.torso.solids[0].size == pytest.approx((0.1335, 0.097, 0.057), rel=1e-3)


def test_a_robot_with_y_up_is_turned_from_mjcf_too(tmp_path):
    start = '<body name="base" pos="0 0 0.445" childclass="robot">'
    first = '<body name="first"><inertial pos="0 0 0" mass="0.001" diaginertia="1e-6 1e-6 1e-6"/><freejoint/>'
    second = f'<body name="base" euler="{-math.pi / 2} 0 0" childclass="robot">'
    text = GO2.read_text().replace("<freejoint/>", "").replace(start, first + second)
    path = tmp_path / "up.xml"
    path.write_text(text.replace("</worldbody>", "</body></worldbody>"))
    body, notes = import_robot(path)
    assert "turned: the file's y axis points up, the torso's frame has z there" in notes
    feet = [[leg.foot_position for leg in each.legs] for each in (body, import_robot(GO2).body)]
    assert feet[0] == pytest.approx(np.array(feet[1]), abs=1e-6)
    assert import_robot(path, forward="x").body == body


def test_the_scale_is_a_flag_with_bounds(tmp_path):
    path = write(tmp_path, A1, 100.0, 1e4)
    assert "torso 0.269 m above the floor" in programs.passed(programs.arc_suite("import", path, "--scale=.01"))
    with pytest.raises(SpecError, match=r"a1_like\.urdf: scale: expected a number from 1e-06 to 1e\+06, got 0$"):
        import_robot(path, scale=0.0)


WEDGE = (
    '<asset><mesh name="wedge" refpos="0.2 0 0" scale="1 1 0.5"'
    ' vertex="0.2 0 0 0.3 0 0 0.2 0.1 0 0.2 0 0.1" face="0 2 1 0 1 3 1 2 3 2 0 3"/>'
)
WEDGES = (
    '<geom class="looks" type="mesh" mesh="wedge" pos="0.1 0 0"/>'
    '<geom type="mesh" mesh="wedge" mass="0" pos="0.1 0 0"/><site name="imu"'
)


@pytest.mark.parametrize("scale", [1.0, 2.0, 0.5])
def test_a_mesh_with_a_reference_point_grows_about_the_torso(scale, tmp_path):
    path = tmp_path / "wedge.xml"
    path.write_text(GO2.read_text().replace("<asset>", WEDGE).replace('<site name="imu"', WEDGES))
    model = mujoco.MjModel.from_xml_string(import_robot(path, scale=scale).body.source)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    meshes = [geom for geom in range(model.ngeom) if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH]
    assert len(meshes) == 2
    for geom in meshes:
        first = model.mesh_vertadr[model.geom_dataid[geom]]
        points = model.mesh_vert[first : first + model.mesh_vertnum[model.geom_dataid[geom]]]
        places = points @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom] - data.xpos[1]
        assert places.min(axis=0) == pytest.approx(scale * np.array((0.1, 0.0, 0.0)), abs=1e-6)
        assert places.max(axis=0) == pytest.approx(scale * np.array((0.2, 0.1, 0.05)), abs=1e-6)


MAST = (
    '<body name="mast" pos="0 0 0.06"><joint name="mast" type="slide" axis="0 0 1" range="0 0.2" margin="0.01"/>'
    '<geom type="box" size="0.02 0.02 0.05" mass="0.2"/><body name="dish"><joint name="dish" axis="0 0 1"/>'
    '<geom type="box" size="0.02 0.02 0.02" mass="0.1"/></body></body><site name="imu"'
)
DISH = '<equality><joint joint1="{}" joint2="{}" polycoef="{}"/></equality></mujoco>'


@pytest.mark.parametrize("scale", [1.0, 2.0, 0.5])
@pytest.mark.parametrize(
    ("follower", "leader", "powers"), [("dish", "mast", (0, -1, -2, -3, -4)), ("mast", "dish", (1, 1, 1, 1, 1))]
)
def test_a_slide_grows_in_keyframes_and_in_constraints(follower, leader, powers, scale, tmp_path):
    text = GO2.read_text().replace('<site name="imu"', MAST)
    text = re.sub(r'qpos="(\S+ \S+ \S+ 1 0 0 0) ', r'qpos="\1 0.1 0.3 ', text)
    motor = f'<position joint="{leader}" kp="1000"/></actuator>'
    coefficients = np.array((0.01, 0.5, 0.1, 0.2, 0.3))
    constraint = DISH.format(follower, leader, " ".join(map(str, coefficients)))
    path = tmp_path / "mast.xml"
    path.write_text(text.replace("</actuator>", motor).replace("</mujoco>", constraint))
    model = mujoco.MjModel.from_xml_string(import_robot(path, scale=scale, home="home").body.source)
    mast, dish = model.joint("mast"), model.joint("dish")
    assert mast.range == pytest.approx((0.0, 0.2 * scale)) and mast.margin == pytest.approx(0.01 * scale)
    assert model.eq_data[0][:5] == pytest.approx(coefficients * scale ** np.array(powers, float))
    home = model.key_qpos[0]
    assert home[dish.qposadr] == pytest.approx(0.3 if leader == "dish" else 0.06123)
    assert home[mast.qposadr] == pytest.approx(0.1 * scale if leader == "mast" else 0.17683 * scale)


@pytest.mark.slow
def test_a_robot_in_centimeters_walks(tmp_path):
    body = import_robot(write(tmp_path, A1, 100.0, 1e4), scale=0.01).body
    assert cures.walk(body).verdict.walks
