"""Collecting a dataset and being killed, interrupted, misled, or short of space."""

import functools
import multiprocessing
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import threading

import datasets
import minari
import programs
import pytest
from datasets import ID, collect
from refusals import refused
from tiers import never, tiers

from arc_suite import data, files
from arc_suite.data.storage import Storage
from arc_suite.envs.setup import Setup

COLLECT = (sys.executable, "-m", "arc_suite", "collect")
PARTS = "arc_suite/test/.some-v0.parts"
slowly = functools.partial(pytest.param, marks=pytest.mark.slow)
SETTINGS = data.DatasetSettings(Setup.of("tick"), "random", (), steps=4)

# Policies to which an accident happens in the sixth episode: the eighth that is made, as two are made for trial.
OWN = """
import os, signal
import numpy as np
made = []
def accident(robot, happen):
    made.append(robot)
    number, steps = len(made), []
    def policy(timestep):
        steps.append(timestep)
        return happen() if number == 8 and len(steps) == 3 else np.full(18, 0.1 * len(steps))
    return policy
def kill(robot): return accident(robot, lambda: os.kill(os.getpid(), signal.SIGKILL))
def interrupt(robot): return accident(robot, lambda: signal.raise_signal(signal.SIGINT))
def nan(robot): return accident(robot, lambda: np.full(18, np.nan))
def short(robot): return accident(robot, lambda: np.zeros(3))
"""


@pytest.fixture(autouse=True)
def own(tmp_path, monkeypatch):
    """Let programs find the policies."""
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    (tmp_path / "own.py").write_text(OWN)


def digests(dataset_id=ID):
    """Of the episodes that Minari sees; all of them open."""
    found = datasets.digests(dataset_id)
    assert len(list(minari.load_dataset(dataset_id))) == len(found)
    return found


def kept_in_parts():
    """Return the indices of the episodes of an unfinished dataset."""
    with Storage.open(ID, overwrite=False) as storage:
        return storage.kept


def killed_at(count, **arguments):
    """Return whether a process was killed just before it renames or deletes for the n-th time."""

    def work():
        left = iter(range(count - 1))

        def guard(function):
            def guarded(*args, **kwargs):
                if next(left, None) is None:
                    os._exit(9)
                return function(*args, **kwargs)

            return guarded

        pathlib.Path.replace, pathlib.Path.rename = guard(pathlib.Path.replace), guard(pathlib.Path.rename)
        os.unlink, os.rmdir = guard(os.unlink), guard(os.rmdir)
        collect(ID, num_envs=2, threads=1, **arguments)
        os._exit(0)

    process = multiprocessing.get_context("fork").Process(target=work)
    process.start()
    process.join()
    return process.exitcode == 9


SCENARIOS = ("new", "more episodes", "new after another", "overwrite", "overwrite twice")


@pytest.mark.long
@pytest.mark.parametrize("scenario", tiers(SCENARIOS, never, lambda name: name == "overwrite twice"))
def test_killed_at_any_change_of_files_the_dataset_opens_and_the_same_command_completes_it(root, scenario):
    old = SETTINGS._replace(seed=10_009)
    collect("arc_suite/test/whole-v0", SETTINGS, 4)
    whole, arguments = digests("arc_suite/test/whole-v0"), {"settings": SETTINGS, "episodes": 4}
    before, leftover = [], root / "leftover"
    if scenario == "more episodes":
        collect("arc_suite/test/before-v0", SETTINGS, 3)
        before = whole[:3]
    elif scenario.startswith("overwrite"):
        collect("arc_suite/test/before-v0", old, 3)
        before = digests("arc_suite/test/before-v0")
        arguments["overwrite"] = True
    if scenario in ("overwrite twice", "new after another"):  # one after finished episodes, one before
        assert killed_at(5 if before else 3, settings=old, episodes=4, overwrite=True)
        (root / PARTS).rename(leftover)
    for count in range(1, 100):
        if before:
            shutil.copytree(root / "arc_suite/test/before-v0", root / ID)
            metadata = root / ID / "data" / "metadata.json"
            metadata.write_text(metadata.read_text().replace("before-v0", "some-v0"))
        if leftover.exists():
            shutil.copytree(leftover, root / PARTS)
        survived = not killed_at(count, **arguments)
        if (root / ID / "data" / "metadata.json").exists():
            assert digests() in (before, whole)
        else:  # of a new dataset, or in the moment in which the new file takes the old one's place
            with pytest.raises(ValueError, match=f"^dataset '{ID}' is (unfinished|damaged): |^unknown dataset"):
                data.open(ID)
        collect(ID, **arguments)
        assert digests() == whole
        assert {path.name for path in (root / ID).rglob("*")} == {"data", "main_data.hdf5", "metadata.json"}
        assert {path.name for path in root.glob("arc_suite/test/.*")} == set()
        shutil.rmtree(root / ID)
        if survived:
            break
    assert 8 < count < 99


def run(*arguments, **kwargs):
    command = [*COLLECT, "--robot=tick", f"--id={ID}", "--steps=20", *arguments]
    return subprocess.run(command, capture_output=True, text=True, **kwargs)


def last_line(text):
    return text.rstrip("\n").rpartition("\n")[2].rpartition("\r")[2].strip()


PLACE = "arc-suite collect: policy 'own:{}': episode of seed 10005, step 2:"
KEPT = f"5 of 8 episodes of {ID!r} are kept"


@pytest.mark.long
@pytest.mark.parametrize(
    ("accident", "status", "line"),
    [
        slowly("kill", -signal.SIGKILL, None),
        ("interrupt", 130, f"arc-suite collect: interrupted; {KEPT}"),
        ("nan", 1, f"{PLACE.format('nan')} action[0]: expected a number from -1 to 1, got nan; {KEPT}"),
        ("short", 1, f"{PLACE.format('short')} action: expected shape (18,), got (3,); {KEPT}"),
    ],
)
def test_finished_episodes_are_kept(accident, status, line):
    done = run(f"--policy=own:{accident}", "--episodes=8", "--num_envs=1")
    assert done.returncode == status
    if line:
        assert last_line(done.stderr) == line
    if accident != "kill":
        assert len(digests()) == 5
        return
    kept = 0
    while done.returncode == -signal.SIGKILL:
        assert len(kept_in_parts()) > kept
        kept = len(kept_in_parts())
        done = run(f"--policy=own:{accident}", "--episodes=8", "--num_envs=1")
    assert (done.returncode, done.stdout.split(",")[0]) == (0, f"{ID}: 8 episodes"), done.stderr
    run("--policy=own:nan", "--episodes=4", "--num_envs=1", f"--id={ID[:-3]}-b-v0")
    assert digests()[:4] == digests(f"{ID[:-3]}-b-v0")


@pytest.mark.slow
def test_a_full_disk_is_one_line_and_keeps_what_is_finished():
    def full():
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))

    few = ("--policy=random", "--episodes=8", "--num_envs=1")
    done = run(*few, preexec_fn=full)
    assert done.returncode == 1
    line, kept = last_line(done.stderr), len(kept_in_parts())
    assert line.startswith("arc-suite collect: cannot write ") and "file too large" in line
    assert kept and line.endswith(f"; {kept} of 8 episodes of {ID!r} are kept")
    programs.passed(run(*few))
    assert len(digests()) == 8


def test_two_processes_do_not_collect_into_one_dataset():
    collect(ID, SETTINGS, 2)
    with Storage.open(ID, overwrite=False), refused(f"dataset {ID!r} is being collected by another process"):
        collect(ID, SETTINGS, 3)


def test_a_process_that_waits_finds_what_the_other_has_collected():
    collecting = threading.Thread(target=lambda: counts.append(collect(ID, SETTINGS, 2, wait=True)))
    counts = []
    with Storage.open(ID, overwrite=False):
        collecting.start()
        collecting.join(0.5)
        assert collecting.is_alive()
    collecting.join()
    assert counts == [2]
    assert collect(ID, SETTINGS, 2, wait=True) == 0


def test_a_dataset_that_is_moved_to_its_place_meanwhile_is_gone_on_with(root, monkeypatch):
    """By the process that held the lock."""
    place = root / ID
    collect(ID, SETTINGS, 2)
    away = place.with_name("away")
    place.rename(away)
    locked = files.hold_lock

    def moved_before(path, refusal):
        if not place.exists():
            away.rename(place)
        return locked(path, refusal)

    monkeypatch.setattr(files, "hold_lock", moved_before)
    assert collect(ID, SETTINGS, 3) == 1
    assert not list(place.parent.glob(".*"))


def test_a_damaged_part_is_named_and_overwrite_mends_it(root):
    assert killed_at(5, settings=SETTINGS, episodes=6)
    part = root / PARTS / "0.hdf5"
    os.truncate(part, 50)
    with pytest.raises(ValueError, match=f"^dataset '{ID}' is damaged: {part}: "):
        collect(ID, SETTINGS, 6)
    collect(ID, SETTINGS, 6, overwrite=True)
    assert len(digests()) == 6


def test_an_unfinished_dataset_is_one_line_and_fewer_episodes_finish_it(root):
    assert killed_at(5, settings=SETTINGS, episodes=6)
    with pytest.raises(ValueError, match=f"^dataset '{ID}' is unfinished: collect it again to continue it$"):
        data.open(ID)
    assert collect(ID, SETTINGS, 1) == 0
    assert len(digests()) == 2


def test_a_folder_that_cannot_be_made_is_named(root):
    (root / ID).mkdir(parents=True)
    (root / ID / "data").touch()
    with refused(f"cannot make folder {root / ID / 'data'}: file exists", OSError):
        collect(ID, SETTINGS, 1)
