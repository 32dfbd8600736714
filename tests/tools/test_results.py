"""tools/results.py: tables of demonstrators, and the marks between which they stand in the page; errors of names."""

import pathlib
import re

import programs
import pytest

from arc_suite.tasks import TASKS

TOOL = pathlib.Path(__file__).parents[2] / "tools" / "results.py"
CELL = r" \| -?\d+, -?\d\.\d\d(?: \(.*?\))?"


@pytest.mark.slow
@pytest.mark.parametrize("shares", [["1.00"], pytest.param(["0.00", "1.00"], marks=pytest.mark.release)])
def test_a_table_has_a_row_for_each_difficulty(shares):
    flags = ("--tasks=rough", "--robots=tick", "--presets=zero", "--episodes=1")
    done = programs.run(TOOL, *flags, f"--difficulties={','.join(shares)}")
    assert done.returncode == 0, done.stderr
    head, _, *rows = done.stdout.strip().splitlines()
    assert head == "| rough | zero |"
    assert all(re.fullmatch(rf"\| tick {share}{CELL} \|", row) for share, row in zip(shares, rows, strict=True))


def test_every_task_has_its_table_in_the_page():
    page = (TOOL.parents[1] / "studies" / "demonstrators.md").read_text()
    for task in TASKS.keys() - {"walk"}:
        assert re.search(rf"<!-- {task} -->\n\n\| {task} \| zero \|.*?<!-- end -->", page, re.DOTALL), task


@pytest.mark.parametrize(
    ("tool", "flag", "line"),
    [
        ("disturbances.py", "--robots=tik", "unknown robot 'tik'; did you mean 'tick'?"),
        ("disturbances.py", "--presets=tuned,steerd", "unknown preset 'steerd'; did you mean 'steered'?"),
        ("results.py", "--robots=tik", "unknown robot 'tik'; did you mean 'tick'?"),
        ("results.py", "--presets=tuned,steerd", "unknown preset 'steerd'; did you mean 'steered'?"),
        ("results.py", "--tasks=walk", "unknown task 'walk'"),
    ],
)
def test_an_unknown_name_is_one_line_before_the_table(tool, flag, line):
    done = programs.run(TOOL.with_name(tool), flag)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith(f"{tool}: {line}")
