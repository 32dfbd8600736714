"""tools/evaluate.py, run as a user runs it."""

import pathlib
import subprocess
import sys

import pytest

TOOL = pathlib.Path(__file__).parents[1] / "tools" / "evaluate.py"


def evaluate(*arguments):
    return subprocess.run([sys.executable, TOOL, *arguments], capture_output=True, text=True)


def test_table_of_all_robots():
    result = evaluate("--robot=all", "--policy=random", "--episodes=2")
    assert result.returncode == 0, result.stderr
    rows = {line.split()[0]: line for line in result.stdout.splitlines()[2:]}
    assert list(rows) == ["queen", "bastion", "tick", "leaper"]
    for robot, expert in {"queen": "2048", "bastion": "2311", "tick": "1971", "leaper": "2630"}.items():
        assert rows[robot].split()[4] == expert


def test_figures_of_a_demonstrator():
    result = evaluate("--robot", "queen", "--policy", "cpg", "--preset", "medium", "--episodes", "2")
    assert result.returncode == 0, result.stderr
    fields = result.stdout.splitlines()[-1].split()
    assert fields[0] == "queen"
    assert float(fields[1]) == pytest.approx(2049, rel=0.015)
    assert fields[5] == "1000.0"
    assert float(fields[7]) == pytest.approx(0.5, abs=0.05)
    assert 0 < float(fields[9]) < 100


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["--robot=quen"],
            "unknown robot 'quen'; did you mean 'queen'? (there are: queen, bastion, tick, leaper, all)",
        ),
        (["--policy=cgp"], "unknown policy 'cgp'; did you mean 'cpg'? (there are: cpg, zero, random)"),
        (
            ["--policy=zero", "--preset=fats"],
            "unknown preset 'fats'; did you mean 'fast'? (there are: slow, medium, fast)",
        ),
        (["--episodes=0"], "flag --episodes=0: 0 is not a positive integer"),
        (["--episode=3"], "Unknown command line flag 'episode'. Did you mean: episodes ?"),
        (["queen"], "unexpected argument 'queen'; see --help"),
    ],
)
def test_bad_input_is_one_line_and_exit_status_1(arguments, message):
    result = evaluate(*arguments)
    assert result.returncode == 1
    assert result.stderr == f"evaluate.py: {message}\n"
    assert result.stdout == ""


def test_help_shows_an_example_and_the_flags():
    result = evaluate("--help")
    assert "python tools/evaluate.py --robot all" in result.stdout
    for flag in ("--robot", "--policy", "--preset", "--episodes", "--seed"):
        assert flag in result.stdout
