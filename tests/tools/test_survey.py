"""tools/survey.py lets random bodies walk and tells those that do from those that do not."""

import re

import programs
import pytest

from arc_suite.registry import FAMILIES
from arc_suite.tasks import TASKS

FAMILY_WORDS = f"(there are: {', '.join(FAMILIES)}, module:name to import it)"
BODIES = ("--first=40", "--legs=6", "--links=3", "--seconds=12")
IN_PHASE = ("--set=duty_factor=0.6", "--set=phase_offsets=0.0")


def survey(*arguments):
    return programs.tool("survey", "--processes=1", *arguments)


def test_bodies_walk():
    lines = programs.passed(survey(*BODIES, "--count=3")).splitlines()
    assert lines[0].split() == ["legs", "3", "links", "all"]
    assert lines[1].split()[:2] == ["6", "3/3"]
    assert lines[3:5] == ["3 of 3 bodies walk (100.0 %)", "failures: none"]
    assert re.fullmatch(
        r"100\.0 % reach 0\.9 of the target speed; median speed (0\.9|1\.[0-3])\d of it, median drift 0\.0\d", lines[5]
    )


@pytest.mark.parametrize("target", [("--set=target_velocity=-0.25",), ("--task=steer",)])
def test_bodies_walk_backwards_and_by_commands(target):
    assert "1 of 1 bodies walk" in programs.passed(survey(*BODIES, "--count=1", *target))


def test_bodies_of_another_family_walk():
    out = programs.passed(survey("--family=varied", "--first=4", "--count=1", "--seconds=5"))
    assert "1 of 1 bodies walk" in out


def test_legs_in_phase_fail_and_their_bodies_are_named():
    out = programs.passed(survey(*BODIES, "--count=1", *IN_PHASE))
    assert "0 of 1 bodies walk (0.0 %)\nfailures: slow 1\n" in out
    assert out.endswith("seed 40: 6 legs, 3 links: slow\n")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            "--task=steer2",
            f"unknown task 'steer2'; did you mean 'steer'? (there are: {', '.join(TASKS)}, module:name to import it)",
        ),
        ("--legs=6 --family=varied", "--legs=6: goes with the family random, not with varied"),
        ("--count=0", "flag --count=0: expected an integer in the range [1, 100000]"),
        ("--picture=missing/a.png", "cannot write missing/a.png: no such file or directory"),
        ("--picture=a.txt", "unknown extension '.txt' (there are: .png)"),
        ("--set=time_limit=Infinity", "time_limit: expected a finite number, as every episode must end, got inf"),
        ("--family=vared", f"unknown family 'vared'; did you mean 'varied'? {FAMILY_WORDS}"),
    ],
)
def test_bad_arguments_are_one_line(arguments, message):
    programs.refused(survey(*arguments.split()), f"survey.py: {message}\n")


@pytest.mark.slow
def test_failures_are_shown_in_a_picture(tmp_path):
    path = tmp_path / "failures.png"
    done = survey(*BODIES, "--count=1", *IN_PHASE, "--picture", path)
    if "cannot render" in done.stderr:
        pytest.skip("no OpenGL here")
    programs.passed(done)
    assert path.read_bytes().startswith(b"\x89PNG")
