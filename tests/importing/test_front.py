"""A robot whose front is not x is turned where the names of its legs and their hinges agree; else a line tells it."""

import math
import pathlib
import re

import mujoco
import numpy as np
import programs
import pytest

from arc_suite.evaluation import cures
from arc_suite.importing import import_robot
from arc_suite.importing.facing import Facing

FOLDER = pathlib.Path(__file__).parents[1] / "fixtures" / "robots"
GO2, A1, HEXAPOD = (FOLDER / name for name in ("go2_like.xml", "a1_like.urdf", "hexapod.urdf"))
BASES = {A1: "base", HEXAPOD: "base_link"}
NAMED_LEGS = re.compile(r"(?<![A-Za-z])(FL|FR|RL|RR)(?![A-Za-z])")
NAMELESS = {"FL": "a", "FR": "b", "RL": "c", "RR": "d"}


def turn(folder, source, yaw, names=None):
    """Write a robot that is turned in the frame of its torso, and return its path.

    Args:
        folder: for the file.
        source: file of the robot.
        yaw: degrees.
        names: new names of legs.
    """
    text = source.read_text()
    if source.suffix == ".urdf":
        origin = f'<origin rpy="0 0 {math.radians(yaw)!r}"/>'
        joint = f'<joint name="turn" type="fixed">{origin}<parent link="first"/><child link="{BASES[source]}"/></joint>'
        text = text.replace("</robot>", f'<link name="first"/>{joint}</robot>')
    else:
        start = '<body name="base" pos="0 0 0.445" childclass="robot">'
        assert start in text
        inertial = '<inertial pos="0 0 0" mass="0.001" diaginertia="1e-6 1e-6 1e-6"/>'
        first = f'<body name="first" pos="0 0 0.445">{inertial}<freejoint/>'
        second = f'<body name="base" euler="0 0 {math.radians(yaw)!r}" childclass="robot">'
        text = text.replace("<freejoint/>", "").replace(start, first + second)
        text = text.replace("</worldbody>", "</body></worldbody>")
    if names is not None:
        text = NAMED_LEGS.sub(lambda match: names[match[1]], text)
    path = folder / source.name
    path.write_text(text)
    return path


def front_notes(notes):
    return [note for note in notes if note.startswith(("turned: ", "front: "))]


def feet(body):
    return np.array([leg.foot_position for leg in body.legs])


@pytest.mark.parametrize("source", [GO2, A1, HEXAPOD], ids=lambda path: path.stem)
@pytest.mark.parametrize(("yaw", "axis"), [(90.0, "y"), (180.0, "-x"), (-90.0, "-y")])
def test_names_and_hinges_turn_a_robot(source, yaw, axis, tmp_path):
    path = turn(tmp_path, source, yaw)
    body, notes = import_robot(path)
    (note,) = front_notes(notes)
    assert note.startswith(f"turned: the file's {axis} axis points ahead, as names of legs and their hinges say")
    straight_body = import_robot(source).body
    assert feet(body) == pytest.approx(feet(straight_body), abs=1e-6)
    assert [leg.name for leg in body.legs] == [leg.name for leg in straight_body.legs]
    assert import_robot(path, forward=axis).body == body


def test_the_mass_of_a_turned_torso_stays_in_its_place(tmp_path):
    models = [mujoco.MjModel.from_xml_string(import_robot(path).body.source) for path in (A1, turn(tmp_path, A1, 90.0))]
    data = [mujoco.MjData(model) for model in models]
    for model, state in zip(models, data, strict=True):
        mujoco.mj_resetDataKeyframe(model, state, 0)
        state.qvel[:] = np.linspace(-1.0, 1.0, model.nv)
        mujoco.mj_forward(model, state)
    assert data[1].qacc == pytest.approx(data[0].qacc, rel=1e-6, abs=1e-6)


POD = (
    '<body name="pod" pos="0.1 0 0.2"><joint name="pod" axis="0 1 0"/>'
    '<geom type="sphere" size="0.02" mass="0.2"/></body>'
    '<site name="imu"'
)
CONSTRAINTS = {
    "weld, torso first": ('<weld body1="base" body2="pod" relpose="0.1 0 0.2 1 0 0 0"/>', (0.1, 0.0, 0.2)),
    "weld, torso first, anchor": ('<weld body1="base" body2="pod" anchor="0 0 0.1"/>', (0.1, 0.0, 0.3)),
    "weld, torso last": ('<weld body1="pod" body2="base" relpose="-0.1 0 -0.2 1 0 0 0"/>', (0.0, 0.0, 0.0)),
    "weld, torso last, anchor": ('<weld body1="pod" body2="base" anchor="0.1 0 0.3"/>', (0.1, 0.0, 0.3)),
    "connection, torso first": ('<connect body1="base" body2="pod" anchor="0.1 0 0.3"/>', (0.1, 0.0, 0.3)),
    "connection, torso last": ('<connect body1="pod" body2="base" anchor="0 0 0.1"/>', (0.1, 0.0, 0.3)),
}


@pytest.mark.parametrize("forward", ["x", "y", "-y", "-x"])
@pytest.mark.parametrize("case", CONSTRAINTS)
def test_a_constraint_at_a_turned_torso_stays_in_its_place(case, forward, tmp_path):
    constraint, place = CONSTRAINTS[case]
    text = GO2.read_text().replace('<site name="imu"', POD)
    text = re.sub(r'qpos="(\S+ \S+ \S+ 1 0 0 0) ', r'qpos="\1 0 ', text)
    path = tmp_path / "pod.xml"
    path.write_text(text.replace("</mujoco>", f"<equality>{constraint}</equality></mujoco>"))
    model = mujoco.MjModel.from_xml_string(import_robot(path, forward=forward).body.source)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    assert data.joint("pod").qpos == pytest.approx(0.0, abs=1e-6)
    expected_place = Facing(forward).rotation @ place
    for side in (1, 2):
        site = data.site(f"loop0_{side}").xpos - data.body("torso").xpos
        assert site == pytest.approx(expected_place, abs=1e-6), side
    errors = data.efc_pos[data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY]
    assert len(errors) == (6 if "weld" in case else 3) and errors == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("source", [GO2, A1], ids=lambda path: path.stem)
def test_hinges_alone_are_told_and_a_flag_turns(source, tmp_path):
    path = turn(tmp_path, source, 90.0, NAMELESS)
    notes = front_notes(import_robot(path).notes)
    assert notes == ["front: the file's x axis, although legs swing along y; --forward=y turns it"]
    turned_body, notes = import_robot(path, forward="y")
    assert front_notes(notes) == []
    assert feet(turned_body) == pytest.approx(feet(import_robot(source).body), abs=1e-6)


@pytest.mark.parametrize(
    ("names", "yaw", "note"),
    [
        (
            {"FL": "FR", "FR": "FL", "RL": "RR", "RR": "RL"},
            180.0,
            "front: the file's x axis, although some names of legs say -x; --forward=-x turns it",
        ),
        (
            {"FL": "RL", "FR": "FL", "RL": "RR", "RR": "FR"},
            0.0,
            "front: the file's x axis, although names of legs say -y; --forward=-y turns it",
        ),
    ],
    ids=["left and right are swapped", "hinges contradict"],
)
def test_names_that_nothing_confirms_are_told(names, yaw, note, tmp_path):
    body, notes = import_robot(turn(tmp_path, A1, yaw, names))
    assert front_notes(notes) == [note]
    assert feet(body)[:, 0].max() > 0.1


def test_a_robot_whose_front_is_x_gets_no_line():
    for path in (GO2, A1, HEXAPOD):
        assert front_notes(import_robot(path).notes) == []


def test_a_file_keeps_its_front_by_the_flag(tmp_path):
    path = turn(tmp_path, A1, 180.0)
    assert front_notes(import_robot(path, forward="x").notes) == []
    line = programs.passed(programs.arc_suite("import", path, "--forward=-x"))
    assert "(l1, r1, l2, r2)" in line or "(r1, l1, r2, l2)" in line
    programs.refused(programs.arc_suite("import", path, "--forward=ahead"), "arc-suite import: ")


@pytest.mark.slow
@pytest.mark.parametrize("source", [GO2, A1, HEXAPOD], ids=lambda path: path.stem)
def test_a_robot_with_its_front_at_y_walks_ahead(source, tmp_path):
    verdict = cures.walk(import_robot(turn(tmp_path, source, 90.0)).body).verdict
    assert verdict.walks and abs(verdict.drift) < 0.1
