"""The benchmark: its divisions are studies, its scores come from published tables, its table says what was run."""

import functools
import os
import pathlib
import shutil
import subprocess
import sys

import numpy as np
import programs
import pytest
from refusals import refused
from tqdm import tqdm

from arc_suite import evaluation
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors, judging
from arc_suite.learning.agents import algorithms
from arc_suite.learning.studies import benchmark, csv_files, entries, publication, results, tables
from arc_suite.learning.studies.benchmark import RunScore
from arc_suite.learning.studies.divisions import FAR, PLACES, SEEDS, place_setup
from arc_suite.learning.studies.results import RunResult
from arc_suite.policies import frozen
from arc_suite.policies.network import PACKAGED
from arc_suite.tasks import TASKS

ROOT = pathlib.Path(__file__).parents[3]
COMMITTED = ROOT / "studies"
# The presets that collect on the division of demonstrations.
PRESETS = {"walk": "medium", "steer": "reactive", "rough": "surefooted", "gaps": "sighted", "navigate": "planned"}


def test_there_are_ten_places():
    assert len(set(PLACES)) == 10 and set(FAR) < set(TASKS)


@pytest.mark.parametrize(
    ("name", "steps", "far", "prior"),
    [
        ("top-ppo", 1_000_000, 3_000_000, None),
        ("samples-sac_parallel", 100_000, 100_000, None),
        ("demonstrations-sope", 100_000, 100_000, PRESETS),
    ],
)
def test_a_track_is_a_study(name, steps, far, prior):
    study = tables.study(name)
    assert len(study.runs) == SEEDS * len(PLACES)
    assert [each.configuration.seed for each in study.runs] == sorted(each.configuration.seed for each in study.runs)
    for each in study.runs:
        setup = each.configuration.setup
        task = setup.kind.name
        assert each.configuration.steps == (far if task in FAR else steps)
        assert setup == place_setup(setup.name, task) and bool(setup.task_kwargs) == (task in ("rough", "gaps"))
        if prior is None:
            assert each.prior is None
        else:
            assert each.prior == (prior[task], 100)


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("top-dagger", "algorithm dagger learns from a demonstrator, and the division top takes those that learn "),
        ("samples-sope", "algorithm sope learns from prior data, and the division samples takes those that learn "),
        (
            "demonstrations-ppo",
            "algorithm ppo learns from nothing, and the division demonstrations takes those that learn ",
        ),
        ("samples-pppo", "unknown algorithm 'pppo'; did you mean 'ppo'?"),
    ],
)
def test_a_track_takes_algorithms_that_learn_from_what_it_gives(name, line):
    with refused(line, begins=True):
        tables.study(name)


def scale(robot="tick", task="walk"):
    return anchors.anchors(tables.run(robot, "sac", 100, task=task).configuration.setup)


def result(levels, steps=(50_000, 100_000), **fields):
    """Result of a run of SAC on Tick whose evaluations have these scores."""
    returns = np.array([[scale().at(level)] * 10 for level in levels])
    style = {"gait_compliance": np.full(10, 0.9), "heading_error": np.array([np.nan, *[0.2, -0.2] * 4, 0.2])}
    run = tables.run("tick", "sac", 100_000, **fields)
    finals = returns[-1]
    result = RunResult(run, np.array(steps), returns, finals, {}, np.array([60.0, 180.0]), style, np.empty(0))
    return result._replace(policy_sha256="ab" * 32, seeds=range(4_200_000_000, 4_200_000_010))


def test_a_score_is_that_of_the_end_and_minutes_are_those_of_the_first_half():
    (score,) = benchmark.score_results([result([0.6, 0.4])])
    assert (score.robot, score.task, score.seed) == ("tick", "walk", 0)
    assert score.result == pytest.approx(scale().at(0.4)) and score.score == pytest.approx(0.4)
    assert score.minutes == 1.0 and score.notes == "ten episodes"
    assert (score.gait_compliance, score.heading_error) == (pytest.approx(0.9), pytest.approx(0.2))
    (slow,) = benchmark.score_results([result([0.1, 0.4], seed=1)])
    assert slow.minutes == np.inf and slow.seed == 1
    assert (slow.policy_sha256, slow.first_seed) == ("ab" * 32, 4_200_000_000)


def test_a_curve_has_the_steps_that_all_seeds_have():
    often = result([0.1, 0.2, 0.3, 0.4], steps=(32, 64, 96, 128))
    seldom = result([0.5, 0.6], steps=(64, 128), seed=1)
    steps, means = results.curve([often, seldom])
    np.testing.assert_array_equal(steps, [64, 128])
    np.testing.assert_allclose(means, scale().at(np.array([[0.2, 0.4], [0.5, 0.6]])))
    np.testing.assert_array_equal(results.curve([often])[0], often.steps)


def test_a_label_that_is_no_name_of_a_folder_is_refused(monkeypatch):
    runs = (tables.run("tick", "sac", 100, label="lr/2"),)
    monkeypatch.setitem(globals(), "sliced", tables.Study("Rates", runs))
    message = f"study '{__name__}:sliced': label 'lr/2': expected no /, as it names a folder; 'lr-2' is one"
    with refused(message):
        tables.study(f"{__name__}:sliced")


def test_scores_of_ten_episodes_are_those_of_their_seeds():
    """In the first ten episodes of `steer`, Tick earns more by standing than in all hundred."""
    unpaired = result([0.0, 0.0], task="steer")._replace(finals=np.full(10, 1547.4))
    paired = unpaired._replace(seeds=range(10))
    scores = [score.score for score in benchmark.score_results([unpaired, paired])]
    assert scores == [scale(task="steer").score(1547.4), pytest.approx(0.095, abs=5e-4)] and scores[0] > 0.14


def test_runs_from_before_are_scored_by_the_episodes_of_their_seeds():
    before = result([0.6, 0.4])._replace(policy_sha256="", seeds=range(10))
    (score,) = benchmark.score_results([before])
    paired = anchors.of_returns(anchors.committed_returns(before.run.configuration.setup), range(10))
    assert score.score == paired.score(before.final)
    assert "judged on seeds from 0 on" in score.notes


def test_no_score_is_cut_and_unfinished_runs_have_none():
    low, high = benchmark.score_results([result([0.0, -3.0]), result([0.0, 9.0])])
    assert (low.score, high.score) == (pytest.approx(-3.0), pytest.approx(9.0))
    assert benchmark.score_results([result([0.0, 0.5], steps=(50_000, 90_000))]) == []


def test_a_run_of_more_steps_than_its_division_gives_has_no_score():
    """Slices end a little later than evaluations are due: 100,352 steps are those of `ppo`."""
    assert len(benchmark.score_results([result([0.0, 0.5], steps=(50_000, 100_352))])) == 1
    with pytest.raises(ValueError) as caught:
        benchmark.score_results([result([0.0, 0.5], steps=(50_000, 200_000))])
    assert str(caught.value) == (
        "run tick-walk-sac-0: expected 100,000 steps, at most 105,000, made 200,000; yield a slice at the latest at "
        "context.next_evaluation; steps of context.count_steps count, too; then remove the folder tick-walk-sac-0 of "
        "the runs, and train again"
    )


def test_an_unknown_source_is_noted(monkeypatch):
    """A division takes an algorithm of another package that declares none, and the table says so."""
    unknown = algorithms.ALGORITHMS["sac"]._replace(source="unknown")
    monkeypatch.setitem(algorithms.ALGORITHMS, "sac", unknown)
    assert len(tables.study("samples-sac").runs) == 30
    (score,) = benchmark.score_results([result([0.0, 0.5])])
    assert score.notes == "ten episodes; source unknown"


def test_headings_are_not_judged_where_commands_turn():
    (score,) = benchmark.score_results([result([0.1, 0.2], task="steer")])
    assert np.isnan(score.heading_error) and score.gait_compliance == pytest.approx(0.9)


def score(place, seed, level, minutes=2.0):
    return RunScore(*place, seed, 1000.0, level, minutes, 0.8, 0.1)


def row(page, learner):
    (line,) = (line for line in page.splitlines() if line.split(" | ")[1:2] == [learner])
    return line.strip("| ").split(" | ")


def test_the_table_says_what_was_not_run(tmp_path):
    """One seed or two have no interval, and a part of the places no total."""
    whole = [score(place, 0, 0.1 * index) for index, place in enumerate(PLACES)]
    again = [score(place, 1, 0.1 * index + 0.02, np.inf) for index, place in enumerate(PLACES)]
    written = {("samples", "part"): whole[2:3], ("samples", "two"): [*whole, *again], ("top", "one"): whole}
    for owner, scores in ((("top", "one"), again), *written.items()):  # the last replaces the first
        benchmark.write(tmp_path, *owner, scores)
    assert benchmark.read(tmp_path) == written
    page = benchmark.text(tmp_path)
    assert [line.split(" | ")[:2] for line in page.splitlines()[2:]] == [
        ["| top", "one"],
        ["| samples", "two"],
        ["| samples", "part"],
    ]
    few = "10 of 10 places have fewer than 3 seeds"
    one = ["top", "one", "1", "0.450", "queen walk 0.00", "2.0", "0.800", "0.100"]
    assert row(page, "one") == [*one, *(f"{0.1 * index:.2f}" for index in range(10)), few]
    two = row(page, "two")
    assert two[2] == "2" and two[3] == "0.460" and two[5] == "-"
    assert two[8:10] == ["0.01 (0.00, 0.02)", "0.11 (0.10, 0.12)"]
    assert row(page, "part")[2:5] == ["1", "1 of 10 places", "tick walk 0.20"]
    assert row(page, "part")[8:] == ["not run", "not run", "0.20", *["not run"] * 7, few]


def complete(levels):
    """Three seeds in every place, at these levels by place and 0.9 elsewhere."""
    return [score(place, seed, levels.get(place, 0.9) + 0.01 * seed) for place in PLACES for seed in range(SEEDS)]


def test_weak_places_lower_the_total(tmp_path):
    """However few they are: the interquartile mean of all runs left them out."""
    weak = dict.fromkeys([("queen", "steer"), ("tick", "steer")], -0.5)
    benchmark.write(tmp_path, "top", "even", complete({}))
    benchmark.write(tmp_path, "top", "weak", complete(weak))
    even, poor = (row(benchmark.text(tmp_path), name) for name in ("even", "weak"))
    # Welch and Satterthwaite: 20 degrees of freedom, 2.086 standard errors, each 0.01 / sqrt(30).
    assert (even[3], even[4], even[-1]) == ("0.910 [0.906, 0.914]", "queen walk 0.91", "-")
    assert (poor[3], poor[4], poor[-1]) == ("0.630 [0.626, 0.634]", "queen steer -0.49", "-")
    groups = [[each.score for each in complete(levels)] for levels in ({}, weak)]
    assert evaluation.interquartile_mean(groups[0]) - evaluation.interquartile_mean(groups[1]) < 0.01


def test_the_committed_total_sees_its_weakest_places():
    scores = benchmark.read(COMMITTED)["samples", "sac_parallel"]
    weak = [each._replace(score=-1.0) if each.task == "steer" and each.robot != "leaper" else each for each in scores]
    (before, _), (after, _) = (benchmark.total(benchmark.group_by_place(each)) for each in (scores, weak))
    assert after < before - 0.15


def test_notes_of_scores_stand_in_the_table_once(tmp_path):
    noted = [each._replace(notes="training data unknown") for each in complete({})[:2]]
    benchmark.write(tmp_path, "top", "theirs", [*noted, *complete({})[2:]])
    assert row(benchmark.text(tmp_path), "theirs")[-1] == "training data unknown"


def test_runs_of_an_earlier_model_are_noted(tmp_path):
    """A run commits the hash of its model, and the table compares it with that of the code."""
    (now,) = benchmark.score_results(
        [result([0.1, 0.2])._replace(physics_sha256=results.hash_physics(Setup.of("tick")))]
    )
    (earlier,) = benchmark.score_results([result([0.1, 0.2], seed=1)._replace(physics_sha256="0" * 64)])
    unknown = score(("tick", "walk"), 2, 0.2)
    # The policies of a test are one.
    now, earlier = (each._replace(policy_sha256="") for each in (now, earlier))
    few = "10 of 10 places have fewer than 3 seeds"
    for scores, note in (
        ([now, unknown], ""),
        ([now, earlier], "; earlier model: 1 of 2 runs"),
        ([earlier], "; earlier model"),
    ):
        benchmark.write(tmp_path, "samples", "mine", [each._replace(notes="") for each in scores])
        assert row(benchmark.text(tmp_path), "mine")[-1] == few + note


def test_a_run_of_other_settings_is_compared_with_the_model_of_these(tmp_path):
    """Ground of two places has become harder since: that is no earlier model."""
    easier = Setup.of("tick", "rough")
    learned = result([0.1, 0.2], task="rough")._replace(other_settings=True)
    for sha256, notes in ((results.hash_physics(easier), []), ("0" * 64, [results.EARLIER_MODEL])):
        (scored,) = benchmark.score_results([learned._replace(physics_sha256=sha256)])
        assert scored.setup == easier and results.EASIER_GROUND in scored.notes
        benchmark.write(tmp_path, "samples", "mine", [scored])
        assert benchmark.read(tmp_path)["samples", "mine"] == [scored]
        few, *noted = row(benchmark.text(tmp_path), "mine")[-1].split("; ")
        assert noted == ["ten episodes", results.EASIER_GROUND, *notes]


def test_copies_of_a_policy_are_no_seeds(tmp_path):
    """Within a place; one policy of several places has a seed in each."""
    copies = [each._replace(policy_sha256="ab" * 32) for each in complete({})]
    twins = [*copies[:2], *(each._replace(policy_sha256=f"{index:064x}") for index, each in enumerate(copies[2:]))]
    universal = [each._replace(policy_sha256=f"{each.seed:064x}") for each in complete({})]
    for name, scores, note in (
        ("copies", copies, results.SAME_POLICY),
        ("twins", twins, results.SAME_POLICY),
        ("universal", universal, "-"),
        ("unknown", complete({}), "-"),
    ):
        benchmark.write(tmp_path, "top", name, scores)
        assert row(benchmark.text(tmp_path), name)[-1] == note


def test_places_with_more_seeds_weigh_no_more(tmp_path):
    whole = [score(place, 0, 0.1 * index) for index, place in enumerate(PLACES)]
    more = [score(PLACES[-1], seed, 0.0, np.inf) for seed in (2, 1)]
    for name, scores in (("once", whole), ("more", [*more, *whole])):
        benchmark.write(tmp_path, "top", name, scores)
    once, uneven = (row(benchmark.text(tmp_path), name) for name in ("once", "more"))
    assert (once[2], uneven[2]) == ("1", "1 to 3")
    assert (once[3], uneven[3]) == ("0.450", "0.390")
    assert (once[-2], uneven[-2]) == ("0.90", "0.30 (0.90, 0.00, 0.00)"), "a place holds the mean over all its seeds"
    assert uneven[5:-2] == once[5:-2]
    assert uneven[-1] == "9 of 10 places have fewer than 3 seeds"


def test_damaged_scores_are_one_line(tmp_path):
    (tmp_path / benchmark.SCORES).write_text("robot,task\n")
    with pytest.raises(ValueError, match=r"scores.csv: expected lines of division, learner, robot, task, "):
        benchmark.text(tmp_path)
    cells = dict.fromkeys(benchmark.COLUMNS, "1") | {"division": "top", "result": "abc"}
    for changes, line in (({}, "could not convert"), ({"division": "tpo"}, "unknown division 'tpo'; did you mean")):
        (tmp_path / benchmark.SCORES).write_text(f"{','.join(cells)}\n{','.join((cells | changes).values())}\n")
        with pytest.raises(ValueError, match=rf"scores.csv: {line}"):
            benchmark.text(tmp_path)


def run(*arguments, cwd):
    return programs.run("-m", "arc_suite", "benchmark", *arguments, cwd=cwd, path=ROOT / "tests" / "fixtures")


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["tops"], "unknown division 'tops'; did you mean 'top'? (there are: top, samples, demonstrations)"),
        (["top", "--places=tick-wlak"], "unknown place 'tick-wlak'; did you mean 'tick-walk'?"),
        (["top", "--algorithm=bc"], "algorithm bc learns from prior data, and the division top takes those that "),
        (["top", "--policies=."], ".: expected policies named ROBOT-TASK-SEED, such as tick-walk-0.zip, got none"),
        (["top", "--policies=.", "--name=a/b"], "name a/b: expected letters, digits, _, - and ."),
        (["top", "--policies=none"], "cannot read none: no such file or directory"),
        ([], "studies: no scores of the benchmark; run a division, or name another folder by --results"),
    ],
)
def test_errors_are_one_line(tmp_path, arguments, line):
    done = run(*arguments, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (1, "") and done.stderr.count("\n") == 1, done.stderr
    assert done.stderr.startswith(f"arc-suite benchmark: {line}")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("tick-wlk-1.npz", "expected ROBOT-TASK-SEED of a place and a seed from 0 to 2, such as tick-walk-1.npz"),
        ("leaper-walk-7.zip", "expected ROBOT-TASK-SEED of a place and a seed from 0 to 2, such as leaper-walk-2.zip"),
        ("tick-walk-1.ZIP", "expected ROBOT-TASK-SEED of a place and a seed from 0 to 2, such as tick-walk-1.zip"),
        ("queen-gap.py", "expected ROBOT-TASK-SEED of a place and a seed from 0 to 2, such as queen-gaps-2.py"),
        ("tick-walk-0.py", "expected one policy of this place and seed, got tick-walk-0.npz, too"),
        ("tick-walk-01/policy.npz", "expected ROBOT-TASK-SEED of a place and a seed from 0 to 2, such as tick-walk-1"),
    ],
)
def test_policies_of_other_names_are_refused_before_any_plays(tmp_path, name, line):
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    for each in (path, tmp_path / "tick-walk-0.npz"):
        each.write_bytes(b"")
    with refused(f"{tmp_path / name.partition('/')[0]}: {line}"):
        entries.find_policies(tmp_path)


MODULE = """
import pathlib
import numpy as np

def make(robot):
    action = np.load(pathlib.Path(__file__).with_suffix(".npy"))
    return lambda timestep: action
"""


def test_modules_of_a_folder_play_other_episodes(tmp_path):
    for seed in range(3):
        (tmp_path / f"tick-walk-{seed}.py").write_text(MODULE)

    def first_seeds():
        with frozen.freeze(tmp_path) as copy:
            hashes = [entries.hash_module(copy, f"tick-walk-{seed}.py") for seed in range(3)]
        return [judging.seeds_of(sha256).start for sha256 in hashes]

    before = first_seeds()
    assert before == first_seeds() and len(set(before)) == 3
    (tmp_path / "weights.npy").write_bytes(b"1")
    assert not set(before) & set(first_seeds()), "all files of the folder count"


@pytest.mark.parametrize(
    ("row", "changes"),
    [(3, {"seed": "7"}), (0, {"policy_sha256": "cd" * 32}), (99, None)],
    ids=["seed", "hash", "fewer"],
)
def test_edited_episodes_of_judged_policies_are_refused(tmp_path, row, changes):
    sha256 = "ab" * 32
    fields = {"policy_sha256": sha256, "return": "300.5", "length": "9"}
    fields |= {f"style_{metric}": "0.1" for metric in benchmark.STYLE}
    lines = [fields | {"seed": str(seed)} for seed in judging.seeds_of(sha256)]
    entry = score(("tick", "walk"), 0, 0.5)._replace(policy_sha256=sha256)
    publication.write_finals(tmp_path, {"tick-walk-0": lines})
    (again,) = entries.score_anew([entry], tmp_path)
    assert again.result == 300.5
    lines[row : row + 1] = [] if changes is None else [lines[row] | changes]
    publication.write_finals(tmp_path, {"tick-walk-0": lines})
    with refused(f"{tmp_path / 'finals.csv'}: damaged: tick-walk-0: expected 100 episodes ", begins=True):
        entries.score_anew([entry], tmp_path)


@pytest.mark.long
def test_modules_are_scored_and_what_is_no_policy_is_left_out(tmp_path, monkeypatch):
    """A module acts by the weights next to it; this one stands still, for one episode."""
    monkeypatch.setattr(judging, "EPISODES", 1)
    monkeypatch.setattr(evaluation, "CURVE_EPISODES", 1)
    (tmp_path / "tick-walk-2.py").write_text(MODULE)
    np.save(tmp_path / "tick-walk-2.npy", np.zeros(18))
    for name in ("README.md", ".hidden.py", "_helpers.py", "tick-walk-2_vecnormalize.pkl", "studies/other.zip"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(b"")
    paths_by_run = entries.find_policies(tmp_path)
    (judged,) = entries.score_policies(tmp_path, paths_by_run, functools.partial(tqdm, disable=True))
    found = judged.score
    assert found[:3] == ("tick", "walk", 2) and found.score == pytest.approx(0.0, abs=0.05)
    with frozen.freeze(tmp_path) as copy:
        assert found.policy_sha256 == entries.hash_module(copy, "tick-walk-2.py")
    assert found.first_seed == judging.seeds_of(found.policy_sha256).start >= 4_100_000_000
    (episode,) = judged.lines
    assert episode["seed"] == str(found.first_seed) and float(episode["return"]) == found.result
    publication.write_finals(tmp_path / "top-theirs", {found.policy_name: judged.lines})
    assert repr(entries.score_anew([found._replace(score=9.0, result=0.0)], tmp_path / "top-theirs")) == repr([found])
    with refused(f"{tmp_path / 'top-none' / 'finals.csv'}: damaged", begins=True):
        entries.score_anew([found], tmp_path / "top-none")


@pytest.mark.release
def test_policies_of_others_are_scored(tmp_path):
    """Those of the package stand for them; what is no policy of a place is left out."""
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs" / "tick-walk-1.npz").write_bytes((PACKAGED / "tick-walk.npz").read_bytes())
    (tmp_path / "theirs" / "notes.txt").write_text("")
    done = run("samples", "--policies=theirs", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    (found,) = benchmark.read(tmp_path / "studies")["samples", "theirs"]
    assert (found.robot, found.task, found.seed) == ("tick", "walk", 1)
    assert found.score == pytest.approx(scale().score(found.result)) and found.score > 0.9
    assert np.isnan(found.minutes) and found.gait_compliance > 0.95 and found.heading_error < 0.2
    first_line = "theirs: 1 of the 30 policies of an entry, 100 episodes each"
    assert done.stdout == f"{first_line}\n{benchmark.text(tmp_path / 'studies')}\n"
    assert row(done.stdout, "theirs")[4:6] == ["tick walk 1.01", "-"]  # the lowest place, and minutes that nobody knows


FAILING = """
import dataclasses

import arc_suite
from arc_suite.learning.agents.algorithms import Algorithm

@dataclasses.dataclass(frozen=True)
class Settings:
    rate: float = 0.1

def learn(hp, context):
    raise ValueError("nothing to learn")

fail = Algorithm(learn, Settings(), "fails", source="nothing")
arc_suite.register(module=__name__, algorithms={"fail": fail})
"""


@pytest.mark.slow
def test_a_failed_run_has_the_last_line(tmp_path):
    (tmp_path / "failing.py").write_text(FAILING)
    done = run("samples", "--algorithm=failing:fail", "--places=tick-walk", "--seeds=1", "--jobs=1", cwd=tmp_path)
    assert done.returncode == 1 and done.stdout.endswith("0 of 1 finished, 1 failed\n")
    log = "runs/samples-failing.fail/tick-walk-failing.fail-0.log"
    assert f"tick-walk-failing.fail-0: running, {log}\n" in done.stdout
    last_line = done.stderr.splitlines()[-1]
    assert last_line.startswith(f"{log}: ") and "nothing to learn" in last_line


SHORT = """
import sys
from arc_suite.learning.studies import divisions
divisions.DIVISIONS["samples"] = divisions.Division(300, 300)
from arc_suite.cli import program
from arc_suite.learning.cli import benchmark
program.run(benchmark.main, "benchmark", sys.argv[1:])
"""


@pytest.mark.release
def test_a_track_is_run_and_resumed(tmp_path):
    """A division of 300 steps, by an algorithm that needs no JAX; the second command has nothing left to do."""
    environ = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "tests" / "fixtures")])}
    (tmp_path / "short.py").write_text(SHORT)
    command = [sys.executable, "short.py", "samples", "--algorithm=tiny_studies:climb", "--places=tick-walk"]

    def go():
        done = subprocess.run(
            [*command, "--seeds=1", "--jobs=1"], env=environ, cwd=tmp_path, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    printed = go()
    (found,) = benchmark.read(tmp_path / "studies")["samples", "tiny_studies.climb"]
    folder = tmp_path / "studies" / "samples-tiny_studies.climb"
    (row,) = csv_files.read(folder / results.RUNS)
    assert row["steps"] == "300"
    rows = csv_files.read(folder / results.FINALS)
    assert found.result == pytest.approx(np.mean([float(each["return"]) for each in rows]))
    assert [int(each["seed"]) for each in rows] == list(judging.seeds_of(found.policy_sha256))
    assert (folder / "README.md").is_file() and printed.count("not run") == 9
    names = (results.EVALUATIONS, results.FINALS)
    tables = [(folder / name).read_bytes() for name in names]
    go()
    assert [(folder / name).read_bytes() for name in names] == tables


@pytest.mark.parametrize(
    ("name", "table", "changes", "line"),
    [
        ("samples-xqc", results.FINALS, {"seed": "7"}, "queen-walk-xqc-0: expected 100 episodes from seed 4"),
        ("top-sb3_ppo", results.FINALS, {"seed": "7"}, "tick-walk-0: expected 100 episodes from seed 4"),
        (
            "samples-xqc",
            results.RUNS,
            {"sources": '["a policy"]'},
            "queen-walk-xqc-0: expected no source, got a policy",
        ),
    ],
)
def test_the_table_is_refused_where_tables_of_runs_are_edited(tmp_path, name, table, changes, line):
    shutil.copy(COMMITTED / benchmark.SCORES, tmp_path)
    shutil.copytree(COMMITTED / name, tmp_path / name)
    assert benchmark.text(tmp_path) == benchmark.text(COMMITTED)
    path = tmp_path / name / table
    rows = csv_files.read(path)
    csv_files.write(path, list(rows[0]), [rows[0] | changes, *rows[1:]])
    with refused(f"{path}: damaged: {line}", begins=True):
        benchmark.text(tmp_path)


def test_an_algorithm_without_a_declaration_may_use_any_source(tmp_path):
    shutil.copy(COMMITTED / benchmark.SCORES, tmp_path)
    shutil.copytree(COMMITTED / "samples-xqc", tmp_path / "samples-xqc")
    path = tmp_path / "samples-xqc" / results.RUNS
    rows = csv_files.read(path)
    csv_files.write(path, list(rows[0]), [row | {"sources": '["a policy"]'} for row in rows])
    scores = benchmark.read(tmp_path)["samples", "xqc"]
    undeclared = [score._replace(notes=results.UNKNOWN_SOURCE) for score in scores]
    benchmark.write(tmp_path, "samples", "xqc", undeclared)
    assert results.UNKNOWN_SOURCE in benchmark.text(tmp_path)


@pytest.mark.parametrize("name", [f"{division}-{learner}" for division, learner in benchmark.read(COMMITTED)])
def test_committed_scores_are_those_of_committed_results(name):
    committed = benchmark.read(COMMITTED)[tuple(name.split("-", 1))]
    if (COMMITTED / name / results.RUNS).exists():
        expected = benchmark.score_results(results.read_results(tables.study(name).runs, COMMITTED / name))
    else:
        expected = entries.score_anew(committed, COMMITTED / name)
    for one, other in zip(committed, expected, strict=True):
        assert one[:3] == other[:3] and one[3:8] == pytest.approx(other[3:8], nan_ok=True) and one[8:] == other[8:]
