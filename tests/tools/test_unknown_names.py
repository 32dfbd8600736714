"""Tools that print tables refuse an unknown name in one line, before the table."""

import pathlib

import programs
import pytest

TOOLS = pathlib.Path(__file__).parents[2] / "tools"


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
    done = programs.run(TOOLS / tool, flag)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith(f"{tool}: {line}")
