"""Studies: eight tiny runs, killed twice, are bit-exactly those of an uninterrupted study, apart from times."""

import contextlib
import dataclasses
import importlib.util
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time
import types

import numpy as np
import programs
import pytest
import tiny_studies
from refusals import refused
from tqdm import tqdm

from arc_suite import data, evaluation, policies, registry, style
from arc_suite.bodies import generator
from arc_suite.envs.dm import load
from arc_suite.evaluation import judging
from arc_suite.learning.agents import configuration, run_folder
from arc_suite.learning.agents.training import train
from arc_suite.learning.studies import csv_files, publication, results, runner
from arc_suite.learning.studies.publication import METRICS
from arc_suite.learning.studies.tables import Prior, run

ROOT = pathlib.Path(__file__).parents[3]
FIXTURES = ROOT / "tests" / "fixtures"


@pytest.fixture
def surroundings(tmp_path):
    """Of programs: where datasets and compiled functions lie, and the tiny studies."""
    return os.environ | {
        "PYTHONPATH": os.pathsep.join([str(ROOT), str(FIXTURES)]),
        "MINARI_DATASETS_PATH": str(tmp_path / "datasets"),
        "JAX_COMPILATION_CACHE_DIR": str(tmp_path / "cache"),
        "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
    }


@pytest.fixture
def begun(surroundings):
    """A function that begins the process of a study, in a group of its own; none outlives the test."""
    processes = []

    def begin(name, folder, jobs):
        command = [sys.executable, "-m", "arc_suite", "study", f"tiny_studies:{name}", f"--jobs={jobs}"]
        command += [f"--runs={folder / 'runs'}", f"--results={folder / 'results'}"]
        process = subprocess.Popen(command, env=surroundings, start_new_session=True, cwd=folder.parent)
        processes.append(process)
        return process

    yield begin
    for process in processes:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def wait_for(count, pattern, folder, process):
    """Wait until so many files are there."""
    while process.poll() is None and len(list(folder.glob(pattern))) < count:
        time.sleep(0.01)
    assert process.poll() is None, "the study has ended before it could be killed"


def contents(folder):
    """Everything that must not depend on jobs and kills: rows of tables without times, and arrays by path."""
    found = {}
    for path in sorted(folder.glob("results/*.csv")):
        for number, row in enumerate(csv_files.read(path)):
            found[f"{path.name}/{number}"] = {name: cell for name, cell in row.items() if name not in results.TIMES}
    for path in sorted(folder.glob("runs/*/[cp]*.npz")):
        with np.load(path) as stored:
            for name in stored.files:
                if name != "progress":
                    found[f"{path.relative_to(folder)}/{name}"] = stored[name].tobytes()
    return found


@pytest.mark.release
@pytest.mark.parametrize("name", ["WITH_NUMPY", "WITH_JAX"])
def test_killed_twice(name, tmp_path, begun):
    """Two jobs make what one makes."""
    if name == "WITH_JAX":
        pytest.importorskip("jax", reason="of the extra learn: make check-agents")
    assert begun(name, tmp_path / "whole", 1).wait() == 0

    for count in (1, 3):
        process = begun(name, tmp_path / "killed", 2)
        wait_for(count, "runs/*/checkpoint.npz", tmp_path / "killed", process)
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    assert begun(name, tmp_path / "killed", 2).wait() == 0

    whole, killed = contents(tmp_path / "whole"), contents(tmp_path / "killed")
    assert len([path for path in whole if path.startswith("runs.csv")]) == 8
    assert whole.keys() == killed.keys()
    assert [path for path in whole if whole[path] != killed[path]] == []


@pytest.mark.release
def test_what_is_finished_is_skipped_and_shards_share(tmp_path, surroundings):
    command = [sys.executable, "-m", "arc_suite", "study", "tiny_studies:WITH_NUMPY", "--jobs=2"]
    command += [f"--runs={tmp_path / 'runs'}", f"--results={tmp_path / 'results'}"]
    names = [each.name for each in tiny_studies.WITH_NUMPY.runs]
    for shard, count in (("0/7", 2), ("1/7", 1)):
        done = subprocess.run([*command, f"--shard={shard}"], env=surroundings, capture_output=True, text=True)
        assert programs.passed(done).endswith(f"{count} of {count} finished\n")
    made = sorted(path.name for path in (tmp_path / "runs").iterdir() if path.is_dir())
    assert made == sorted([names[0], names[7], names[1]])

    first, folder = tiny_studies.WITH_NUMPY.runs[0], tmp_path / "runs"
    assert configuration.read(folder / first.name / "config.json") == first.configuration
    before = (folder / first.name / "checkpoint.npz").stat().st_mtime_ns
    assert runner.make([first], folder, 1) == 0
    assert (folder / first.name / "checkpoint.npz").stat().st_mtime_ns == before

    other = tiny_studies.tiny("tiny_studies:climb", 0, hyperparameters={"spread": 0.3})
    with pytest.raises(ValueError, match=r"of another run, with hyperparameters.spread 0.02, not 0.3; write "):
        runner.is_finished(other, folder / first.name)

    # What is published of the policy's style is what the style room measures of it, also a second time.
    def tables_of():
        return [(tmp_path / "results" / name).read_bytes() for name in ("runs.csv", "evaluations.csv", "finals.csv")]

    tables_before = tables_of()
    publication.publish(tiny_studies.WITH_NUMPY.runs, folder, tmp_path / "results")
    assert tables_of() == tables_before
    published = results.read_results(tiny_studies.WITH_NUMPY.runs, tmp_path / "results")
    assert [each.run.name for each in published] == [names[0], names[1], names[7]]
    for row, result in zip(csv_files.read(tmp_path / "results/runs.csv"), published, strict=True):
        assert int(row["environment_steps"]) + int(row["steps_by_learner"]) == result.steps[-1]
        assert row["sources"] == "[]" and result.sources == []
    environment = load("tick", "walk", tiny_studies.SHORT)
    policy = policies.policy(folder / first.name, "tick")
    for index in (0, 7):
        measured = style.measure(style.record(environment, policy, 9000 + index))
        for name in METRICS:
            assert np.array_equal(published[0].style[name][index], measured[name].value, equal_nan=True)

    # Rows of runs whose folders are gone stay.
    shutil.rmtree(folder / names[0])
    publication.publish(tiny_studies.WITH_NUMPY.runs, folder, tmp_path / "results")
    assert tables_of() == tables_before


@pytest.mark.slow
def test_the_style_is_that_of_the_latest_whole_evaluation(tmp_path):
    """A later policy is there already while its episodes are still played."""
    each = tiny_studies.PAIR.runs[0]
    each = each._replace(configuration=dataclasses.replace(each.configuration, steps=20))
    folder = tmp_path / "runs" / each.name
    assert train(each.configuration, folder)
    publication.publish([each], tmp_path / "runs", tmp_path / "results")
    before = (tmp_path / "results" / "evaluations.csv").read_text()
    (folder / "policy.npz").write_bytes(b"another")
    with (folder / "evaluations.csv").open("a") as file:
        file.write((folder / "evaluations.csv").read_text().splitlines()[1].replace("20,", "40,", 1) + "\n")
    (folder / "style.csv").unlink()
    publication.publish([each], tmp_path / "runs", tmp_path / "results")
    assert (tmp_path / "results" / "evaluations.csv").read_text() == before
    (found,) = results.read_results([each], tmp_path / "results")
    assert found.steps.tolist() == [20]


@pytest.mark.long
def test_a_failed_run_says_why_and_the_others_are_made(tmp_path, surroundings):
    command = ["-m", "arc_suite", "study", "tiny_studies:BROKEN", "--jobs=1"]
    done = subprocess.run([sys.executable, *command], env=surroundings, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 1
    assert done.stdout.endswith("1 of 2 finished, 1 failed\n")
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("runs/")]  # without bars of slow runs
    has_jax = importlib.util.find_spec("jax") is not None
    reason = "prior: the algorithm takes no prior data, got " if has_jax else "training needs JAX: "
    assert line.startswith(f"runs/tiny_studies.BROKEN/tick-walk-sac-0.log: arc-suite train: {reason}")


@pytest.mark.slow
def test_prior_data_are_those_of_the_study(tmp_path, monkeypatch):
    """A dataset that somebody has collected more of is another."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "datasets"))
    each = run("tick", "sacfd", 100, task_kwargs=tiny_studies.SHORT, prior=Prior(episodes=2))
    dataset = each.configuration.prior
    assert runner.prepare([each], tmp_path / "runs", 1) == [each]
    data.collect(dataset, each.prior.settings(each.configuration.setup), 3)
    what = f"dataset {dataset!r} has 3 episodes, and the study takes 2; delete it, to have it collected anew"
    with refused(f"{each.name}: {what}"):
        runner.prepare([each], tmp_path / "runs", 1)


@pytest.mark.release
def test_a_run_is_judged_without_its_settings_of_training(tmp_path):
    own = {"task_kwargs": tiny_studies.SHORT, "training": {"curriculum": True, "level": 3}}
    each = run("tick", "tiny_studies:climb", 100, task="gaps", evaluate_every=100, **own)
    assert each.place == 'tick, gaps, {"time_limit": 2.0}'
    folder, published = tmp_path / "runs", tmp_path / "results"
    assert train(each.configuration, folder / each.name)
    publication.publish([each], folder, published)
    (row,) = csv_files.read(published / results.RUNS)
    assert {name: json.loads(row[name]) for name in own} == own
    table = run_folder.table(folder / each.name, "evaluations")
    assert "distance" in table and "level" not in table
    assert results.read_demonstrators(published).keys() == {each.place}
    with contextlib.closing(load("tick", "gaps", tiny_studies.SHORT)) as environment:
        policy = policies.policy(folder / each.name, "tick", task=environment.task.definition)
        assert evaluation.run(environment, policy, 9004).total == table["return"][4]
    (found,) = results.read_results([each], published)
    assert found.returns[-1].tolist() == table["return"].tolist()
    assert len(found.finals) == evaluation.EPISODES and found.notes == ()
    assert found.policy_sha256 == policies.digest(str(folder / each.name))
    seeds = judging.seeds_of(found.policy_sha256)
    assert list(found.seeds) == list(seeds) and list(found.curve_seeds) == [*range(9000, 9010)]
    judged_setup = judging.setup_of(each.configuration.setup, seeds)
    assert judged_setup.task_kwargs["terrain_seed"] == seeds.start
    with contextlib.closing(judged_setup.load()) as environment:
        assert evaluation.run(environment, policy, seeds[57]).total == found.finals[57]


def test_robots_of_other_packages_and_unknown_ones(monkeypatch):
    body = dataclasses.replace(generator.generate(4, 2), name="creature")
    monkeypatch.setitem(sys.modules, "others", types.ModuleType("others"))
    monkeypatch.setitem(registry.ROBOTS, "creature", body)
    monkeypatch.setitem(registry.MODULE_OF_NAME, ("robot", "creature"), "others")
    each = run("others:creature", "sac", 100)
    assert each.configuration.setup.body is body and each.name == "creature-walk-sac-0"
    assert each.configuration.to_dict()["robot"] == "others:creature"
    with pytest.raises(ValueError, match=r"^unknown robot 'tik'; did you mean 'tick'"):
        run("tik", "sac", 100)


def test_phases_are_published(tmp_path):
    lines = ["step,phase_updates", "1000,0", "2000,300", "3000,0", "4000,75000"]
    (tmp_path / "training.csv").write_text("\n".join(lines) + "\n")
    each = run("tick", "speq", 5000)
    (tmp_path / "config.json").write_text(json.dumps(each.configuration.to_dict()))
    row = publication._run_row(each, tmp_path)
    assert row["phases"] == '{"2000": 300, "4000": 75000}'
    assert row["robot"] == "tick" and row["prior"] == "" and row["seed"] == "0"


def test_columns_stay_in_the_order_of_each_task():
    tasks = ["tracking", "fell"], ["distance", "tracking", "sank"], ["goals", "tracking", "fell", "hits"]
    assert publication._merge_orders(tasks) == ["distance", "goals", "tracking", "fell", "sank", "hits"]


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ([], "expected a study: module:attribute, or <division>-<algorithm>; see --help"),
        (
            ["paper"],
            "study 'paper': expected module:attribute, a Study on Python's path, or <division>-<algorithm> of the "
            "benchmark, such as top-ppo; tools/study.py of a clone runs those of its folder studies\n",
        ),
        (["top-pppo"], "unknown algorithm 'pppo'; did you mean 'ppo'?"),
        (["top-ppo", "--shard=4/4"], "--shard=4/4: expected i/n with i from 0 to n - 1, such as 0/4"),
        (["top-ppo", "--shard=0/2", "--submit=3"], "--shard=0/2: --submit makes shares of its own; leave one of "),
        (["top-ppo", "--jobs=2", "--submit=3"], "--jobs, --submit: this machine, or a cluster; give one of them"),
        (["top-ppo", "--shard=30/31"], "--shard=30/31: no run, as the study has 30"),
        (["top-ppo", "--minutes=2"], "--minutes: goes with --device"),
        (["top-ppo", "--device", "--jobs=2"], "--jobs: goes without --device, on which runs learn in this process"),
        (["arc_suite:load"], "study 'arc_suite:load': expected a Study, got function"),
        (
            ["tiny_studies:TWIC"],
            "study 'tiny_studies:TWIC': module 'tiny_studies' has no attribute 'TWIC'; did you mean 'TWICE'?",
        ),
        (["tiny_studies:TWICE"], "study 'tiny_studies:TWICE': 2 runs are named tick-walk-sac-0; a "),
    ],
)
def test_errors_are_one_line(arguments, line, tmp_path):
    done = programs.run("-m", "arc_suite", "study", *arguments, cwd=tmp_path, path=FIXTURES)
    programs.refused(done, f"arc-suite study: {line}")
    assert not list(tmp_path.iterdir())


def test_a_study_is_found_in_the_current_folder(tmp_path):
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "study.md").read_text(), re.DOTALL)
    (tmp_path / "my_studies.py").write_text(code)
    done = programs.arc_suite("study", "my_studies:MINE", "--shard=6/7", cwd=tmp_path)
    programs.refused(done, "arc-suite study: --shard=6/7: no run, as the study has 6\n")


def test_submit_without_slurm_is_refused(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    done = programs.run("-m", "arc_suite", "study", "top-ppo", "--submit=2", "--hours=1", cwd=tmp_path)
    line = "--submit: SLURM's sbatch is not here; --jobs runs processes on this machine\n"
    programs.refused(done, f"arc-suite study: {line}")
    assert not list(tmp_path.iterdir())


def test_a_study_is_submitted_in_shares(tmp_path, monkeypatch):
    """By submitit's executor that runs jobs here; a job that is broken off comes back as it was."""
    pytest.importorskip("submitit", reason="of the extra cluster: make check-agents")
    from arc_suite.learning.studies import cluster

    commands = []
    monkeypatch.setattr(cluster.subprocess, "run", lambda command, check: commands.append(command))
    study = ("arc-suite", "study", "top-ppo")
    jobs = cluster.submit(study, 3, 2.0, tmp_path / "jobs", cluster="debug")
    for job in jobs:
        job.result()
    assert commands == [(*study, f"--shard={part}/3", "--jobs=1") for part in range(3)]
    share = cluster.Share(study)
    assert share.checkpoint().function == share


@pytest.mark.slow
@pytest.mark.parametrize(
    ("task", "presets"),
    [
        ("walk", {"zero", "refined", "tuned", "straight", "medium"}),
        ("rough", {"zero", "climbing", "surefooted", "steered"}),
        ("navigate", {"zero", "planned", "steered", "surefooted"}),
    ],
)
def test_demonstrators_beside_runs_follow_the_command_where_there_is_one(tmp_path, monkeypatch, task, presets):
    monkeypatch.setattr(evaluation, "EPISODES", 10)
    trained = run("tick", "sac", 100, task=task, task_kwargs={"time_limit": 0.5})
    publication._publish_demonstrators([trained], tmp_path, progress=tqdm)
    returns = results.read_demonstrators(tmp_path)[trained.place]
    assert set(returns) == presets and all(len(totals) == 10 for totals in returns.values())
