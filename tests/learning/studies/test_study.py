"""Studies: eight tiny runs, killed twice, are bit-exactly those of an uninterrupted study, apart from times."""

import contextlib
import dataclasses
import importlib.util
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import time
import types

import numpy as np
import programs
import pytest
import tiny_studies

from arc_suite import data, evaluation, policies, registry, style
from arc_suite.envs.dm import load
from arc_suite.learning.agents import configuration, run_folder
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.training import train
from arc_suite.learning.studies import publication, results, runner, tables
from arc_suite.learning.studies.publication import METRICS
from arc_suite.learning.studies.runner import State
from arc_suite.learning.studies.tables import Prior, run
from arc_suite.robots import generator

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
    """Everything that must not depend on jobs and kills, by its path."""
    found = {}
    for path in sorted(folder.glob("results/*/[!.]*")):  # a kill may leave a temporary file
        if path.name != "times.csv":
            found[str(path.relative_to(folder))] = path.read_bytes()
    for path in sorted(folder.glob("runs/*/[cp]*.npz")):
        with np.load(path) as stored:
            for name in stored.files:
                if name != "progress":
                    found[f"{path.relative_to(folder)}/{name}"] = stored[name].tobytes()
    return found


@pytest.mark.release
@pytest.mark.parametrize("name", ["WITH_NUMPY", "WITH_JAX"])
def test_killed_twice(name, tmp_path, begun):
    """First with all its processes, then alone, so that its runs go on; two jobs make what one makes."""
    if name == "WITH_JAX":
        pytest.importorskip("jax", reason="of the extra agents: make check-agents")
    assert begun(name, tmp_path / "whole", 1).wait() == 0

    process = begun(name, tmp_path / "killed", 2)
    wait_for(1, "runs/*/checkpoint.npz", tmp_path / "killed", process)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    process = begun(name, tmp_path / "killed", 2)
    wait_for(3, "results/*/style.csv", tmp_path / "killed", process)
    process.kill()
    process.wait()
    assert begun(name, tmp_path / "killed", 2).wait() == 0

    whole, killed = contents(tmp_path / "whole"), contents(tmp_path / "killed")
    assert len([path for path in whole if path.endswith("evaluations.csv")]) == 8
    assert whole.keys() == killed.keys()
    assert [path for path in whole if whole[path] != killed[path]] == []


@pytest.mark.release
def test_what_is_finished_is_skipped_and_shards_share(tmp_path, surroundings):
    (tmp_path / "study").mkdir()
    command = ["-m", "arc_suite", "study", "tiny_studies:WITH_NUMPY", "--jobs=2"]
    places = [f"--runs={tmp_path / 'runs'}", f"--results={tmp_path / 'results'}"]
    names = [each.name for each in tiny_studies.WITH_NUMPY.runs]
    for shard, count in (("0/7", 2), ("1/7", 1)):
        done = subprocess.run(
            [sys.executable, *command, *places, f"--shard={shard}"], env=surroundings, capture_output=True, text=True
        )
        assert (done.returncode, done.stderr) == (0, "")
        assert done.stdout.endswith(f"{count} of {count} finished\n")
    made = sorted(path.name for path in (tmp_path / "runs").iterdir() if path.is_dir())
    assert made == sorted([names[0], names[7], names[1]])

    first, folder = tiny_studies.WITH_NUMPY.runs[0], tmp_path / "runs"
    assert configuration.read(folder / first.name / "config.json") == first.configuration
    before = (folder / first.name / "checkpoint.npz").stat().st_mtime_ns
    states = runner.make([first], folder, tmp_path / "results", 1, lambda states: None)
    assert [each.word for each in states] == ["finished"]
    assert (folder / first.name / "checkpoint.npz").stat().st_mtime_ns == before
    assert states[0].step == 300

    other = tiny_studies.tiny("tiny_studies:CLIMB", 0, hyperparameters={"spread": 0.3})
    with pytest.raises(ValueError, match=r"of another run, whose hyperparameters.spread is 0.02, and not 0.3; write "):
        runner.is_finished(other, folder / first.name)

    # Of another run nothing that was measured stays.
    published = tmp_path / "results" / first.name
    measured = (published / "style.csv").read_text()
    (published / "config.json").write_text("{}")
    (published / "style.csv").write_text(measured.replace(",0.", ",1."))
    publication.publish(first, folder, tmp_path / "results")
    assert (published / "style.csv").read_text() == measured

    # What is published of the policy's style is what the style room measures of it.
    table = run_folder.table(published, "style")
    environment = load("tick", "walk", tiny_studies.SHORT)
    policy = policies.policy(folder / first.name, "tick")
    for seed in (0, 7):
        measured = style.measure(style.record(environment, policy, seed))
        for name in METRICS:
            assert np.array_equal(table[name][seed], measured[name].value, equal_nan=True)


@pytest.mark.long
def test_a_failed_run_says_why_and_the_others_are_made(tmp_path, surroundings):
    command = ["-m", "arc_suite", "study", "tiny_studies:BROKEN", "--jobs=1"]
    done = subprocess.run([sys.executable, *command], env=surroundings, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 1
    assert done.stdout.endswith("1 of 2 finished, 1 failed\n")
    (line,) = done.stderr.splitlines()
    reason = (
        "training needs JAX: "
        if importlib.util.find_spec("jax") is None
        else "prior: the algorithm takes no prior data, got "
    )
    assert line.startswith(f"runs/tiny_studies.BROKEN/tick-walk-sac-0.log: arc-suite train: {reason}")


@pytest.mark.slow
def test_prior_data_are_those_of_the_study(tmp_path, monkeypatch):
    """A dataset that somebody has collected more of is another."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "datasets"))
    each = run("tick", "sacfd", 100, task_kwargs=tiny_studies.SHORT, prior=Prior(episodes=2))
    dataset = each.configuration.prior
    assert runner.prepare([each], tmp_path / "runs", 1) == {each.name: "waiting"}
    data.collect(dataset, each.prior.settings(each.configuration.setup), 3)
    with pytest.raises(ValueError) as error:
        runner.prepare([each], tmp_path / "runs", 1)
    what = f"dataset {dataset!r} has 3 episodes, and the study takes 2; delete it, to have it collected anew"
    assert str(error.value) == f"{each.name}: {what}"


def test_a_curriculum_is_judged_at_the_difficulty(tmp_path):
    settings = tiny_studies.SHORT | {"curriculum": True, "level": 3}
    each = run("tick", "tiny_studies:CLIMB", 100, task="gaps", task_kwargs=settings, evaluate_every=100)
    assert each.place == 'tick, gaps, {"time_limit": 2.0}'
    folder, published = tmp_path / "runs", tmp_path / "results"
    assert train(each.configuration, folder / each.name)
    publication.publish_all([each], folder, published)
    assert configuration.read(published / each.name / "config.json").setup.task_kwargs == settings
    table = run_folder.table(folder / each.name, "evaluations")
    assert "distance" in table and "level" not in table
    assert results.demonstrators(published).keys() == {each.place}
    with contextlib.closing(load("tick", "gaps", tiny_studies.SHORT)) as environment:
        policy = policies.policy(folder / each.name, "tick", task=environment.task.definition)
        assert evaluation.run(environment, policy, 4).total == table["return"][4]


def test_the_page_counts_runs():
    rows = re.findall(r"^\| `([a-z-]+)` \| (\d+) \| (\d+) \|", (ROOT / "docs" / "study.md").read_text(), re.MULTILINE)
    assert {name for name, *_ in rows} == tables.STUDIES.keys()
    for name, runs, committed in rows:
        assert len(tables.study(name).runs) == int(runs), name
        assert len(list((ROOT / "studies" / name).glob("*/config.json"))) == int(committed), name


def test_robots_of_other_packages_and_unknown_ones(monkeypatch):
    body = dataclasses.replace(generator.generate(4, 2), name="creature")
    monkeypatch.setitem(sys.modules, "others", types.ModuleType("others"))
    monkeypatch.setitem(registry.ROBOTS, "creature", body)
    monkeypatch.setitem(registry.MODULES, ("robot", "creature"), "others")
    each = run("others:creature", "sac", 100)
    assert each.configuration.setup.body is body and each.name == "creature-walk-sac-0"
    assert each.configuration.to_dict()["robot"] == "others:creature"
    with pytest.raises(ValueError, match=r"^unknown robot 'tik'; did you mean 'tick'"):
        run("tik", "sac", 100)


def test_phases_are_published(tmp_path):
    lines = ["step,phase_updates", "1000,0", "2000,300", "3000,0", "4000,75000"]
    (tmp_path / "training.csv").write_text("\n".join(lines) + "\n")
    text = publication._phases(run_folder.table(tmp_path, "training"))
    assert text == "step,updates\n2000,300\n4000,75000\n"


def test_a_run_that_another_process_makes_is_waited_for(tmp_path):
    """It is not started twice, whatever process makes it."""
    log = tmp_path / "a.log"
    held = runner.claim(log)
    assert runner.claim(log) is None
    child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE, stdout=held)
    held.close()
    assert runner.claim(log) is None, "the process of the run holds it too"
    child.communicate(b"\n")
    runner.claim(log).close()


def test_remaining_time():
    """By a run's own pace, that of its kind, or that of all."""
    sac, sope = (run("tick", name, 1000) for name in ("sac", "sope_eo"))

    def state(each, word, step, wall):
        return State(each, word, step, None, wall, wall)

    assert runner.remaining([state(sac, "waiting", 0, 0.0)], 1) is None
    begun = [state(sac, "finished", 1000, 100.0), state(sac, "running", 500, 100.0), state(sac, "waiting", 0, 0.0)]
    assert runner.remaining(begun, 1) == pytest.approx(100.0 + 150.0)
    assert runner.remaining([*begun, state(sope, "waiting", 0, 0.0)], 2) == pytest.approx(200.0)


def test_tables_that_cannot_have_grown_are_not_read_again(tmp_path, monkeypatch):
    runs = [run("tick", "sac", 1000, seed) for seed in range(3)]
    names = [each.name for each in runs]
    words = dict(zip(names, ("finished", "running", "waiting"), strict=True))
    read, table = [], run_folder.table
    monkeypatch.setattr(run_folder, "table", lambda *place: read.append(place[0].name) or table(*place))
    known = runner.states(runs, tmp_path, words)
    assert [(each.word, each.step) for each in known.values()] == [("finished", 0), ("running", 0), ("waiting", 0)]
    read.clear()
    (tmp_path / names[1]).mkdir()
    (tmp_path / names[1] / "times.csv").write_text("step,wall_seconds,cpu_seconds\n500,1.0,1.0\n")
    words[names[2]] = "running"
    known = runner.states(runs, tmp_path, words, known)
    assert [(each.word, each.step) for each in known.values()] == [("finished", 0), ("running", 500), ("running", 0)]
    assert set(read) == set(names[1:])


@pytest.mark.long
def test_a_terminal_shows_a_table_in_its_place(tmp_path, surroundings):
    """Which is no higher than the terminal; at its end stand all runs, once."""
    outer, inner = os.openpty()
    os.set_blocking(outer, False)
    command = [sys.executable, "-m", "arc_suite", "study", "tiny_studies:BROKEN", "--jobs=1"]
    screen = surroundings | {"LINES": "4", "COLUMNS": "100"}
    done = subprocess.run(command, env=screen, stdin=inner, stdout=inner, stderr=subprocess.PIPE, cwd=tmp_path)
    os.close(inner)
    tables = os.read(outer, 100_000).decode().replace("\r\n", "\n").split("\x1b[3A\x1b[J")
    os.close(outer)
    assert done.returncode == 1 and len(tables) > 2
    assert all(text.startswith("run ") and text.count("\n") == 3 for text in tables[:-1])
    assert tables[-1].count("\n") == 4 and tables[-1].endswith("\n1 of 2 finished, 1 failed\n")


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ([], "arc-suite study: expected a study: paper, exact-tick, short, "),
        (["papr"], "arc-suite study: unknown study 'papr'; did you mean 'paper'? (there are: "),
        (["paper", "--shard=4/4"], "arc-suite study: --shard=4/4: expected i/n with i from 0 to n - 1, such as 0/4"),
        (
            ["first-steps", "--shard=0/2", "--submit=3"],
            "arc-suite study: --shard=0/2: --submit makes shares of its own; leave one of them out",
        ),
        (
            ["first-steps", "--jobs=2", "--submit=3"],
            "arc-suite study: --jobs, --submit: this machine, or a cluster; give one of them",
        ),
        (["first-steps", "--shard=6/7"], "arc-suite study: --shard=6/7: no run, as the study has 6"),
        (["arc_suite:load"], "arc-suite study: study 'arc_suite:load': expected a Study, got function"),
        (
            ["tiny_studies:TWIC"],
            "arc-suite study: study 'tiny_studies:TWIC': module 'tiny_studies' has no attribute 'TWIC'; did you mean "
            "'TWICE'?",
        ),
        (["tiny_studies:TWICE"], "arc-suite study: study 'tiny_studies:TWICE': 2 runs are named tick-walk-sac-0; a "),
    ],
)
def test_errors_are_one_line(arguments, line, tmp_path):
    done = programs.run("-m", "arc_suite", "study", *arguments, cwd=tmp_path, path=FIXTURES)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith(line), done.stderr
    assert done.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_study_is_found_in_the_current_folder(tmp_path):
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "study.md").read_text(), re.DOTALL)
    (tmp_path / "my_studies.py").write_text(code)
    done = programs.arc_suite("study", "my_studies:MINE", "--shard=6/7", cwd=tmp_path)
    assert done.stderr == "arc-suite study: --shard=6/7: no run, as the study has 6\n"


@pytest.mark.parametrize("name", tables.STUDIES)
def test_runs_go_through_files(name):
    """The configuration of a run is the one that `arc-suite train` reads."""
    study = tables.study(name)
    assert study.title
    for each in study.runs[:12]:
        text = json.dumps(each.configuration.to_dict())
        assert Configuration.from_dict(json.loads(text)) == each.configuration
        takes_prior = getattr(each.configuration.hyperparameters, "prior", "none") != "none"
        assert (each.configuration.prior is not None) == takes_prior


def test_a_study_is_submitted_in_shares(tmp_path, monkeypatch):
    """By submitit's executor that runs jobs here; a job that is broken off comes back as it was."""
    pytest.importorskip("submitit", reason="of the extra cluster: make check-agents")
    from arc_suite.learning.studies import cluster

    commands = []
    monkeypatch.setattr(cluster.subprocess, "run", lambda command, check: commands.append(command))
    jobs = cluster.submit(("study", "first-steps"), 3, 2.0, tmp_path / "jobs", cluster="debug")
    for job in jobs:
        job.result()
    assert [command[1:] for command in commands] == [
        ["-m", "arc_suite", "study", "first-steps", f"--shard={part}/3", "--jobs=1"] for part in range(3)
    ]
    share = cluster.Share(("study", "first-steps"))
    assert share.checkpoint().function == share


@pytest.mark.slow
def test_without_the_extra_it_says_what_to_install(tmp_path):
    done = programs.without("minari", tmp_path, "study", "--help")
    line = f"studies need JAX, Minari and matplotlib: {programs.install('agents')} (No module named 'minari')"
    assert (done.returncode, done.stdout, done.stderr) == (1, "", f"arc-suite study: {line}\n")


@pytest.mark.skipif(importlib.util.find_spec("submitit") is not None, reason="submitit is installed")
def test_without_submitit_it_says_what_to_install(tmp_path):
    done = programs.run("-m", "arc_suite", "study", "paper", "--submit=2", cwd=tmp_path)
    line = f"arc-suite study: --submit needs submitit: {programs.install('cluster')} ("
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith(line) and done.stderr.count("\n") == 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("task", "presets"),
    [
        ("walk", {"zero", "refined", "tuned", "medium"}),
        ("rough", {"zero", "surefooted", "steered", "refined", "tuned", "medium"}),
        ("navigate", {"zero", "planned", "steered", "surefooted", "refined", "tuned", "medium"}),
    ],
)
def test_demonstrators_beside_runs_follow_the_command_where_there_is_one(tmp_path, task, presets):
    each = run("tick", "sac", 100, task=task, task_kwargs={"time_limit": 0.5})
    publication.publish_all([each], tmp_path / "runs", tmp_path)
    found = results.demonstrators(tmp_path)[each.place]
    assert set(found) == presets and all(len(totals) == 10 for totals in found.values())
