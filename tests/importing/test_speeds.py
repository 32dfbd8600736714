"""The velocity of a URDF's joint is the speed at which its motor gives no torque, unless it is a placeholder."""

import pathlib

import pytest

from arc_suite.importing import import_robot
from arc_suite.robots.spec import SpecError

A1 = (pathlib.Path(__file__).parents[1] / "fixtures" / "robots" / "a1_like.urdf").read_text()
USED = "speeds: torques of 12 motors fall to 0 at 21 rad/s, from velocity"


def imported(folder, velocity):
    path = folder / "a1.urdf"
    path.write_text(A1.replace('velocity="21"', velocity))
    return import_robot(path)


def test_velocity_is_that_without_load(tmp_path):
    robot = imported(tmp_path, 'velocity="21"')
    assert {joint.servo.no_load_speed for joint in robot.body.joints} == {21.0}
    assert {joint.servo.drag for joint in robot.body.joints} == {
        joint.servo.limit / 21.0 for joint in robot.body.joints
    }
    assert USED in robot.notes


@pytest.mark.parametrize(
    ("velocity", "note"),
    [
        ('velocity="1000"', "speeds: 1000 rad/s of 12 motors is a placeholder, torques do not fall with speed"),
        ('velocity="0.5"', "speeds: 0.5 rad/s of 12 motors is a placeholder, torques do not fall with speed"),
        ('velocity="0"', None),
        ("", None),
    ],
)
def test_placeholders_are_told_and_do_nothing(tmp_path, velocity, note):
    robot = imported(tmp_path, velocity)
    assert {joint.servo.no_load_speed for joint in robot.body.joints} == {None}
    assert [line for line in robot.notes if line.startswith("speeds")] == ([] if note is None else [note])


def test_a_velocity_that_is_no_number_is_refused(tmp_path):
    with pytest.raises(SpecError, match="velocity: expected 1 number, got 'fast'"):
        imported(tmp_path, 'velocity="fast"')
