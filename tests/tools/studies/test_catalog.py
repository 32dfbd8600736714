"""The project's own studies: their runs are those that are committed, whatever else is registered."""

import json
import pathlib
import re

import interpreters
import programs
import pytest

from arc_suite.learning.agents.configuration import CONFIGURATION_FIELDS, Configuration
from arc_suite.learning.studies import csv_files, results
from studies import catalog

ROOT = pathlib.Path(__file__).parents[3]
COMMITTED = ROOT / "studies"
NAMES = sorted(path.parent.name for path in COMMITTED.glob(f"*/{results.RUNS}"))


@pytest.mark.parametrize("name", NAMES)
def test_committed_configurations_are_those_of_the_studies(name):
    """Today's code reads each, and trains the same run; ground of the benchmark has become harder since."""
    runs = {each.name: each for each in catalog.study(name).runs}
    for row in csv_files.read(COMMITTED / name / results.RUNS, results.RUN_COLUMNS):
        fields = {field: row[field] or None for field in CONFIGURATION_FIELDS}
        fields |= {
            each: json.loads(row[each]) for each in ("task_kwargs", "hyperparameters", "training", "seed", "steps")
        }
        fields["evaluate_every"] = int(row["evaluate_every"])
        configuration = runs[row["run"]].configuration
        if fields["task"] in ("rough", "stairs"):
            fields["task_kwargs"] = configuration.setup.task_kwargs
        assert Configuration.from_dict(fields) == configuration
        assert row["kind"] == runs[row["run"]].kind


REPEATED = """
import json, shlex, sys
from absl.testing import flagsaver
from arc_suite.learning.cli import train
for command in json.loads(sys.argv[1]):
    with flagsaver.flagsaver():
        train.FLAGS(shlex.split(command)[1:])
        print(json.dumps(train.configurations_from_flags()[0].to_dict()))
"""


def test_commands_repeat_runs():
    """Those of all runs of all studies, with settings, hyperparameters and prior data."""
    studies = [*catalog.STUDIES.values(), catalog.study("demonstrations-sope")]
    runs = [each.configuration for study in studies for each in study.runs]
    commands = json.dumps([each.command for each in runs])
    for each, line in zip(runs, interpreters.printed(REPEATED, commands), strict=True):
        assert json.loads(line) == json.loads(json.dumps(each.to_dict())), each.command


REGISTERED = """
import json
import arc_suite
from arc_suite.learning.agents.algorithms import ALGORITHMS
from arc_suite.bodies import generator
from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS
from arc_suite.tasks.walk import Walk

body = generator.random_body(3).replace(name="newcomer")
tasks = type("Stroll", (Walk,), {"name": "stroll"}), type("Ramble", (TASKS["steer"],), {"name": "ramble"})
arc_suite.register(module="__main__", body=body, tasks=tasks)
ALGORITHMS["novel"] = ALGORITHMS["ppo"]
assert {"stroll", "ramble"} < TASKS.keys() and "newcomer" in ROBOTS

from studies import catalog
studies = catalog.STUDIES.items()
print(json.dumps({name: [each.configuration.to_dict() for each in study.runs] for name, study in studies}))
"""


def test_what_is_registered_joins_no_study():
    """A study that is finished stays finished: its runs are named one by one."""
    (line,) = interpreters.printed(REGISTERED, folder=ROOT / "tools")
    runs = {name: [each.configuration.to_dict() for each in study.runs] for name, study in catalog.STUDIES.items()}
    assert json.loads(line) == json.loads(json.dumps(runs))


def test_runs_of_a_study_differ_in_name():
    for study in catalog.STUDIES.values():
        names = [each.name for each in study.runs]
        assert len(set(names)) == len(names)


def test_the_page_counts_runs():
    text = (ROOT / "studies" / "catalog.md").read_text()
    rows = re.findall(r"^\| `([a-z-]+)` \| (\d+) \| (\d+) \|", text, re.MULTILINE)
    assert {name for name, *_ in rows} == catalog.STUDIES.keys()
    for name, runs, committed in rows:
        assert len(catalog.study(name).runs) == int(runs), name
        assert len(csv_files.read(COMMITTED / name / results.RUNS)) == int(committed), name


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ([], "expected a study: paper, exact-tick, short, "),
        (["papr"], "unknown study 'papr'; did you mean 'paper'? (there are: "),
        (["tiny_studies:PAIR"], "unknown study 'tiny_studies:PAIR' (there are: paper, "),
        (["first-steps", "--shard=6/7"], "--shard=6/7: no run, as the study has 6"),
        (["first-steps", "--report"], "studies/first-steps: holds no results of the study first-steps"),
    ],
)
def test_errors_are_one_line(arguments, line, tmp_path):
    programs.refused(programs.tool("study", *arguments, cwd=tmp_path), f"study.py: {line}")


def test_help_has_the_flags_of_a_study():
    text = programs.passed(programs.tool("study", "--help"))
    assert text.startswith("Make the runs of one of the project's own studies, or write its report ")
    assert "--submit=N" in text and "--report" in text
