"""`arc-suite import`: a line for each thing to know, and a body that needs no other file."""

import pathlib

import programs

from arc_suite.importing import import_robot
from arc_suite.robots.spec_files import EXAMPLES, load_body

FOLDER = pathlib.Path(__file__).parents[1] / "fixtures" / "robots"
GO2 = FOLDER / "go2_like.xml"


def run(*arguments):
    return programs.arc_suite("import", *map(str, arguments))


def test_it_tells_what_the_robot_has_become(tmp_path):
    path = tmp_path / "go2.json"
    name, *notes = programs.passed(run(GO2, "-o", path)).splitlines()
    assert name == f"{GO2}: quadruped_15_kg"
    assert [note.removeprefix("  ") for note in notes] == list(import_robot(GO2).notes)
    for part in (
        "legs: 4 (l1, r1, l2, r2)",
        "FL_hip_joint l1_joint1",
        "keyframe home",
        "23.7 to 45.43 N m",
        "left out",
    ):
        assert any(part in note for note in notes), part
    assert load_body(path) == import_robot(GO2).body


def test_without_output_it_writes_nothing(tmp_path):
    programs.passed(programs.arc_suite("import", str(GO2), cwd=tmp_path))
    assert list(tmp_path.iterdir()) == []


def test_flags_reach_the_importer(tmp_path):
    assert "keyframe home" in programs.passed(run(GO2, "--home=home", "--feet=FL,FR,RL,RR"))
    programs.refused(run(GO2, "--feet=nose"), f"arc-suite import: {GO2}: unknown foot 'nose'")
    assert "standing pose: angles of --home" in programs.passed(run(GO2, "--home=*_thigh*=0.8,*_calf*=-1.5"))


def test_bad_arguments_are_one_line_and_write_nothing(tmp_path):
    for arguments, line in (
        ((), "expected a file in MJCF or URDF; see --help\n"),
        (("none.xml",), "cannot read none.xml: no such file or directory\n"),
        ((GO2, "-o", tmp_path / "a.xml"), "unknown extension '.xml' (there are: .json); arc-suite build_model writ"),
        ((GO2, "--home=sit", "-o", tmp_path / "a.json"), f"{GO2}: unknown keyframe 'sit' (there are: lying, home)\n"),
        (
            (GO2.with_name("a1_like.urdf"), "--home=sit"),
            f"{GO2.with_name('a1_like.urdf')}: keyframe 'sit': the file names none; --home takes angles, too, such as ",
        ),
        (
            (EXAMPLES["crab"],),
            f"{EXAMPLES['crab']}: expected XML: not well-formed (invalid token): line 1, column 0; a body in JSON "
            "needs no import: every program takes it as --spec\n",
        ),
        (("crab",), "crab is a body of the suite: every program takes it as --robot=crab\n"),
        (("queen",), "queen is a body of the suite: every program takes it as --robot=queen\n"),
    ):
        programs.refused(run(*arguments), f"arc-suite import: {line}")
    assert list(tmp_path.iterdir()) == []
