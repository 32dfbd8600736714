"""A robot without legs is refused by what it is, in a short line; one with two legs is a biped."""

import pathlib

import pytest

from arc_suite.importing import import_robot
from arc_suite.models.soundness import flaws
from arc_suite.robots.spec import SpecError

FOLDER = pathlib.Path(__file__).parents[1] / "fixtures" / "robots"
SOLID = '<inertial><mass value="1"/><inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial>'
ROD = '<collision><origin xyz="0 0 .1"/><geometry><cylinder length=".2" radius=".02"/></geometry></collision>'
WHEEL = '<collision><origin rpy="1.5708 0 0"/><geometry><cylinder length=".04" radius=".1"/></geometry></collision>'
FREE = '<limit effort="9" velocity="9"/>'
RANGE = '<limit lower="-1" upper="1" effort="9" velocity="9"/>'


def link(name, parent=None, axis="0 1 0", place="0 0 .2", shape=ROD, kind="revolute"):
    """A link of a URDF, on a joint of its parent."""
    text = f'<link name="{name}">{SOLID}{shape}</link>'
    if parent is not None:
        limit = RANGE if kind == "revolute" else FREE
        text += f'<joint name="to_{name}" type="{kind}"><parent link="{parent}"/><child link="{name}"/>'
        text += f'<origin xyz="{place}"/><axis xyz="{axis}"/>{limit}</joint>'
    return text


def chain(name, parent, count):
    links = [link(f"{name}1", parent)]
    links += [link(f"{name}{number}", f"{name}{number - 1}") for number in range(2, count + 1)]
    return "".join(links)


CORNERS = ((0.3, 0.2), (0.3, -0.2), (-0.3, 0.2), (-0.3, -0.2))
WHEELS = "".join(
    link(f"wheel{number}", "base", "0 1 0", f"{x} {y} 0", WHEEL, "continuous") for number, (x, y) in enumerate(CORNERS)
)
ROTORS = "".join(
    link(f"rotor{number}", "base", "0 0 1", f"{x} {y} 0.1", "", "continuous") for number, (x, y) in enumerate(CORNERS)
)
FINGERS = link("left", "arm5") + link("right", "arm5")
MJCF_ARM = (
    '<mujoco><worldbody><body><joint axis="0 0 1"/><geom size=".1"/><body pos="0 0 .3"><joint axis="0 1 0"/>'
    '<geom size=".1"/><body pos="0 0 .3"><joint axis="0 1 0"/><geom size=".1"/></body></body></body></worldbody>'
    "</mujoco>"
)

KINDS = {
    "an arm": (link("base") + chain("arm", "base", 6), "an arm: one chain of 6 joints"),
    "an arm on a world": (
        link("world", shape="").replace(SOLID, "") + link("base", "world", kind="fixed") + chain("arm", "base", 4),
        "an arm: one chain of 4 joints",
    ),
    "an arm without colliders": (
        (link("base") + chain("arm", "base", 6)).replace(ROD, ""),
        "an arm: one chain of 6 joints",
    ),
    "an arm with a gripper": (
        link("base") + chain("arm", "base", 5) + FINGERS,
        "an arm: one chain of 5 joints with 2 fingers",
    ),
    "an arm in MJCF": (MJCF_ARM, "an arm: one chain of 3 joints"),
    "a pendulum": (link("base") + chain("arm", "base", 2), "one chain of 2 joints"),
    "a drone": (link("base") + ROTORS, "a drone: 4 rotors"),
    "a drone with an arm": (link("base") + ROTORS + chain("arm", "base", 3), "a drone: 4 rotors and an arm"),
    "a car": (link("base") + WHEELS, "a vehicle: 4 wheels"),
    "a car that steers": (
        link("base")
        + WHEELS.replace('<parent link="base"/><child link="wheel0"/>', '<parent link="fork"/><child link="wheel0"/>')
        + link("fork", "base", "0 0 1", shape=""),
        "a vehicle: 4 wheels",
    ),
    "a car with an arm": (link("base") + WHEELS + chain("arm", "base", 5), "a vehicle: 4 wheels and an arm"),
    "a stone": (
        '<mujoco><worldbody><body><freejoint/><geom size="1"/></body></worldbody></mujoco>',
        "a body with one joint",
    ),
}


def write(folder, text):
    path = folder / ("robot.xml" if text.startswith("<mujoco") else "robot.urdf")
    path.write_text(text if text.startswith("<mujoco") else f'<robot name="a">{text}</robot>')
    return path


@pytest.mark.parametrize("name", KINDS)
def test_it_is_refused_by_what_it_is(name, tmp_path):
    text, kind = KINDS[name]
    path = write(tmp_path, text)
    with pytest.raises(SpecError) as caught:
        import_robot(path)
    assert str(caught.value) == f"{path}: {kind}; expected a robot with two or more legs"


def test_a_robot_that_does_not_stand_is_a_short_line(tmp_path):
    path = write(tmp_path, link("base") + "".join(chain(name, "base", 3) for name in "abc"))
    with pytest.raises(SpecError) as caught:
        import_robot(path)
    line = str(caught.value).removeprefix(f"{path}: ")
    assert line.startswith("3 chains of 3 joints, and no standing pose (") and len(line) < 250


def test_a_biped_is_told_and_its_joints_lift_its_feet(tmp_path):
    """With straight legs in the standing pose."""
    legs = ""
    for side, y in (("left", 0.1), ("right", -0.1)):
        shapes = [ROD.replace("0 0 .1", f"0 0 {height}") for height in (-0.1, -0.1)]
        foot = '<collision><origin xyz=".02 0 -.22"/><geometry><box size=".2 .1 .04"/></geometry></collision>'
        legs += link(f"{side}_thigh", "base", place=f"0 {y} 0", shape=shapes[0])
        legs += link(f"{side}_shank", f"{side}_thigh", place="0 0 -.2", shape=shapes[1] + foot)
    body, notes = import_robot(write(tmp_path, link("base") + legs))
    assert notes[0] == "legs: 2 (l1, r1), 2 joints each: a biped, which no demonstrator walks"
    texts = [flaw.text for flaw in flaws(body)]
    assert "no demonstrator keeps its balance on 2 legs: 3 and more walk" in texts
    assert not any("no joint lifts a foot" in text for text in texts)
