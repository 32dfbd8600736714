"""Programs that are killed or asked to end: the same command goes on, and ends as if nothing had happened."""

import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time

import kills
import numpy as np
import pytest

from arc_suite.cli import interrupts, program
from arc_suite.learning.studies import csv_files, results

FIXTURES = pathlib.Path(__file__).parents[1] / "fixtures"

# By program, or algorithm of `train`: the flags, and the least number of changes of files.
COMMANDS = {
    "train": (
        (
            "--robot=tick",
            "--algorithm=tiny_studies:climb",
            "--steps=200",
            "--hp=slice=100",
            "--set=time_limit=0.5",
            "--output=run",
        ),
        20,
    ),
    "design": (
        ("--around=tick", "--goal=speed", "--bodies=40", "--steps=10", "--nopages", "--processes=1", "--output=a"),
        10,
    ),
    "finetune": (
        (
            "--robot=leaper",
            "--algorithm=finetune",
            "--set=time_limit=0.5",
            "--steps=64",
            "--evaluate_every=32",
            *("--hp=start=../start", "--hp=num_envs=4", "--hp=horizon=8", "--hp=minibatch=16", "--hp=value_warm_up=8"),
            "--output=run",
        ),
        20,
    ),
    "study": (("tiny_studies:PAIR", "--jobs=2"), 10),
    "benchmark": (("samples", "--algorithm=tiny_studies:climb", "--places=tick-walk", "--seeds=1"), 10),
}

# The run from which `finetune` starts.
IMITATION = (
    *("--robot=leaper", "--algorithm=dagger", "--set=time_limit=0.5", "--steps=80", "--evaluate_every=80"),
    *("--hp=num_envs=4", "--hp=round=10", "--hp=left_out=0", "--hp=hidden=16", "--hp=batch=64", "--output=run"),
)

# Flags of programs that write one file, by the file.
FILES = {
    "a.json": ("import", str(FIXTURES / "robots" / "go2_like.xml")),
    "body.json": ("evaluate", "--robot=tick", "--episodes=1", "--set=time_limit=0.5"),
    "a.csv": ("transfer", "--families=robots", "--set=time_limit=0.5"),
    "a.glb": ("animate", "--robot=tick", "--clips=walk"),
    "a.webp": ("animate", "--robot=tick", "--clips=walk", "--size=32", "--fps=4"),
    "a.mp4": ("render", "--robot=tick", "--policy=zero", "--steps=3", "--width=64", "--height=48"),
    "a.gif": ("render", "--robot=tick", "--policy=zero", "--steps=3", "--width=64", "--height=48"),
    "a.xml": ("build_model", "--robot=tick"),
}


def contents(folder):
    """What must not depend on kills, by path: rows of tables without times, arrays without versions, other bytes."""
    found = {}
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        name = path.relative_to(folder)
        if path.suffix == ".csv" and path.name != "times.csv":
            for number, row in enumerate(csv_files.read(path)):
                found[f"{name}/{number}"] = {key: cell for key, cell in row.items() if key not in results.TIMES}
        elif path.suffix == ".npz":
            with np.load(path) as arrays:
                found |= {f"{name}/{key}": arrays[key].tobytes() for key in arrays.files if key != "progress"}
        elif path.suffix in (".json", ".jsonl"):
            found[str(name)] = path.read_bytes()
        else:
            found[str(name)] = None
    return found


@pytest.mark.release
@pytest.mark.parametrize("command", COMMANDS)
def test_killed_at_any_change_of_files_the_same_command_completes_it(command, tmp_path):
    flags, least = COMMANDS[command]
    program = command
    if command == "finetune":
        program = "train"
        pytest.importorskip("jax")
        kills.whole(("train", *IMITATION), tmp_path / "before")
        (tmp_path / "before" / "run").rename(tmp_path / "start")
    kills.whole((program, *flags), tmp_path / "whole")
    expected = contents(tmp_path / "whole")

    def check():
        found = contents(tmp_path / "killed")
        assert found.keys() == expected.keys()
        assert [path for path in found if found[path] != expected[path]] == []

    begun = None
    if command == "benchmark":  # with its runs, which are made as those of a study, and demonstrators, which take long
        begun = shutil.copytree(tmp_path / "whole", tmp_path / "begun")
        for path in (begun / "studies").rglob("*"):
            if path.is_file() and path.name != results.DEMONSTRATORS:
                path.unlink()
    assert kills.resumed((program, *flags), tmp_path / "killed", check, begun) >= least


@pytest.mark.release
@pytest.mark.parametrize("name", FILES)
def test_killed_at_any_change_of_files_a_file_is_whole_or_absent(name, tmp_path):
    """The same command writes it, and deletes what the kill has left beside it."""
    flag = "json" if FILES[name][0] == "evaluate" else "output"
    command = (*FILES[name], f"--{flag}={name}")
    kills.whole(command, tmp_path / "whole")
    expected = {path.name: path.read_bytes() for path in (tmp_path / "whole").iterdir()}

    def check_killed():
        for other in expected:  # clips have a table beside them
            path = tmp_path / "killed" / other
            assert not path.exists() or path.read_bytes() == expected[other]

    def check():
        assert {path.name: path.read_bytes() for path in (tmp_path / "killed").iterdir()} == expected

    assert kills.resumed(command, tmp_path / "killed", check, check_killed=check_killed) >= 2


def test_sigterm_can_be_asked_for():
    with program.watch_for_termination() as came:
        assert not came()
        os.kill(os.getpid(), signal.SIGTERM)
        assert came()


@pytest.mark.skipif(sys.platform == "win32", reason="has no SIGTERM to catch")
@pytest.mark.parametrize("comes_again", [True, False])
def test_sigterm_ends_those_who_never_ask(monkeypatch, comes_again):
    monkeypatch.setattr(program, "_GRACE_PERIOD", 600.0 if comes_again else 0.05)
    with pytest.raises(interrupts.Terminated), program.watch_for_termination():
        os.kill(os.getpid(), signal.SIGTERM)
        if comes_again:
            os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(60.0)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="has no SIGTERM to catch")
def test_training_that_is_asked_to_end_leaves_a_checkpoint(tmp_path):
    """Clusters send SIGTERM before they take a machine away."""
    flags = ["--robot=tick", "--algorithm=tiny_studies:climb", "--steps=100000", "--output=run"]
    command, environ = [sys.executable, "-m", "arc_suite", "train", *flags], os.environ | {"PYTHONPATH": str(FIXTURES)}
    with subprocess.Popen(
        command, cwd=tmp_path, env=environ, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline().startswith("run: ")
        while not (tmp_path / "run" / "training.csv").exists():
            assert process.poll() is None
        process.send_signal(signal.SIGTERM)
        output, _ = process.communicate(timeout=120)
    assert process.returncode == 143
    assert output.splitlines()[-1].startswith("run: stopped; the same command resumes it, ")
    assert (tmp_path / "run" / "checkpoint.npz").exists()


ENDING = """
import os, signal
import arc_suite, tiny_studies
def learn(hp, context):
    for piece in tiny_studies.learn(hp, context):
        if not context.checkpoint:
            os.kill(os.getpid(), signal.SIGTERM)
        yield piece
ending = tiny_studies.climb._replace(learn=learn)
arc_suite.register(module=__name__, algorithms={"ending": ending})
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="has no SIGTERM to catch")
def test_a_signal_in_the_last_step_of_training_waits_for_no_judge(tmp_path):
    (tmp_path / "ending.py").write_text(ENDING)
    flags = ["--robot=tick", "--algorithm=ending:ending", "--set=time_limit=2", "--steps=1", "--output=run"]
    command = [sys.executable, "-m", "arc_suite", "train", *flags]
    environ = os.environ | {"PYTHONPATH": f"{FIXTURES}{os.pathsep}{tmp_path}"}
    done = subprocess.run(command, cwd=tmp_path, env=environ, capture_output=True, text=True)
    assert done.returncode == 143, done.stderr
    assert done.stdout.splitlines()[-1].startswith("run: finished; the same command judges it, ")
    assert not (tmp_path / "run" / "final.csv").exists()
    done = subprocess.run(command, cwd=tmp_path, env=environ, capture_output=True, text=True)
    assert done.returncode == 0 and "judged in 100 episodes" in done.stdout, done.stderr
