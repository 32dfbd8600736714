"""Broken files of robots come in with a note, or are refused in one line that names the place."""

import pathlib

import pytest

from arc_suite.importing import import_robot
from arc_suite.robots.spec import SpecError

FOLDER = pathlib.Path(__file__).parents[1] / "fixtures" / "robots"
GO2, A1, HEXAPOD = "go2_like.xml", "a1_like.urdf", "hexapod.urdf"

# Parts of these files, and of notes.
INERTIA = '<inertia ixx="0.0158533" ixy="-3.66e-05" ixz="-6.11e-05" iyy="0.0377999" iyz="-2.75e-05" izz="0.0456542"/>'
BOX = '<box size="0.267 0.194 0.114"/>'
LIMIT = '<limit effort="1000" lower="-0.802851" upper="0.802851" velocity="21"/>'
TURN, CHILD = 'rpy="0 0 3.141592653589793"', '<child link="FR_calf"/>'
KNEE = '<joint name="FL_calf_joint" class="knee"/>'
MOTOR = '<motor name="FL_calf" class="knee" joint="FL_calf_joint"/>'
MESH = '<asset><mesh name="shell" file="shell.stl"/>'
TENDON = '<tendon><fixed><joint joint="FL_calf_joint" coef="1"/></fixed></tendon><actuator>'
EQUALITY = '<equality><joint joint1="FL_hip_joint"/></equality><actuator>'
SCENE, SCENE_JOINT = '<link name="world">{}</link>', '<joint name="to_world" type="{}"><parent link="world"/>{}</joint>'
CHILD_BASE, TABLE = '<child link="base"/>', '<collision><geometry><box size="9 9 1"/></geometry></collision>'
PAIR = '<contact><pair geom1="floor" geom2="FL"/></contact></mujoco>'
EXCLUDE = '<contact><exclude body1="stairs" body2="FL_calf"/></contact></mujoco>'
DISTANCE = '<sensor><distance geom1="floor" geom2="FL"/></sensor></mujoco>'
WELD = '<equality><weld body1="base" body2="pole"/></equality></mujoco>'
LIGHT = '<worldbody><light mode="targetbody" target="stairs"/>'
UNREAD, REPAIRED = "1 colliders that cannot be read, such as of trunk", "inertias of 1 links that no solid has"


def inertia(xx, yy, zz, xy=0.0):
    return f'<inertia ixx="{xx}" ixy="{xy}" ixz="0" iyy="{yy}" iyz="0" izz="{zz}"/>'


def in_scene(kind, shape="", more=""):
    """The end of a URDF with a link `world` that carries its base."""
    return SCENE.format(shape) + SCENE_JOINT.format(kind, CHILD_BASE + more) + "</robot>"


def broken(folder, file, old, new):
    """Write a file with a replacement, and return its path."""
    text = (FOLDER / file).read_text()
    assert old is None or old in text
    path = folder / file
    path.write_text(new if old is None else text.replace(old, new) if old else text)
    return path


# What comes in, by what is wrong: a file, a text in it and its replacement, and part of a note.
CURED = {
    "visual meshes are missing": (A1, "", "", "looks: pictures show the colliders"),
    "a collision mesh is missing": (A1, BOX, '<mesh filename="package://a/b.stl"/>', UNREAD),
    "a collision mesh is Collada": (A1, BOX, '<mesh filename="b.dae"/>', UNREAD),
    "a collision mesh has no name": (A1, BOX, "<mesh/>", UNREAD),
    "spheres have no radius": (A1, '<sphere radius="0.02"/>', "<sphere/>", "4 colliders that cannot be read"),
    "an inertia is singular": (A1, INERTIA, inertia(0.01, 0.01, 0.02, 0.01), REPAIRED),
    "an inertia is zero": (A1, INERTIA, inertia(0, 0, 0), REPAIRED),
    "an inertia is negative": (A1, INERTIA, inertia(-0.01, 0.01, 0.01), REPAIRED),
    "an inertia breaks the triangle rule": (A1, INERTIA, inertia(0.01, 0.01, 1.0), REPAIRED),
    "moving links have no mass": (A1, '<mass value="0.696"/>', '<mass value="0"/>', "legs: 4"),
    "efforts are placeholders": (A1, "", "", "1000 N m of 12 motors is a placeholder"),
    "joints have no limits": (A1, LIMIT, "", "none in the file for 4 motors, sized"),
    "joints are continuous": (HEXAPOD, "revolute", "continuous", "2.8 N m of 18 motors"),
    "a mesh of looks is missing": (GO2, "<asset>", MESH, "legs: 4"),
    "a texture is missing": (GO2, 'builtin="checker" width="64" height="64"', 'file="grid.png"', "legs: 4"),
    "a tendon": (GO2, "<actuator>", TENDON, "left out: 1 tendons"),
    "an equality": (GO2, "<actuator>", EQUALITY, "left out: 1 equality constraints"),
    "a muscle": (GO2, MOTOR, '<muscle name="FL_calf" joint="FL_calf_joint"/>', "none in the file for 1 motors, sized"),
    "the base is fixed to a world": (A1, "</robot>", in_scene("fixed"), "the torso base is fixed to the world"),
    "the base is fixed to a table": (A1, "</robot>", in_scene("fixed", TABLE), "the torso base is fixed to the world"),
    "a world and a post": (
        A1,
        "</robot>",
        '<link name="post"/><joint name="p" type="fixed"><parent link="world"/><child link="post"/></joint>'
        + in_scene("fixed"),
        "the torso base is fixed to the world",
    ),
    "the base stands high in the world": (
        A1,
        "</robot>",
        in_scene("fixed", more='<origin xyz="1 2 3" rpy="0 0 1"/>'),
        "torso 0.269 m above the floor",
    ),
    "the base floats in a world": (A1, "</robot>", in_scene("floating"), "legs: 4"),
    "the base is named world": (A1, '"base"', '"world"', "the torso trunk is fixed to the world"),
    "the trunk is named world": (A1, '"trunk"', '"world"', "legs: 4"),
    "a calf is named world": (A1, '"FR_calf"', '"world"', "legs: 4"),
    "no link has a mass": (A1, "inertial", "nothing", "masses: none in the file; colliders get 1000 kg/m^3"),
    "no link has a mass, and some have no shape": (HEXAPOD, "inertial", "nothing", "6 links that move and weigh noth"),
    "a mass of nearly nothing": (
        HEXAPOD,
        'mass value="0.08"',
        'mass value="1e-15"',
        "6 links that move and weigh nothing",
    ),
    "a mass of a millionth of a gram": (
        HEXAPOD,
        'mass value="0.08"',
        'mass value="1e-9"',
        "inertias of 6 links, too large",
    ),
    "a pair with a floor that is not there": (
        GO2,
        "</mujoco>",
        PAIR,
        "1 references to parts that are not in the file, such as floor",
    ),
    "an excluded contact with a scene": (GO2, "</mujoco>", EXCLUDE, "1 references to parts that are not in the file"),
    "a sensor of a scene": (GO2, "</mujoco>", DISTANCE, "1 references to parts that are not in the file"),
    "a weld to a scene": (GO2, "</mujoco>", WELD, "1 references to parts that are not in the file"),
    "a light on a part of a scene": (GO2, "<worldbody>", LIGHT, "1 references to parts that are not in the file"),
    "zeros at the end": (GO2, "</mujoco>", "</mujoco>\0\0\n", "legs: 4"),
    "a zero at the end of a URDF": (A1, "</robot>", "</robot>\0", "legs: 4"),
    "a home that hangs in the air": (GO2, "0 0.9 -1.8 0 0.9", "0 0.1 -0.9 0 2.9", "search for bent knees"),
}

# What is refused: a file, a text in it and its replacement, None for the whole text, and part of the line.
REFUSED = {
    "shapes without a kind": (A1, BOX, "", "geometry specification not found"),
    "a box of two lengths": (A1, BOX, '<box size="0.2 0.2"/>', "'size' does not have enough data"),
    "a box of no size": (A1, BOX, '<box size="0 0 0"/>', "size 0 must be positive"),
    "an inertia that is no number": (A1, INERTIA, inertia("nan", 1, 1), "link 'trunk': inertia ixx: expected 1 number"),
    "no inertia": (A1, INERTIA, "", "link 'trunk': inertial: expected a mass and an inertia"),
    "angles of four numbers": (A1, TURN, 'rpy="0 0 3.1 0"', "joint 'RR_hip_joint': origin rpy: expected 3 numbers"),
    "angles of words": (A1, TURN, 'rpy="0 0 pi"', "joint 'RR_hip_joint': origin rpy: expected 3 numbers"),
    "a place of two numbers": (A1, 'xyz="0 0 -0.2"', 'xyz="0 0"', "joint 'FR_calf_joint': origin xyz: expected 3"),
    "an axis of no length": (A1, '<axis xyz="1 0 0"/>', '<axis xyz="0 0 0"/>', "'FR_hip_joint'"),
    "joints of an unknown type": (A1, "revolute", "wheel", "joint 'FR_hip_joint': expected a type out of revolute"),
    "a missing link": (A1, CHILD, '<child link="calf"/>', "joint 'FR_calf_joint': its child is no link"),
    "no link at a joint": (A1, CHILD, "", "joint 'FR_calf_joint': its child is no link"),
    "a link with two parents": (A1, CHILD, '<child link="FL_calf"/>', "got 2: base, FR_calf"),
    "a loop": (A1, 'parent link="trunk"/><child link="FR_hip', 'parent link="FR_foot"/><child link="FR_hip', ""),
    "two bases": (A1, "</robot>", '<link name="other"/></robot>', "got 2: base, other"),
    "two links of a name": (A1, '<link name="FL_hip">', '<link name="FR_hip">', "'FR_hip': the name occurs twice"),
    "a limit that is no number": (
        A1,
        'effort="1000"',
        'effort="strong"',
        "joint 'FR_hip_joint': limit effort: expected 1 number, got 'strong'",
    ),
    "slides in legs": (HEXAPOD, "revolute", "prismatic", "slide joint; expected hinges"),
    "xacro": (A1, "</robot>", '<l xmlns:x="http://ros.org/wiki/xacro"><x:leg/></l></robot>', "with xacro first"),
    "no links": (A1, None, "<robot/>", "without a link"),
    "no joints": (A1, None, '<robot><link name="stone"/></robot>', "without a joint"),
    "an include that is missing": (GO2, "<asset>", '<include file="more.xml"/><asset>', "'more.xml'"),
    "an unknown element": (GO2, "<freejoint/>", "<wheel/>", "Element 'wheel'"),
    "an unknown class": (GO2, 'class="knee"/>', 'class="ankle"/>', "'ankle'"),
    "a ball joint in a leg": (GO2, KNEE, '<joint name="ball" type="ball" limited="false"/>', ""),
    "a slide in a leg": (GO2, KNEE, KNEE.replace("/>", ' type="slide"/>'), "'FL_calf_joint' of a leg is a slide"),
    "a motor without a joint": (GO2, MOTOR, '<motor joint="none"/>', "'none'"),
    "a body named world": (
        GO2,
        'body name="base"',
        'body name="world"',
        "a body has the name 'world', which is that of the",
    ),
    "a rail in the world": (
        A1,
        "</robot>",
        in_scene("prismatic"),
        "the torso 'base' moves by the joint 'to_world' alone",
    ),
    "a zero within": (GO2, "<asset>", "\0<asset>", "expected XML"),
    "masses of 1e-16": (
        GO2,
        'mass="0.2414" diaginertia="0.00149 0.00146 5.3e-05"',
        'mass="1e-16" diaginertia="1 1 1"',
        "body 'FL_calf' moves, and has no mass or no inertia",
    ),
    "a link without mass": (GO2, 'mass="0.2414" diaginertia="0.00149 0.00146 5.3e-05"', 'mass="0"', "'FL_calf'"),
    "a plate thinner than none": (GO2, 'diaginertia="0.00149 0.00146 5.3e-05"', 'diaginertia="1 0.1 0.1"', "'FL_calf'"),
    "no legs": (GO2, None, '<mujoco><worldbody><body><freejoint/><geom size="1"/></body></worldbody></mujoco>', "legs"),
    "nothing": (GO2, None, "<mujoco/>", "legs"),
    "a place that is no number": (GO2, 'pos="0.1934 0.0465 0"', 'pos="0.1934 left 0"', "Element 'body'"),
    "gravity that pulls up": (
        GO2,
        "<option ",
        '<option gravity="0 0 9.81" ',
        "gravity: expected 0 0 -9.81 or the like",
    ),
    "an impossible mass": (GO2, 'mass="0.2414"', 'mass="1e300"', "expected a robot of 1e-06 to 1e+09 kg, got"),
    "a timestep of zero": (GO2, "<option ", '<option timestep="0" ', "timestep"),
    "no text": (GO2, None, "", "expected XML"),
    "binary": (GO2, None, "\0\1\2", "expected XML"),
    "half a file": (GO2, "</worldbody>", "<", "expected XML"),
    "another language": (GO2, None, "<sdf/>", "expected MJCF (mujoco) or URDF (robot), got an element 'sdf'"),
    "entities": (GO2, "<mujoco ", '<!DOCTYPE m [<!ENTITY a "b">]><mujoco ', "document type and entities"),
    "a deep file": (GO2, None, f"<mujoco>{'<worldbody>' * 9999}{'</worldbody>' * 9999}</mujoco>", "too deep"),
}


@pytest.mark.parametrize("case", CURED)
def test_it_comes_in_with_a_note(case, tmp_path):
    *edit, note = CURED[case]
    body, notes = import_robot(broken(tmp_path, *edit))
    assert len(body.legs) in (4, 6) and 0.1 < body.torso.standing_height < 0.4
    assert any(note in line for line in notes), notes


@pytest.mark.parametrize("case", REFUSED)
def test_it_is_refused_in_one_line(case, tmp_path):
    *edit, words = REFUSED[case]
    path = broken(tmp_path, *edit)
    with pytest.raises(SpecError) as caught:
        import_robot(path)
    line = str(caught.value)
    assert line.startswith(f"{path}: ") and words in line, line
    assert "\n" not in line and len(line) - len(str(path)) < 400, line


def test_a_file_that_is_not_there_is_an_error_of_the_system(tmp_path):
    with pytest.raises(OSError, match="no such file"):
        import_robot(tmp_path / "go2.xml")
    with pytest.raises(OSError, match="directory"):
        import_robot(tmp_path)
