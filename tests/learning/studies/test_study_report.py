"""Reports of studies: every number comes from published tables, and says what it should."""

import csv
import json
import pathlib
import re
import shutil

import interpreters
import numpy as np
import pytest

from arc_suite import evaluation
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors, published
from arc_suite.learning.agents.configuration import CONFIGURATION, Configuration
from arc_suite.learning.studies import claims, csv_files, publication, report, results, tables
from arc_suite.learning.studies.tables import Study, run

METRICS = ("heading_error", "lateral_drift", "torso_pitch", "gait_compliance", "foot_slip", "asymmetry")
STEPS = (500_000, 1_000_000)


def publish(folder, each, returns, style=0.1, phases=""):
    """Add rows of a run to the tables: returns are (evaluations, episodes)."""
    runs, episodes = (csv_files.read(folder / name) for name in (results.RUNS, results.EVALUATIONS))
    measured = {f"style_{name}": style for name in METRICS}
    columns = ("run", "step", "seed", "return", "length", "speed", "gait_compliance", *results.TIMES, *measured)
    for step, totals, times in zip(STEPS, returns, ((90.0, 60.0), (200.0, 180.0)), strict=False):
        for seed, total in enumerate(np.asarray(totals).tolist()):
            row = dict(zip(columns, (each.name, step, seed, total, 1000, 0.3, 0.9, *times), strict=False))
            episodes.append(row | (measured if step == STEPS[len(returns) - 1] else {}))
    csv_files.write(folder / results.EVALUATIONS, columns, episodes)
    csv_files.write(
        folder / results.RUNS,
        results.RUN_COLUMNS,
        [*runs, {"run": each.name, "training_seeds": "[]", "phases": phases}],
    )


def constant(*levels):
    return [np.full(10, level) + np.arange(10) for level in levels]


@pytest.fixture
def made(tmp_path):
    """A study as the paper's table of finals would have it, two seeds of everything, and its folder."""
    keys = [(robot, name, seed) for robot in published.FINALS for name in published.FINALS[robot] for seed in (0, 1)]
    runs = tuple(run(robot, name, 1_000_000, seed) for robot, name, seed in keys)
    for each, (robot, name, seed) in zip(runs, keys, strict=True):
        start, style = 100.0 if name in claims.ONLINE else 300.0, {"sac": 0.5, "sope": 0.9}.get(name, 0.1)
        publish(tmp_path / "mine", each, constant(start, float(published.FINALS[robot][name]) + seed), style)
    levels = {"zero": np.full(100, 1600.0), "medium": np.full(10, 2048.0), "refined": np.full(10, 3600.0)}
    anchors.write(tmp_path / "mine" / "demonstrators.csv", {"queen, walk": levels, "tick, walk": levels})
    return Study("as in the paper", runs), tmp_path / "mine"


def cells(page, *starts):
    """Of the first line of a table that begins so."""
    for line in page.splitlines():
        found = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("|") and found[: len(starts)] == list(starts):
            return found
    raise AssertionError(starts)


@pytest.mark.slow
def test_report(made):
    study, folder = made
    page = report.write("mine", study, folder).read_text()
    assert (folder / "curves.png").stat().st_size > 10_000
    command = (
        "`arc-suite train --robot=tick --task=walk --algorithm=sope --steps=1000000 --seed=0 --evaluate_every=10000`"
    )
    assert cells(page, "tick, walk", "sope", "0")[3:] == ["1,000,000 of 1,000,000", "3.0", command]
    # 3610 and 3611, each with 0 to 9 on top; the anchors are 1600 and 3600
    final = ["2", "3615.0 +- 0.5", "1.01", "3615.0 [3614.5, 3615.5]", "3610", "ten episodes"]
    assert cells(page, "tick, walk", "sope", "1,000,000")[3:] == final
    assert cells(page, "leaper, walk", "sope", "1,000,000")[5] == "-", "without anchors"
    medium = ["2048.0 +- 0.0", "0.22", "-", "2048", "ten episodes"]
    assert cells(page, "queen, walk", "demonstrator medium")[4:] == medium
    assert cells(page, "queen, walk", "standing still")[4:] == ["1600.0 +- 0.0", "0.00", "-", "-", "-"]
    area = f"{np.mean([104.5, 2594.5, 104.5, 2595.5]):.1f}"
    assert cells(page, "tick, walk", "sac", "-", "-") == ["tick, walk", "sac", "-", "-", "-", "-", area]
    assert cells(page, "tick, walk", "sope", "1,000,000", "3.0")[4:6] == ["1,000,000", "3.0"]
    assert cells(page, "bastion, walk", "sac", "0.500")[2:] == ["0.500"] * 6
    assert "As in the paper.\n" in page
    more = study._replace(runs=(*study.runs, run("tick", "sac", 1_000_000, seed=2)))
    assert "As in the paper. Begun: 48 of 49 runs.\n" in report.write("more", more, folder).read_text()


@pytest.mark.slow
def test_claims(made):
    """On the paper's own finals each sentence comes out as in its table; one does not hold there."""
    study, folder = made
    page = report.write("mine", study, folder).read_text()
    held = {claim.text: cells(page, claim.text)[1:] for claim in claims.CLAIMS}
    for claim in claims.CLAIMS:
        paper, there, ours, here = held[claim.text]
        if claim.metric is None:
            assert there == here
            assert re.findall(r"\w+ [+-]", paper) == re.findall(r"\w+ [+-]", ours)
        else:
            assert (paper, there) == ("-", "not measured")
    counts = [held[claim.text][3] for claim in claims.CLAIMS]
    assert counts == [f"{count} of 4 robots" for count in (4, 4, 4, 4, 3, 0, 0, 4)]
    assert "queen -300" in held["with prior data all end higher than without"][0]
    least = min(published.FINALS["queen"][name] for name in claims.ONLINE) - published.DEMONSTRATORS["queen"]
    assert f"queen +{least:.0f}" in held["all online algorithms surpass the demonstrator"][0]


@pytest.mark.long
def test_phases_are_told_where_they_are_published(made):
    study, folder = made
    assert "## Phases" not in report.write("mine", study, folder).read_text()
    rows = csv_files.read(folder / results.RUNS)
    for row, phases in zip(rows, ('{"10000": 300, "20000": 700}', '{"10000": 1100}'), strict=False):
        row["phases"] = phases
    csv_files.write(folder / results.RUNS, results.RUN_COLUMNS, rows)
    page = report.write("mine", study, folder).read_text()
    first = study.runs[0]
    assert cells(page, first.place, first.kind, "3") == [first.place, first.kind, "3", "700", "300", "1,100"]


@pytest.mark.slow
def test_claims_need_what_they_compare(made):
    """The study's title tells short phases; other tasks and missing algorithms are not compared."""
    study, folder = made
    few = study._replace(runs=tuple(each for each in study.runs if each.kind == "sac"))
    page = report.write("few", few, folder).read_text()
    assert cells(page, claims.CLAIMS[0].text)[3:] == ["-", "not measured"]
    found = results.results(few.runs, folder)
    assert claims.is_papers(found[0])
    usual = {"robot": "tick", "algorithm": "sac", "steps": 1_000_000}
    for other in ({"task": "steer"}, {"algorithm": "ppo"}, {"label": "b"}, {"task_kwargs": {"target_velocity": 0.4}}):
        assert not claims.is_papers(found[0]._replace(run=run(**usual | other)))


def test_unfinished_evaluations_do_not_count(tmp_path):
    lines = [f"{step},{seed},900.0,40" for step in (1000, 2000, 3000) for seed in range(10)][:-9]
    (tmp_path / "evaluations.csv").write_text("\n".join(["step,seed,return,length", *lines]) + "\n")
    (tmp_path / "times.csv").write_text(
        "step,wall_seconds,cpu_seconds\n1000,1,1.0\n1500,2,2.0\n2000,3,3.0\n3000,4,4.0\n"
    )
    found = publication._evaluated(tmp_path)
    rows = [(row["step"], row["seed"], row["cpu_seconds"]) for row in found]
    assert len(rows) == 20 and rows[9:11] == [("1000", "9", "1.0"), ("2000", "0", "3.0")]


def test_damaged_tables_are_one_line(tmp_path):
    each = run("tick", "sac", 1_000_000)
    publish(tmp_path, each, constant(100.0))
    path = tmp_path / results.EVALUATIONS
    path.write_text(path.read_text() + f"{each.name},1000000,0,1.0,1000,0.3,0.9,1.0,1.0" + 6 * "," + "\n")
    with pytest.raises(ValueError, match=r"evaluations.csv: damaged: "):
        results.results([each], tmp_path)


@pytest.mark.slow
def test_one_seed_has_no_interval(tmp_path):
    runs = run("tick", "sac", 1_000_000), run("tick", "speq", 1_000_000)
    for each in runs:
        publish(tmp_path / "mine", each, constant(100.0, 200.0))
    page = report.write("mine", Study("one seed each", runs), tmp_path / "mine").read_text()
    assert cells(page, "tick, walk", "sac", "1,000,000", "1")[4:] == ["204.5", "-", "-", "2590", "ten episodes"]
    assert cells((tmp_path / "README.md").read_text(), "tick, walk", "sac")[4:8] == ["1", "204.5", "-", "-"]


@pytest.mark.slow
def test_the_leaderboard_holds_each_configuration_once(tmp_path):
    """The row with more seeds; phases tell two configurations of one algorithm apart."""
    phases = {"phase_updates": 7500, "check_every": 100, "patience": 1000}
    few, many = (run("tick", "sac", 1_000_000),), tuple(run("tick", "sac", 1_000_000, seed) for seed in range(2))
    other = (
        *many,
        run("tick", "speq", 1_000_000),
        run("tick", "speq", 1_000_000, hyperparameters=phases, label="speq-short"),
    )
    for name, runs in (("a", few), ("b", other)):
        for each in runs:
            publish(tmp_path / name, each, constant(100.0, 200.0))
        report.write(name, Study(name, runs), tmp_path / name)
    page = (tmp_path / "README.md").read_text()
    rows = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| tick")]
    assert sorted((row[1], row[2], row[4], row[15]) for row in rows) == [
        ("sac", "-", "2", "[b](b/README.md)"),
        ("speq", "75,000", "1", "[b](b/README.md)"),
        ("speq-short", "7,500", "1", "[b](b/README.md)"),
    ]


def test_until(tmp_path):
    runs = run("tick", "sac", 1_000_000), run("tick", "sac", 1_000_000, 1)
    publish(tmp_path, runs[0], constant(100.0, 900.0))
    publish(tmp_path, runs[1], constant(500.0, 600.0))
    found = results.results(runs, tmp_path)
    assert results.until(found, 500.0) == (750_000.0, 120.0)
    assert results.until(found, 700.0) == (np.inf, np.inf)


def test_nothing_published_is_one_line(tmp_path):
    with pytest.raises(ValueError, match=r"none: holds no results of the study mine$"):
        report.write("mine", Study("none", (run("tick", "sac", 10),)), tmp_path / "none")


COMMITTED = pathlib.Path(__file__).parents[3] / "studies"
NAMES = sorted(path.parent.name for path in COMMITTED.glob(f"*/{results.RUNS}"))


@pytest.mark.parametrize("name", NAMES)
def test_committed_configurations_are_those_of_the_studies(name):
    """Today's code reads each, and trains the same run."""
    runs = {each.name: each for each in tables.study(name).runs}
    for row in csv_files.read(COMMITTED / name / results.RUNS, results.RUN_COLUMNS):
        fields = {field: row[field] or None for field in CONFIGURATION}
        fields |= {
            each: json.loads(row[each]) for each in ("task_kwargs", "hyperparameters", "training", "seed", "steps")
        }
        fields["evaluate_every"] = int(row["evaluate_every"])
        assert Configuration.from_dict(fields) == runs[row["run"]].configuration
        assert row["kind"] == runs[row["run"]].kind


REPEATED = """
import json, shlex, sys
from absl.testing import flagsaver
from arc_suite.learning.cli import train
for command in json.loads(sys.argv[1]):
    with flagsaver.flagsaver():
        train.FLAGS(shlex.split(command)[1:])
        print(json.dumps(train.configured()[0].to_dict()))
"""


def test_commands_repeat_runs():
    """Those of all runs of all studies, with settings, hyperparameters and prior data."""
    studies = [*tables.STUDIES.values(), tables.study("demonstrations-sope")]
    runs = [each.configuration for study in studies for each in study.runs]
    commands = json.dumps([each.command for each in runs])
    for each, line in zip(runs, interpreters.printed(REPEATED, commands), strict=True):
        assert json.loads(line) == json.loads(json.dumps(each.to_dict())), each.command


@pytest.mark.long
def test_committed_reports_are_made_of_committed_tables(tmp_path):
    """By the one command, and nobody has changed a number."""
    shutil.copytree(COMMITTED, tmp_path / "studies")
    assert NAMES
    for name in NAMES:
        report.write(name, tables.study(name), tmp_path / "studies" / name)
    for path in (*(f"{name}/README.md" for name in NAMES), "README.md", "leaderboard.csv"):
        assert (tmp_path / "studies" / path).read_text() == (COMMITTED / path).read_text(), path


def test_the_papers_table_has_every_robot_and_algorithm():
    assert published.CURVES.keys() == published.DEMONSTRATORS.keys()
    for curves in published.CURVES.values():
        assert set(curves) == {*claims.ONLINE, *claims.WITH_PRIOR}
        assert all(len(points) == len(published.STEPS) for points in curves.values())


def test_the_page_holds_our_returns_next_to_the_papers():
    found = [results.results(tables.study(name).runs, COMMITTED / name) for name in ("exact-tick", "short")]
    page = (COMMITTED.parent / "docs" / "study.md").read_text()
    text = claims.next_to_the_papers(found, 100_000)
    assert f"<!-- table -->\n\n{text}\n\n<!-- end -->" in page
    assert "| speq_o2o | 2977 (short phases) / 1410 | not run / 2850 | not run / 2310 |" in text
    assert "| 2242 (at 90,000) / 1780 |" in text


def test_the_papers_returns_as_a_table():
    """The file for users' plots holds the suite's own numbers."""
    with (COMMITTED / "paper.csv").open(newline="") as file:
        rows = {tuple(row.values())[:3]: float(row["return"]) for row in csv.DictReader(file)}
    expected = {(robot, "demonstrator", ""): value for robot, value in published.DEMONSTRATORS.items()}
    for robot, curves in published.CURVES.items():
        for name, points in curves.items():
            known = zip(published.STEPS, points, strict=True)
            expected |= {(robot, name, str(step)): point for step, point in known if point is not None}
    assert rows == expected and len(rows) == 4 * 6 * 5 - 1 + 4


@pytest.mark.parametrize(
    ("name", "steps", "found"),
    [
        ("sac", 100_000, 1190),
        ("sac", 75_000, 745),
        ("speq", 99_999, None),
        ("sac", 49_999, None),
        ("sac", 1_000_001, None),
        ("ppo", 100_000, None),
    ],
)
def test_the_paper_is_read_at_equal_steps(name, steps, found):
    assert published.at("leaper", name, steps) == found


def test_a_level_of_the_paper_is_that_of_the_steps():
    setup = Setup.of("tick")
    assert evaluation.published_returns(setup, ["sac", "ppo"], 100_000) == {"sac": 350.0}
    assert evaluation.published_returns(setup, ["ppo"], 100_000) == {"speq_o2o": 2370.0}
    assert evaluation.published_returns(setup, ["ppo"], 1_000_000) == {"speq_o2o": 3720.0}
    assert evaluation.published_returns(setup, ["ppo"], 25_600) == {}
    assert evaluation.published_returns(Setup.of("tick", "steer"), ["sac"], 100_000) == {}
