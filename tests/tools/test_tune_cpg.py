"""tools/tune_cpg.py searches, goes on when it was broken off, and judges what it found."""

import json
import subprocess
import sys

import imageio.v3 as imageio
import programs
import pytest

QUICK = ("--robot=bastion", "--steps=20", "--starts=8", "--resets=2")


def command(*arguments):
    return [sys.executable, programs.TOOLS / "tune_cpg.py", *QUICK, *map(str, arguments)]


def tune(*arguments):
    return subprocess.run(command(*arguments), capture_output=True, text=True)


@pytest.mark.release
def test_killed_and_run_again_it_ends_as_if_nothing_had_happened(tmp_path):
    straight, broken = tmp_path / "straight", tmp_path / "broken"
    done = tune("--generations=4", f"--output={straight}")
    journal = broken / "journal.jsonl"
    lines = programs.killed(command("--generations=100000", f"--output={broken}"), journal, 3)
    journal.write_bytes(b"".join(lines[:3]) + lines[1][:30])  # two generations, and a third that was being written
    again = tune("--generations=4", f"--output={broken}")
    assert (again.returncode, again.stdout.replace(str(broken), str(straight))) == (done.returncode, done.stdout)
    for name in ("journal.jsonl", "result.json"):
        assert (broken / name).read_bytes() == (straight / name).read_bytes()

    result = json.loads((straight / "result.json").read_text())
    found, medium = result["metrics"]["found"], result["metrics"]["medium"]
    worse = [cost for cost in ("posture", "smoothness", "tilt") if found[cost] > medium[cost]]
    assert done.returncode == (1 if worse or found["falls"] else 0)
    broken = "tune_cpg.py: the result breaks its constraints: "
    assert [cost for cost in worse if cost not in done.stderr.partition(broken)[2]] == []
    assert (result["robot"], result["generations"], result["resets"]) == ("bastion", 4, 2)
    assert found["return"]["mean"] > medium["return"]["mean"]
    assert result["versions"]["mujoco"].startswith("3.17")
    picture = imageio.imread(straight / "course.png")
    assert picture.shape[0] > 500 and picture.std() > 10.0

    first, *lines = done.stdout.splitlines()
    assert first == f"{straight}: 4 generations"
    assert lines[0].split() == ["preset", "return", "falls", "of", "2", "posture", "smoothness", "tilt"]
    assert [line.split()[0] for line in lines[2:4]] == ["found", "medium"]
    assert lines[5].startswith("Preset(stiffness=")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--task=wlak"], "unknown task 'wlak'; did you mean 'walk'? (there are: "),
        (["--generations=0"], "flag --generations=0: expected an integer in the range [1, 100000]"),
        (["--resets=100000000000000000000"], "flag --resets=100000000000000000000: "),
        (["--steps=1001"], "flag --steps=1001: "),
        (["--space=torqes"], "unknown space 'torqes'; did you mean 'torques'?"),
        (["--starts=7"], "flag --starts=7: expected 8 or more, or 0"),
        (["--output=/dev/null/tune"], "cannot make folder /dev/null/tune: not a directory"),
    ],
)
def test_bad_input_is_one_line(arguments, message):
    programs.refused(programs.tool("tune_cpg", *QUICK, *arguments), f"tune_cpg.py: {message}")


@pytest.mark.release
def test_another_search_in_the_folder_is_refused(tmp_path):
    tune("--generations=1", f"--output={tmp_path}")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert sorted(before) == ["course.png", "journal.jsonl", "result.json"]
    message = "of a search with seed 0, not 7; delete it or write to another folder"
    done = tune("--generations=2", "--seed=7", f"--output={tmp_path}")
    programs.refused(done, f"tune_cpg.py: {tmp_path}/journal.jsonl: {message}\n")
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
