"""Reports of studies: every number comes from published tables, and says what it should."""

import csv
import pathlib

import numpy as np
import pytest
from published_tables import as_in_the_paper, cells, constant, publish
from refusals import refused

from arc_suite import evaluation, usage
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors, judging, published
from arc_suite.learning.agents import algorithms
from arc_suite.learning.studies import csv_files, publication, report, results
from arc_suite.learning.studies.tables import Study, run

PAPER = pathlib.Path(__file__).parents[3] / "studies" / "paper.csv"


@pytest.fixture
def made(tmp_path):
    """A study as the paper's table of finals would have it, and the folder of its tables."""
    return as_in_the_paper(tmp_path / "mine"), tmp_path / "mine"


@pytest.mark.slow
def test_report(made):
    study, folder = made
    page = report.write("mine", study, folder).read_text()
    assert (folder / "curves.png").stat().st_size > 10_000
    command = (
        "`arc-suite train --robot=tick --task=walk --algorithm=sope --steps=1000000 --seed=0 --evaluate_every=10000`"
    )
    assert cells(page, "tick, walk", "sope", "0")[3:] == ["1,000,000 of 1,000,000", "3.0", command]
    # 3610 and 3611, each with 0 to 9 on top; the anchors of ten episodes are 1640.0 and 3886.1
    final = ["2", "3615.0", "-", "3614.5, 3615.5", "0.88", "3610", f"ten episodes; {results.SEEN_SEEDS}"]
    assert cells(page, "tick, walk", "sope", "1,000,000")[3:] == final
    # The study has measured `medium`. Committed anchors count before its others.
    medium = ["2048.0 +- 0.0", "-", "-", "0.19", "2048", "10 episodes"]
    assert cells(page, "queen, walk", "demonstrator medium")[4:] == medium
    standing = ["1634.8 +- 1.7", "-", "-", "0.00", "-", "anchor for 10 episodes"]
    assert cells(page, "queen, walk", "standing still")[4:] == standing
    area = f"{np.mean([104.5, 2594.5, 104.5, 2595.5]):.1f}"
    assert cells(page, "tick, walk", "sac", "-", "-") == ["tick, walk", "sac", "-", "-", "-", "-", area]
    assert cells(page, "tick, walk", "sope", "1,000,000", "3.0")[4:6] == ["1,000,000", "3.0"]
    assert cells(page, "bastion, walk", "sac", "0.500")[2:] == ["0.500"] * 6
    assert "As in the paper.\n" in page
    more = study._replace(runs=(*study.runs, run("tick", "sac", 1_000_000, seed=2)))
    assert "As in the paper. Begun: 48 of 49 runs.\n" in report.write("more", more, folder).read_text()


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


def test_unfinished_evaluations_do_not_count(tmp_path):
    lines = [f"{step},{seed},900.0,40" for step in (1000, 2000, 3000) for seed in range(10)][:-9]
    (tmp_path / "evaluations.csv").write_text("\n".join(["step,seed,return,length", *lines]) + "\n")
    (tmp_path / "times.csv").write_text(
        "step,wall_seconds,cpu_seconds\n1000,1,1.0\n1500,2,2.0\n2000,3,3.0\n3000,4,4.0\n"
    )
    found = publication._complete_evaluations(tmp_path)
    rows = [(row["step"], row["seed"], row["cpu_seconds"]) for row in found]
    assert len(rows) == 20 and rows[9:11] == [("1000", "9", "1.0"), ("2000", "0", "3.0")]


def test_demonstrators_play_where_runs_were_evaluated_alone(tmp_path, monkeypatch):
    """A part of a study, and a shard of it, do not wait for the demonstrators of the other places.

    The benchmark has anchors of its places.
    """
    monkeypatch.setattr(publication, "_anchor_returns", lambda setup: {"zero": np.full(1, len(setup.name))})
    runs = [run(robot, "sac", 1_000_000, task="roam") for robot in ("tick", "queen", "bastion")]
    runs.append(run("tick", "sac", 1_000_000))
    bars = []

    def progress(values, desc, unit, leave):
        bars.append((len(values), unit))
        return values

    for each in (runs[1], runs[3]):
        publish(tmp_path, each, constant(100.0, 200.0))
    publication.publish(runs, tmp_path / "none", tmp_path, progress)
    assert set(results.read_demonstrators(tmp_path)) == {"queen, roam"}
    publish(tmp_path, runs[0], constant(100.0, 200.0))
    publication.publish(runs, tmp_path / "none", tmp_path, progress)
    assert set(results.read_demonstrators(tmp_path)) == {"queen, roam", "tick, roam"}
    assert bars == [(4, "run"), (1, "place")] * 2


def judge(sha256):
    """Return lines of episodes that judge a policy, with the return 300.5 each."""
    fields = {"policy_sha256": sha256, "return": "300.5", "length": "9", "fell": "1.0"}
    return [fields | {"seed": str(seed)} for seed in judging.seeds_of(sha256)]


def test_a_judged_policy_has_the_score_of_the_benchmark(tmp_path):
    new, old = (run("tick", "sac", 1_000_000, seed) for seed in (0, 1))
    for each in (new, old):
        publish(tmp_path, each, constant(100.0, 200.0))
    publication.write_finals(tmp_path, {new.name: judge("ab" * 32)})
    first, second = results.read_results([new, old], tmp_path)
    levels = judging.levels(new.configuration.setup)
    zero, best = levels["zero"].mean, levels["refined"].mean
    assert results.score_of(first) == (300.5 - zero) / (best - zero)
    assert report.score_text([first], {}) == f"{(300.5 - zero) / (best - zero):.2f}"
    of_study = {new.place: {"zero": np.full(100, 0.0), "medium": np.full(10, 2.0 * first.final)}}
    assert results.score_of(first, of_study) == results.score_of(first)
    paired = anchors.of_returns(anchors.committed_returns(old.configuration.setup), range(10))
    assert results.score_of(second, of_study) == paired.score(second.final), "a run from before has committed anchors"


def test_a_place_without_committed_anchors_has_those_of_the_study(tmp_path):
    each = run("tick", "sac", 1_000_000, task="roam")
    publish(tmp_path, each, constant(100.0, 200.0))
    (result,) = results.read_results([each], tmp_path)
    demonstrators = {each.place: {"zero": np.full(10, 0.0), "medium": np.full(10, result.final * 2)}}
    assert report.score_text([result], demonstrators) == "0.50"
    assert report.score_text([result], {}) == "-"


def test_runs_of_other_episodes_have_anchors_of_their_own(tmp_path):
    """A judged run and one of before in one place: what a report prints for each gives its score."""
    new, old = runs = [run("tick", "sac", 1_000_000, seed, "steer", label=f"sac-{seed}") for seed in (0, 1)]
    for each in runs:
        publish(tmp_path, each, constant(100.0, 200.0))
    publication.write_finals(tmp_path, {new.name: judge("ab" * 32)})
    anchors.write(tmp_path / results.DEMONSTRATORS, {new.place: {"zero": np.zeros(10), "steered": np.full(10, 9e3)}})
    page = report.write("mine", Study("mine", tuple(runs)), tmp_path).read_text()
    lines = [line.strip("| ").split(" | ") for line in page.splitlines() if " | anchor " in line]
    assert [line[-1] for line in lines] == ["anchor of the benchmark"] * 2 + ["anchor for 10 episodes"] * 2
    for each, levels in (
        (new, judging.levels(new.configuration.setup)),
        (old, anchors.committed_levels(old.configuration.setup, range(10))),
    ):
        assert [line[4] for line in lines if line[4] == f"{levels['zero'].mean:.1f} +- {levels['zero'].error:.1f}"]
        final = 300.5 if each is new else 204.5
        assert cells(page, each.place, each.kind, "1,000,000")[7] == f"{anchors.of_levels(levels).score(final):z.2f}"
    assert "| 9000.0 +- 0.0 |" in page, "a demonstrator of the study is no anchor"


def test_finals_are_those_that_judge_the_policy(tmp_path):
    """A run from before has the episodes of its last evaluation; its settings are those of its row."""
    new, old = (run("tick", "sac", 1_000_000, seed, "rough", {"rise": 0.1}) for seed in (0, 1))
    for each in (new, old):
        publish(tmp_path, each, constant(100.0, 200.0))
    rows = csv_files.read(tmp_path / results.RUNS)
    rows[1]["task_kwargs"] = "{}"
    csv_files.write(tmp_path / results.RUNS, results.RUN_COLUMNS, rows)
    sha256 = "ab" * 32
    publication.write_finals(tmp_path, {new.name: judge(sha256)})
    first, second = results.read_results([new, old], tmp_path)
    assert first.policy_sha256 == sha256 and first.final == 300.5 and first.progress["fell"].tolist() == [1.0] * 100
    assert list(first.seeds) == list(judging.seeds_of(sha256)) and first.curve_seeds == [*range(10)]
    assert first.run == new and not first.other_settings
    assert second.policy_sha256 == "" and second.final == 204.5 and second.seeds == [*range(10)]
    assert second.other_settings and second.run.place == "tick, rough" != new.place
    assert second.notes == ("ten episodes", results.SEEN_SEEDS, results.EASIER_GROUND) and first.notes == ()


def test_what_an_algorithm_has_used_is_noted_unless_it_declares_it(tmp_path, monkeypatch):
    monkeypatch.setitem(algorithms.ALGORITHMS, "mine", algorithms.ALGORITHMS["sac"]._replace(source=usage.UNKNOWN))
    runs = [run("tick", name, 1_000_000) for name in ("mine", "sope")]
    for each in runs:
        publish(tmp_path, each, constant(100.0, 200.0))

    def set_sources(*cells):
        rows = csv_files.read(tmp_path / results.RUNS)
        rows = [row | {"sources": cell} for row, cell in zip(rows, cells, strict=True)]
        csv_files.write(tmp_path / results.RUNS, results.RUN_COLUMNS, rows)

    set_sources('["a demonstrator", "prior data"]', '["prior data"]')
    mine, declared = results.read_results(runs, tmp_path)
    assert mine.notes == (
        "ten episodes",
        results.SEEN_SEEDS,
        "source unknown",
        "has used a demonstrator",
        "has used prior data",
    )
    assert declared.sources == ["prior data"] and declared.notes == ("ten episodes", results.SEEN_SEEDS)
    set_sources("[]", '["a demonstrator", "prior data"]')
    line = "tick-walk-sope-0: expected no source but prior data, got a demonstrator"
    with refused(f"{tmp_path / 'runs.csv'}: damaged: {line}"):
        results.read_results(runs, tmp_path)


@pytest.mark.parametrize(
    ("table", "row", "changes", "line"),
    [
        (
            results.FINALS,
            3,
            {"seed": "7"},
            "100 episodes from seed [0-9]+ on, which follow from the hash of one policy",
        ),
        (results.FINALS, 0, {"policy_sha256": "cd" * 32}, "100 episodes from seed [0-9]+ on, .* of one policy"),
        (results.FINALS, 99, None, "100 episodes from seed [0-9]+ on, which follow from the hash of one policy"),
        (results.RUNS, 0, {"environment_steps": "999"}, "expected the 1,000,000 steps of evaluations.csv, got 999"),
        (results.RUNS, 0, {"sources": '["a demonstrator"]'}, "expected no source, got a demonstrator"),
        (results.EVALUATIONS, 0, None, r"expected 10 episodes of a step, got \[9, 10\]"),
    ],
    ids=["seed", "hash", "fewer episodes", "steps", "source", "fewer of the curve"],
)
def test_edited_tables_are_refused(tmp_path, table, row, changes, line):
    each = run("tick", "sac", 1_000_000)
    publish(tmp_path, each, constant(100.0, 200.0))
    publication.write_finals(tmp_path, {each.name: judge("ab" * 32)})
    rows = csv_files.read(tmp_path / table)
    columns = list(rows[0])
    rows[row : row + 1] = [] if changes is None else [rows[row] | changes]
    csv_files.write(tmp_path / table, columns, rows)
    for check in (lambda: results.read_results([each], tmp_path), lambda: results.check_tables(tmp_path, "nothing")):
        with pytest.raises(ValueError, match=f"^{tmp_path / table}: damaged: {each.name}: .*{line}"):
            check()


def test_seeds_with_one_policy_are_noted(tmp_path):
    runs = [run("tick", "sac", 1_000_000, seed) for seed in (0, 1)]
    for each in runs:
        publish(tmp_path, each, constant(100.0, 200.0))
    publication.write_finals(tmp_path, {each.name: judge("ab" * 32) for each in runs})
    assert "seeds with one policy" in results.join_notes(results.read_results(runs, tmp_path))


def test_damaged_tables_are_one_line(tmp_path):
    each = run("tick", "sac", 1_000_000)
    publish(tmp_path, each, constant(100.0))
    path = tmp_path / results.EVALUATIONS
    path.write_text(path.read_text() + f"{each.name},1000000,0,1.0,1000,0.3,0.9,1.0,1.0" + 6 * "," + "\n")
    with pytest.raises(ValueError, match=r"evaluations.csv: damaged: "):
        results.read_results([each], tmp_path)


@pytest.mark.slow
def test_the_interval_of_three_seeds_is_students(tmp_path):
    runs = [run("tick", "sac", 1_000_000, seed) for seed in range(3)]
    for level, each in enumerate(runs):
        publish(tmp_path / "mine", each, constant(100.0, 200.0 + level))
    page = report.write("mine", Study("three seeds", tuple(runs)), tmp_path / "mine").read_text()
    # Two degrees of freedom: 4.303 standard errors, each 1 / sqrt(3).
    finals = ["205.5", "[203.0, 208.0]", "204.5, 205.5, 206.5"]
    assert cells(page, "tick, walk", "sac", "1,000,000", "3")[4:7] == finals


@pytest.mark.slow
def test_one_seed_has_no_interval(tmp_path):
    runs = run("tick", "sac", 1_000_000), run("tick", "speq", 1_000_000)
    for each in runs:
        publish(tmp_path / "mine", each, constant(100.0, 200.0))
    page = report.write("mine", Study("one seed each", runs), tmp_path / "mine").read_text()
    finals = ["204.5", "-", "204.5", "-0.64", "2590", f"ten episodes; {results.SEEN_SEEDS}"]
    assert cells(page, "tick, walk", "sac", "1,000,000", "1")[4:] == finals


def test_further_sections_come_last(tmp_path):
    each = run("tick", "sac", 1_000_000)
    publish(tmp_path / "mine", each, constant(100.0, 200.0))
    study = Study("one run", (each,))
    page = report.write("mine", study, tmp_path / "mine").read_text()
    more = report.write("mine", study, tmp_path / "mine", {"Mine": ["One.", "Two."]}).read_text()
    assert more == f"{page}\n## Mine\n\nOne.\n\nTwo.\n"


def test_runs_that_the_paper_has():
    usual = {"robot": "tick", "algorithm": "sac", "steps": 1_000_000}
    others = {"task": "steer"}, {"algorithm": "ppo"}, {"label": "b"}, {"task_kwargs": {"target_velocity": 0.4}}
    found = [results.is_in_paper(_result(run(**usual | other))) for other in ({}, *others)]
    assert found == [True, False, False, False, False]


def _result(run):
    nothing = np.empty(0)
    return results.RunResult(run, nothing, nothing, nothing, {}, nothing, {}, nothing)


def test_until(tmp_path):
    runs = run("tick", "sac", 1_000_000), run("tick", "sac", 1_000_000, 1)
    publish(tmp_path, runs[0], constant(100.0, 900.0))
    publish(tmp_path, runs[1], constant(500.0, 600.0))
    found = results.read_results(runs, tmp_path)
    assert results.cost_of_return(found, 500.0) == (750_000.0, 120.0)
    assert results.cost_of_return(found, 700.0) == (np.inf, np.inf)


def test_nothing_published_is_one_line(tmp_path):
    with pytest.raises(ValueError, match=r"none: holds no results of the study mine$"):
        report.write("mine", Study("none", (run("tick", "sac", 10),)), tmp_path / "none")


def test_the_papers_returns_as_a_table():
    """The file for users' plots holds the suite's own numbers."""
    with PAPER.open(newline="") as file:
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
