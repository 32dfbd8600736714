"""Tables of policies of many bodies: episodes in files, and the table of the page."""

import math
import pathlib

import pytest

from arc_suite.learning import transfer
from arc_suite.learning.studies.bodies import write
from arc_suite.learning.transfer import Comparison, Judged
from studies import bodies

ROOT = pathlib.Path(__file__).parents[3]
STUDY = ROOT / "studies" / "bodies.csv"


def compared(policy, tracking=math.nan):
    demonstrator, zero = Judged(20.0, True, 1.0, 0.8), Judged(10.0, False, 0.0, 0.1)
    return Comparison("body", Judged(policy, True, 0.9, tracking), demonstrator, zero)


def test_episodes_are_read_as_they_were_written(tmp_path):
    played = {"robots": [compared(15.0, 0.4), compared(20.0, 0.6)], "small": [compared(10.0, 0.2)]}
    path = tmp_path / "bodies.csv"
    for each in ({"small": []}, {"robots": [compared(1.0, 0.1)]}, played):  # the latest replaces the others
        write(path, "one", "steer", each)
    write(path, "two", "steer", played)
    assert bodies.read(path) == {("one", "steer"): played, ("two", "steer"): played}
    table = bodies.text(path).splitlines()
    assert table[0].split(" | ")[1:3] == ["task", "random"]
    assert table[2] == (
        "| one | steer | not run | not run | 0.75, tracking 0.62 | not run | not run | not run | 0.00, tracking 0.25 |"
        " not run |"
    )
    write(path, "one", "walk", {"robots": [compared(15.0)]})
    assert "| one | walk | not run | not run | 100%, 0.50 (0.50), speed 0.90 | not run |" in bodies.text(path)
    path.write_text("family,body\n")
    with pytest.raises(ValueError, match=r"bodies\.csv: expected lines of policy, task, family, "):
        bodies.text(path)


def test_what_ships_is_in_the_table_and_is_good():
    """Most bodies walk that nobody trained with, robots and their mutants among them."""
    found = bodies.read(STUDY)["universal", "walk"]
    assert list(found) == list(transfer.FAMILIES)
    results = {name: transfer.result(each) for name, each in found.items()}
    assert all(result.demonstrated >= 0.9 for result in results.values())
    assert results["random"].walk == 1.0 and results["varied"].walk >= 0.95
    assert min(results["random"].score, results["varied"].score) >= 0.98
    assert min(results["robots"].walk, results["mutants"].walk) >= 0.8
    steer = {name: transfer.result(each) for name, each in bodies.read(STUDY)["universal", "steer"].items()}
    assert min(steer["robots"].tracking, steer["varied"].tracking) >= 0.9
