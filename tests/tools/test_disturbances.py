"""tools/disturbances.py: rows of Markdown for every modifier."""

import pathlib
import re

import programs
import pytest

TOOL = pathlib.Path(__file__).parents[2] / "tools" / "disturbances.py"
SHORT = ("--robots=tick", "--presets=steered", "--episodes=2")


@pytest.mark.long
def test_a_table_of_every_modifier():
    done = programs.run(TOOL, *SHORT, "--steps=42")
    assert done.returncode == 0, done.stderr
    head, _, *rows = done.stdout.strip().splitlines()
    assert head == "| tick | steered |"
    figures = {}
    for row in rows:
        name, distance, fell = re.fullmatch(r"\| (.*) \| (-?\d\.\d\d) \((\d+)%\) \|", row).groups()
        figures[name] = float(distance), int(fell)
    assert {
        "none",
        "kicks 1.5",
        "motor_strength 0.25",
        "friction 0.2",
        "mass 2.5",
        "actuator_failure 0",
        "actuator_failure 2",
    } <= figures.keys()
    assert "actuator_failure 3" not in figures, "the right side is mirrored"
    assert figures["none"][0] > figures["motor_strength 0.25"][0]
    assert not any(fell for _, fell in figures.values())
