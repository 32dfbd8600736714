"""The leaderboard is made of all committed studies."""

import pathlib
import shutil

import programs
import pytest
from published_tables import cells, constant, publish
from refusals import refused

from arc_suite.evaluation import anchors
from arc_suite.learning.studies import benchmark, csv_files, report, results
from arc_suite.learning.studies.benchmark import RunScore
from arc_suite.learning.studies.tables import Study, run
from studies import catalog, leaderboard, reports

COMMITTED = pathlib.Path(__file__).parents[3] / "studies"
NAMES = sorted(path.parent.name for path in COMMITTED.glob(f"*/{results.RUNS}"))


def test_the_leaderboard_holds_each_configuration_once(tmp_path, monkeypatch):
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
        monkeypatch.setitem(catalog.STUDIES, name, Study(name, runs))
    leaderboard.write(tmp_path)
    page = (tmp_path / "README.md").read_text()
    rows = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| tick")]
    assert sorted((row[1], row[2], row[4], row[16]) for row in rows) == [
        ("sac", "-", "2", "[b](b/README.md)"),
        ("speq", "75,000", "1", "[b](b/README.md)"),
        ("speq-short", "7,500", "1", "[b](b/README.md)"),
    ]
    assert all("204.5" in row for row in rows), "the mean of the latest returns, one seed or two"


def test_a_folder_of_no_study_is_refused(tmp_path):
    publish(tmp_path / "shrt", run("tick", "sac", 1_000_000), constant(100.0))
    with refused("unknown study 'shrt'; did you mean 'short'? (there are: paper, ", begins=True):
        leaderboard.write(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["shrt"]


EVO = {
    "kind": "evo:ars",
    "algorithm": "evo:ars",
    "robot": "tick",
    "task": "walk",
    "task_kwargs": "{}",
    "hyperparameters": '{"directions": 16, "rate": 0.05}',
    "steps": "1000000",
    "evaluate_every": "500000",
    "training": "{}",
    "training_seeds": "[]",
    "sources": "[]",
}
EVO_COMMAND = (
    "`arc-suite train --robot=tick --task=walk --algorithm=evo:ars --steps=1000000 --seed=0 --evaluate_every=500000 "
    "--hp=directions=16 --hp=rate=0.05`"
)


def publish_evo(studies, notes="", **cells_of_row):
    """Commit two seeds of an algorithm of a package that is not installed, with scores; return their folder."""
    folder = studies / "top-evo.ars"
    twins = [run("tick", "sac", 1_000_000, seed)._replace(label="evo:ars") for seed in (0, 1)]
    for twin in twins:
        publish(folder, twin, constant(100.0, 200.0))
    rows = [{"run": twin.name, "seed": twin.configuration.seed, **EVO, **cells_of_row} for twin in twins]
    csv_files.write(folder / results.RUNS, results.RUN_COLUMNS, rows)
    scores = [RunScore("tick", "walk", seed, 204.5, -0.6, 1.0, 0.5, 0.1, notes=notes) for seed in (0, 1)]
    benchmark.write(studies, "top", "evo.ars", scores)
    return folder


@pytest.mark.parametrize("notes", ["", "source unknown"])
def test_rows_need_no_algorithm_of_another_package(tmp_path, notes):
    """Its command has all hyperparameters, as nobody knows their defaults; scores tell whether it has a source."""
    published = publish_evo(tmp_path, notes)
    shutil.copytree(COMMITTED / "imitation", tmp_path / "imitation")
    shutil.copytree(COMMITTED / "top-sb3_ppo", tmp_path / "top-sb3_ppo")
    leaderboard.write(tmp_path)
    page = (tmp_path / "README.md").read_text()
    row = cells(page, "tick, walk", "evo:ars")
    assert row[2:8] == ["-", "-", "2", "204.5", "-", "204.5, 204.5"]
    notes_of_row = f"ten episodes; judged on seeds from 0 on; {notes}".strip("; ")
    assert row[15:] == [notes_of_row, "[top-evo.ars](top-evo.ars/README.md)", EVO_COMMAND]
    assert cells(page, "tick, walk", "dagger")[16] == "[imitation](imitation/README.md)"
    study = catalog.committed_study("top-evo.ars", published)
    assert study.title == "division top of the benchmark: evo:ars, 2 of 30 runs"
    (tmp_path / "top-evo.ars" / results.RUNS).unlink()
    with refused(f"{published}: holds no runs, and so has no report; ", begins=True):
        catalog.committed_study("top-evo.ars", published)


def test_an_algorithm_that_uses_what_a_division_does_not_give_is_noted(tmp_path):
    published = publish_evo(tmp_path, "source unknown", sources='["a demonstrator"]')
    (row,) = leaderboard.study_rows("top-evo.ars", published)
    assert row["notes"] == "ten episodes; judged on seeds from 0 on; source unknown; has used a demonstrator"


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"algorithm": "evo:cma"}, "expected the algorithm evo.ars of the folder's name, got evo.cma"),
        ({"hyperparameters": "[1"}, "damaged: "),
        ({"robot": "quen"}, "unknown robot 'quen'; did you mean 'queen'?"),
    ],
)
def test_a_damaged_table_of_another_package_is_one_line(tmp_path, changes, line):
    published = publish_evo(tmp_path, **changes)
    with pytest.raises(ValueError, match=r"top-evo.ars.runs.csv: damaged: ") as error:
        leaderboard.write(tmp_path)
    assert line in str(error.value) and str(published) in str(error.value)


@pytest.mark.slow
def test_reports_of_other_packages_are_written_from_their_tables(tmp_path):
    publish_evo(tmp_path / "studies")
    programs.passed(programs.tool("study", "top-evo.ars", "--report", cwd=tmp_path))
    page = (tmp_path / "studies" / "top-evo.ars" / report.REPORT).read_text()
    level = anchors.committed_levels(run("tick", "sac", 1).configuration.setup, range(10))["zero"]
    assert cells(page, "tick, walk", "evo:ars", "0")[3:] == ["1,000,000 of 1,000,000", "3.0", EVO_COMMAND]
    assert cells(page, "tick, walk", "standing still")[4] == f"{level.mean:.1f} +- {level.error:.1f}"


def test_the_committed_leaderboard_is_made_of_committed_tables(tmp_path):
    for name in NAMES:
        shutil.copytree(COMMITTED / name, tmp_path / name)
    leaderboard.write(tmp_path)
    for name in (leaderboard.PAGE, leaderboard.TABLE):
        assert (tmp_path / name).read_text() == (COMMITTED / name).read_text(), name


@pytest.mark.parametrize("name", NAMES)
def test_scores_follow_from_the_anchors_that_a_report_prints(name):
    """Each score of a committed report, as a reader computes it."""
    page = (COMMITTED / name / report.REPORT).read_text()
    section = page.partition("## Final returns")[2].partition("## Sample efficiency")[0]
    _, _, *lines = [line.strip("| ").split(" | ") for line in section.splitlines() if line.startswith("|")]
    means = {}
    for place, label, *_, returns, _, _, score, _, notes in lines:
        if notes.startswith("anchor "):
            assert " +- " in returns and score in ("0.00", "1.00")
            means[place, notes, label == "standing still"] = float(returns.split(" +- ")[0])
    for place, label, steps, *_, returns, _, _, score, _, notes in lines:
        if steps == "-":
            continue
        episodes = 10 if "ten episodes" in notes else 100
        kinds = [f"anchor for {episodes} episodes"]
        if "judged on seeds from 0 on" not in notes:
            kinds.append("anchor of the benchmark")
        (kind,) = (kind for kind in kinds if (place, kind, True) in means)
        zero, best = means[place, kind, True], means[place, kind, False]
        assert float(score) == pytest.approx((float(returns) - zero) / (best - zero), abs=0.0052), (place, label)


def test_runs_of_before_say_so_and_judged_ones_do_not():
    judged = set()
    for name in NAMES:
        judged |= {(name, row["run"]) for row in csv_files.read(COMMITTED / name / results.FINALS)}
    for name in NAMES:
        published = COMMITTED / name
        for result in results.read_results(catalog.committed_study(name, published).runs, published):
            is_judged = (name, result.run.name) in judged
            assert (results.SEEN_SEEDS in result.notes) != is_judged, (name, result.run.name)
            assert results.NOT_JUDGED not in result.notes
    rows = csv_files.read(COMMITTED / leaderboard.TABLE, leaderboard.HEADS)
    noted = {row["study"] for row in rows if results.SEEN_SEEDS in row["notes"]}
    assert noted == set(NAMES) - {name for name, _ in judged}


def test_the_leaderboard_and_the_benchmark_have_one_score():
    """That of the mean over seeds, and the same notes on runs of before."""
    for name in NAMES:
        division, _, learner = name.partition("-")
        scores = benchmark.read(COMMITTED).get((division, learner), [])
        for row in leaderboard.study_rows(name, COMMITTED / name) if scores else ():
            place_scores = [score for score in scores if str(score.setup) == row["robot, task"]]
            mean = sum(score.score for score in place_scores) / len(place_scores)
            assert row["score"] == f"{mean:z.2f}"
            assert {score.notes or "-" for score in place_scores} == {row["notes"]}


@pytest.mark.long
def test_committed_reports_are_made_of_committed_tables(tmp_path):
    """Nobody has changed a number."""
    shutil.copytree(COMMITTED, tmp_path / "studies")
    assert NAMES
    for name in NAMES:
        reports.write(name, catalog.study(name), tmp_path / "studies" / name)
    for path in (f"{name}/README.md" for name in NAMES):
        assert (tmp_path / "studies" / path).read_text() == (COMMITTED / path).read_text(), path
