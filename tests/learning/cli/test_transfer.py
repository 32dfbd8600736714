"""arc-suite transfer as users run it."""

import csv
import shutil

import numpy as np
import programs
import pytest
from networks import of_many_bodies as drawn

from arc_suite.bodies import generator
from arc_suite.policies import network
from arc_suite.robots import spec_files


@pytest.fixture(scope="module")
def policy(tmp_path_factory):
    """The file of a policy of many bodies that stands."""
    path = tmp_path_factory.mktemp("policy") / "policy.npz"
    network.save(path, drawn(scale=0.0))
    return path


def transfer(*arguments):
    return programs.run("-m", "arc_suite", "transfer", *arguments)


@pytest.mark.long
def test_a_row_for_each_family_and_a_table_of_episodes(policy, tmp_path):
    done = transfer(f"--policy={policy}", "--families=robots", "-o", tmp_path / "table.csv", "--name=mine")
    heads, row = (line.split() for line in programs.passed(done).splitlines())
    assert heads[:5] == ["family", "count", "walk", "demonstrated", "speed"] and row[:3] == ["robots", "4", "0"]
    with (tmp_path / "table.csv").open() as file:
        lines = list(csv.DictReader(file))
    assert (
        len(lines) == 12
        and {(line["policy"], line["task"]) for line in lines} == {("mine", "walk")}
        and {line["who"] for line in lines} == {"policy", "demonstrator", "zero"}
    )
    speeds = {who: [float(line["speed"]) for line in lines if line["who"] == who] for who in ("policy", "demonstrator")}
    assert float(row[4]) == pytest.approx(np.mean(speeds["policy"]), abs=1e-3)
    assert max(map(abs, speeds["policy"])) < 0.1 < min(speeds["demonstrator"])
    walked = [line["walked"] for line in lines if line["who"] == "demonstrator"]
    assert walked == [str(int(speed >= 0.7)) for speed in speeds["demonstrator"]]
    assert float(row[3]) == walked.count("1") / 4


def test_a_table_keeps_the_rows_of_other_policies_and_settings(policy, tmp_path):
    """Also of runs whose names differ after a dot, and of the best policies of runs."""
    spec_files.save_body(generator.random_body(3), tmp_path / "pup.json")
    table = tmp_path / "table.csv"
    names = [tmp_path / "varied.0-127-walk-dagger_bodies-0" / "best", tmp_path / "varied.0-63-steer-0" / "best"]
    for name in names:
        name.mkdir(parents=True)
        shutil.copy(policy, name)
    plays = [(names[0], 0.1), (names[1], 0.1), (names[0], 0.2), (names[0], 0.1)]
    for name, limit in plays:
        arguments = (f"--policy={name}", f"--families={tmp_path / 'pup.json'}", "--set", f"time_limit={limit}")
        programs.passed(transfer(*arguments, "-o", table))
    with table.open() as file:
        rows = {(line["policy"], line["task"], line["who"]) for line in csv.DictReader(file)}
        file.seek(0)
        assert len(list(csv.DictReader(file))) == len(rows) == 9
    expected = {(str(name), f'walk, {{"time_limit": {limit}}}') for name, limit in plays}
    assert {row[:2] for row in rows} == expected


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--families=robts"], "unknown family 'robts'; did you mean 'robots'?"),
        (["--families=robots,none.json"], "cannot read none.json: no such file or directory"),
        (["--policy=nowhere.npz"], "cannot read nowhere.npz: no such file"),
        (["-o", "table.txt"], "unknown extension '.txt' (there are: .csv)"),
        (["--task=wlak"], "unknown task 'wlak'; did you mean 'walk'?"),
    ],
)
def test_what_does_not_fit_is_one_line(arguments, message):
    programs.refused(transfer(*arguments), f"arc-suite transfer: {message}")
