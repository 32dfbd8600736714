"""Joints that buzz as a robot stands get an armature, which a note tells; others keep what the file has."""

import pathlib
import re

import mujoco
import numpy as np
import programs
import pytest

from arc_suite.cli import check
from arc_suite.evaluation import cures
from arc_suite.importing import import_robot
from arc_suite.robots.spec import SpecError
from arc_suite.simulation.stillness import Stillness, calming_armature, measure_stillness

FOLDER = pathlib.Path(__file__).parents[1] / "fixtures" / "robots"
GO2, A1, HEXAPOD = (FOLDER / name for name in ("go2_like.xml", "a1_like.urdf", "hexapod.urdf"))


def scale_links(text, pattern, factor):
    """Scale masses and inertias of the links of a URDF."""

    def scale_link(link):
        return re.sub(
            r'(mass value|i[xyz][xyz])="([^"]+)"', lambda part: f'{part[1]}="{float(part[2]) * factor:g}"', link[0]
        )

    return re.sub(rf'<link name="{pattern}">.*?</link>', scale_link, text, flags=re.S)


@pytest.fixture
def light_mjcf(tmp_path):
    """A robot without armature, whose shanks weigh a tenth."""
    text = re.sub(' armature="[^"]*"', "", GO2.read_text())
    text = text.replace(
        'mass="0.2414" diaginertia="0.00149 0.00146 5.3e-05"', 'mass="0.02" diaginertia="0.00015 0.00015 5e-06"'
    )
    path = tmp_path / "light.xml"
    path.write_text(text)
    return path


@pytest.fixture
def light_urdf(tmp_path):
    path = tmp_path / "light.urdf"
    path.write_text(scale_links(A1.read_text(), r"\w\w_(calf|foot)", 0.03))
    return path


@pytest.fixture
def lightest_urdf(tmp_path):
    path = tmp_path / "lightest.urdf"
    path.write_text(scale_links(A1.read_text(), r"\w\w_(calf|foot)", 0.01))
    return path


def change_armatures(body, armature):
    """Return a body whose joints have an armature."""
    legs = []
    for leg in body.legs:
        links = tuple(link.replace(joint=link.joint.replace(armature=armature)) for link in leg.links)
        legs.append(leg.replace(links=links))
    return body.replace(legs=tuple(legs))


def armature_note(notes):
    (note,) = [note for note in notes if note.startswith("armature: ")]
    return note


@pytest.mark.parametrize(
    ("file", "problem"),
    [("light_mjcf", "they buzz at 0."), ("light_urdf", "they buzz at 0."), ("lightest_urdf", "the robot falls")],
)
def test_joints_that_buzz_get_an_armature(file, problem, request):
    path = request.getfixturevalue(file)
    body, notes = import_robot(path)
    assert f"at 12 joints, which have none in the file: without it {problem}" in armature_note(notes)
    stillness = measure_stillness(import_robot(path, armature=0.0).body)
    assert stillness.buzzes or stillness.falls
    stillness = measure_stillness(body)
    assert not stillness.buzzes and not stillness.falls and stillness.joint_speed < 0.02
    timestep = body.simulation.timestep
    model = mujoco.MjModel.from_xml_string(body.source)
    for leg in body.legs:
        for joint in leg.joints:
            assert joint.armature == pytest.approx(5.0 * joint.servo.stiffness * timestep**2)
            assert model.joint(leg.full_name(joint)).armature == joint.armature


def test_joints_that_are_still_keep_what_the_file_has():
    for path, armatures in ((A1, {0.0}), (HEXAPOD, {0.0}), (GO2, {0.0075, 0.02, 0.032})):
        body, notes = import_robot(path)
        assert not any(note.startswith("armature") for note in notes)
        assert {joint.armature for joint in body.joints} <= armatures


def test_joints_with_an_armature_in_the_file_keep_it(light_mjcf):
    text = light_mjcf.read_text().replace('<joint name="FL_hip_joint"', '<joint name="FL_hip_joint" armature="0.5"')
    light_mjcf.write_text(text)
    body, notes = import_robot(light_mjcf)
    assert "at 11 joints" in armature_note(notes)
    armatures = np.array([joint.armature for joint in body.joints])
    assert armatures[0] == 0.5 and armatures[1:].max() < 0.02


def test_an_armature_can_be_chosen(light_mjcf):
    body, notes = import_robot(light_mjcf, armature=0.03)
    assert {joint.armature for joint in body.joints} == {0.03}
    assert armature_note(notes) == "armature: 0.03 kg m^2 at 12 joints, which have none in the file"
    assert armature_note(import_robot(GO2, armature=0.03).notes) == "armature: all joints have those of the file"
    with pytest.raises(SpecError, match=r"light\.xml: armature: expected a number from 0 to 1e\+06, got nan$"):
        import_robot(light_mjcf, armature=float("nan"))


@pytest.mark.slow
def test_check_tells_buzzing_and_an_armature_that_calms_it(light_mjcf, tmp_path):
    path = tmp_path / "light.json"
    programs.passed(programs.arc_suite("import", light_mjcf, "--armature=0", "-o", path))
    done = programs.arc_suite("check", path)
    assert done.returncode == 1 and "stands and can take steps" in done.stdout
    problem = done.stdout.splitlines()[1]
    words = r"quadruped_15_kg buzzes as it stands: its joints shake at 0\.\d+ rad/s: an armature of 0.0091 kg m\^2"
    assert re.search(words, problem), problem
    programs.passed(programs.arc_suite("import", light_mjcf, "--armature=0.0091", "-o", path))
    programs.passed(programs.arc_suite("check", path))


def test_an_armature_that_is_there_is_not_advised():
    """Stiff servos shake a joint despite the armature."""
    body = import_robot(GO2, armature=0.0).body
    shaking = Stillness(0.4, True, False, np.zeros(len(body.joints), bool))
    assert "an armature of " in check._describe_buzz(body, shaking)
    stiffness = max(joint.servo.stiffness for joint in body.joints)
    armature = calming_armature(stiffness, body.simulation.timestep)
    assert "fits" in check._describe_buzz(change_armatures(body, 0.9 * armature), shaking)
    text = check._describe_buzz(change_armatures(body, armature), shaking)
    assert text.startswith("its joints shake at 0.4 rad/s despite an armature of ") and "lower gains" in text


def test_a_motor_that_gives_its_limit_one_way_is_overloaded_and_one_that_swings_is_not(light_mjcf):
    buzzing = measure_stillness(import_robot(light_mjcf, armature=0.0).body)
    assert buzzing.buzzes and not buzzing.overloaded.any()
    weak = measure_stillness(cures.multiply_motors(import_robot(GO2).body, 0.1))
    assert weak.overloaded.any() and not weak.buzzes


def test_a_robot_that_falls_does_not_buzz():
    """Two legs of four cannot hold the torso up."""
    body = import_robot(GO2).body
    model = mujoco.MjSpec.from_string(body.source)
    model.body("torso").ipos[0] += 0.6
    stillness = measure_stillness(body.replace(source=model.to_xml()))
    assert stillness.falls and not stillness.buzzes


@pytest.mark.slow
def test_a_robot_that_buzzed_walks_faster(light_mjcf):
    walk = cures.walk(import_robot(light_mjcf).body)
    walk_without = cures.walk(import_robot(light_mjcf, armature=0.0).body)
    assert not walk.verdict.fell
    assert walk.verdict.speed > max(0.9, walk_without.verdict.speed)
