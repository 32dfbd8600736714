"""Programs take body, task and settings from a trained policy where flags leave them open."""

import json

import pytest
from networks import made
from programs import arc_suite as run

from arc_suite.policies import network

SETTINGS = {"friction": [0.5, 1.2], "observation_noise": 0.5, "time_limit": 2.0}
FLAGS = ["--robot=tick", "--task=rough", *(f"--set={name}={value}" for name, value in SETTINGS.items())]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A run on rough ground with settings, whose network leaves out contact forces."""
    folder = tmp_path_factory.mktemp("runs") / "rough"
    folder.mkdir()
    network.save(folder / network.FILE, made("tick", "rough", **SETTINGS, exclude_blocks=["contact_forces"]))
    return folder


def test_a_run_is_evaluated_by_its_folder_alone(folder, tmp_path):
    paths = tmp_path / "alone.json", tmp_path / "flags.json"
    for path, flags in zip(paths, ([], FLAGS), strict=True):
        done = run("evaluate", f"--policy={folder}", "--episodes=2", f"--json={path}", *flags)
        assert done.returncode == 0, done.stderr
        assert (
            done.stdout.splitlines()[0] == f"{folder}: trained on tick, rough, {json.dumps(SETTINGS, sort_keys=True)}"
        )
    alone, flags = (json.loads(path.read_text()) for path in paths)
    assert alone == flags and alone["task_kwargs"] == SETTINGS


def test_settings_change_those_of_the_run_and_a_task_replaces_them(folder):
    done = run("render", f"--policy={folder}", "--set=friction=1.0", "--output=/nonexistent/tick.png")
    kept = SETTINGS | {"friction": 1.0}
    assert done.stdout.splitlines()[0].endswith(f"; plays in tick, rough, {json.dumps(kept)}")
    done = run("render", f"--policy={folder}", "--task=rough", "--output=/nonexistent/tick.png")
    assert done.stdout.splitlines()[0].endswith("; plays in tick, rough")


def one_line(done, line):
    assert (done.returncode, done.stderr) == (1, f"{line}\n")


@pytest.mark.parametrize(
    ("program", "flags", "message"),
    [
        ("evaluate", ["--robot=queen"], "policy {0}: made for tick, and not for queen"),
        ("play", ["--robot=queen", "-o=a.html"], "policy {0}: made for tick, and not for queen"),
        (
            "evaluate",
            ["--task=walk", "--episodes=1"],
            "policy of tick, rough: observations differ from those in training: command has 0, not 6, scan has 0, "
            "not 175 numbers; train with this body and task",
        ),
        ("animate", ["--spec=spider", "-o=a.glb"], "policy {0}: made for tick, and not for spider"),
    ],
)
def test_what_contradicts_the_run_is_one_line(folder, tmp_path, program, flags, message):
    flags = [flag.replace("-o=", f"--output={tmp_path}/") for flag in flags]
    one_line(run(program, f"--policy={folder}", *flags), f"arc-suite {program}: {message.format(folder)}")


def test_an_exported_run_takes_no_other_task(folder):
    settings = json.dumps(SETTINGS, sort_keys=True)
    kept = f"trained on tick, rough, {settings}, which an export keeps"
    message = f"policy {folder}: {kept}; got flags of tick, walk, {settings}"
    one_line(run("export", str(folder), "--task=walk"), f"arc-suite export: {message}")
