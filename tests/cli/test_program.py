"""Tools fail with one line, and leave whole files or none."""

import collections
import functools
import json
import os
import platform
import pty
import signal
import subprocess
import sys
import termios

import programs
import pytest

import arc_suite
from arc_suite import files
from arc_suite.cli import program
from arc_suite.files import writing, writing_json

TOOL = '''"""Count.

python count.py --count 3
"""
import signal, sys
from absl import flags
from arc_suite.cli import program
from arc_suite import files
from arc_suite.simulation.opengl import RenderingUnavailable

COUNT = flags.DEFINE_integer("count", 1, "How many.", lower_bound=0)
KINDS = flags.DEFINE_multi_enum("kind", [], ["a", "b"], "Which.")
RAISES = flags.DEFINE_string("raises", None, "What goes wrong.")
OUTPUT = flags.DEFINE_string("output", None, "File to write after many lines.")

def main():
    kinds = {"value": ValueError, "os": OSError, "gl": RenderingUnavailable, "key": KeyError, "int": KeyboardInterrupt,
        "memory": MemoryError}
    if RAISES.value == "signal":
        signal.raise_signal(signal.SIGINT)
    for _ in program.progress(range(COUNT.value), "counting"):
        pass
    if RAISES.value:
        raise kinds[RAISES.value]("a\\n  b")
    print("counted", COUNT.value)
    with files.writing_json(OUTPUT.value) as file:
        for number in range(10_000 if OUTPUT.value else 0):
            print("counting", number)
            print("still counting", number, file=sys.stderr)
        file["counted"] = COUNT.value

if __name__ == "__main__":
    program.run(main)
'''
HELP = """\
Run:
  --count=N            How many. [0 or more; default: 1]
  --kind=TEXT          Which. [a or b; repeatable]
  --raises=TEXT        What goes wrong.

Output:
  --output=TEXT        File to write after many lines.

Help:
  -h, --help           Print this text and exit.
  -V, --version        Print the version, the folder and the commit, and exit.
"""


@pytest.fixture(scope="module")
def tool(tmp_path_factory):
    path = tmp_path_factory.mktemp("tool") / "count.py"
    path.write_text(TOOL)
    return functools.partial(programs.run, path)


def test_run_calls_main_with_flags_parsed(tool):
    assert programs.passed(tool("--count=3")) == "counted 3\n"


@pytest.mark.parametrize("kind", ["value", "os", "gl", "memory"])
def test_expected_errors_are_one_line(tool, kind):
    programs.refused(tool(f"--raises={kind}"), "count.py: a b\n")


CALLER = '''"""Call a function.

python call.py raise_value
"""
import carry
from arc_suite.cli import program

def main(function=""):
    if function == "main":
        raise ValueError("no function")
    getattr(carry, function)()

if __name__ == "__main__":
    program.run(main)
'''
CARRY = """import warnings
import numpy as np
from absl import flags
from arc_suite import checks

class Carry:
    def terms(self):
        return np.zeros(2) + np.zeros(3)

def add(): Carry().terms()
def check(): checks.integer("legs", "two", 1)
def read(): open("missing.txt")
def refuse(): raise flags.Error("no flag")
def parse(): (lambda: float("two"))()
def warn(): warnings.warn("light")
def divide(): return np.ones(2) / np.zeros(2)
def look_up(): {}["weight"]
"""


@pytest.mark.parametrize(
    ("function", "line"),
    [
        ("add", "operands could not be broadcast together with shapes (2,) (3,) (carry.py:8, in Carry.terms)"),
        ("check", "legs: expected an integer from 1, got 'two' (carry.py:11, in check)"),
        ("read", "missing.txt: no such file or directory (carry.py:12, in read)"),
        ("parse", "could not convert string to float: 'two' (carry.py:14, in parse.<lambda>)"),
        ("warn", "light (carry.py:15)"),
        ("divide", "divide by zero encountered in divide (carry.py:16)"),
        ("refuse", "no flag"),
        ("main", "no function"),
    ],
)
def test_errors_of_other_code_end_with_their_place(tmp_path, function, line):
    """Those of flags, and of the program itself, do not."""
    (tmp_path / "lab").mkdir()
    (tmp_path / "lab" / "carry.py").write_text(CARRY)
    (tmp_path / "programs").mkdir()
    (tmp_path / "programs" / "call.py").write_text(CALLER)
    done = programs.run("../programs/call.py", function, cwd=tmp_path / "lab", path=tmp_path / "lab")
    assert (done.stdout, done.stderr) == ("", f"call.py: {line}\n")
    assert done.returncode == (0 if function in ("warn", "divide") else 1)


@pytest.mark.parametrize("length", [300, 5000])  # of a name, and of a path, both longer than Linux allows
@pytest.mark.parametrize("words", [["evaluate", "--policy=NAME.npz"], ["check", "NAME.json"], ["card", "NAME"]])
def test_names_that_are_too_long_are_lines(words, length, tmp_path):
    command = [word.replace("NAME", "n" * length) for word in words]
    done = programs.run("-m", "arc_suite", *command, cwd=tmp_path)
    assert done.returncode == 1 and done.stderr.endswith(": file name too long\n") and "Errno" not in done.stderr
    assert done.stderr.count("\n") == 1 and len(done.stderr) < 500


def test_development_mode_keeps_the_traceback_of_other_code(tmp_path):
    (tmp_path / "carry.py").write_text("raise ValueError('too heavy')")
    command = [sys.executable, "-X", "dev", "-m", "arc_suite", "evaluate", "--task=carry:carry"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 1
    assert "Traceback" in done.stderr and done.stderr.endswith("ValueError: too heavy\n")


def test_unexpected_errors_keep_their_traceback(tool):
    done = tool("--raises=key")
    assert done.returncode == 1
    assert "Traceback" in done.stderr


@pytest.mark.parametrize("kind", ["signal", "int"])
def test_an_interrupt_is_one_line_and_exit_status_130(tool, kind):
    done = tool(f"--raises={kind}")
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "count.py: interrupted\n")


@pytest.mark.slow
@pytest.mark.parametrize("redirection", ["", "2>&1"])
def test_without_a_reader_the_work_goes_on(tool, tmp_path, redirection):
    target = tmp_path / "a.json"
    line = f"{sys.executable} {tool.args[0]} --output={target} {redirection} | head -n 1; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True)
    assert (done.returncode, done.stdout.count("\n")) == (0, 1)
    assert "Error" not in done.stderr
    assert json.loads(target.read_text()) == {"counted": 1}


@pytest.mark.parametrize(
    ("argument", "message"),
    [
        ("--count=-1", "flag --count=-1: expected a non-negative integer\n"),
        ("--count=many", "flag --count=many: expected a non-negative integer\n"),
        ("--cuont=1", "unknown flag 'cuont'; did you mean 'count'? (there are: count, help, kind, output, "),
        ("--cou-nt=1", "unknown flag 'cou_nt'; did you mean 'count'? (there are: "),
        ("--xyz=1", "unknown flag 'xyz' (there are: count, help, kind, output, raises, version)\n"),
        ("--version=maybe", "flag --version=maybe: expected true or false\n"),
        ("stray", "unexpected argument 'stray'; see --help"),
    ],
)
def test_wrong_arguments_are_one_line(tool, argument, message):
    programs.refused(tool(argument), f"count.py: {message}")


@pytest.mark.parametrize("flag", ["--help", "-h"])
def test_help_shows_docstring_and_flags_of_the_program_alone(tool, flag):
    text = programs.passed(tool(flag))
    assert text.startswith("Count.\n\npython count.py ") and "How many." in text
    assert text.split("\n\n", 2)[-1] == HELP


@pytest.mark.slow
def test_help_is_cut_short_without_complaint(tool):
    line = f"{sys.executable} {tool.args[0]} --help | head -n 1"
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("Count.\n", "")


def test_version(tool):
    assert programs.passed(tool("--version", "--raises=value")).startswith(f"arc_suite {arc_suite.__version__}, ")


@pytest.mark.slow
def test_progress_is_shown_on_terminals_alone(tool):
    assert tool("--count=3").stderr == ""
    ours, theirs = pty.openpty()
    termios.tcsetwinsize(theirs, (24, 80))
    done = subprocess.run([sys.executable, tool.args[0], "--count=3"], stdout=subprocess.DEVNULL, stderr=theirs)
    os.close(theirs)
    shown = os.read(ours, 10_000).decode()
    os.close(ours)
    assert done.returncode == 0
    assert "counting" in shown and "3/3" in shown


def test_writing_replaces_the_target_of_a_link_too_and_only_at_the_end(tmp_path):
    target = tmp_path / "a.txt"
    target.write_text("old")
    with writing(target) as temporary:
        temporary.write_text("new")
        assert temporary.suffix == ".txt"
        assert target.read_text() == "old"
    assert target.read_text() == "new"
    with pytest.raises(KeyError), writing(target) as temporary:
        temporary.write_text("half")
        raise KeyError
    assert target.read_text() == "new"
    assert list(tmp_path.iterdir()) == [target]
    (link := tmp_path / "link.txt").symlink_to(target)
    with writing(link) as temporary:
        temporary.write_text("newer")
    assert link.is_symlink() and target.read_text() == "newer"


def test_files_whose_names_begin_alike_are_written_side_by_side(tmp_path):
    """Long names are shorter in the names of temporary files."""
    targets = [tmp_path / f"{'walk_' * 10}{name}.npz" for name in ("left", "right")]
    with writing(targets[0]) as one, writing(targets[1]) as other:
        one.write_text("left")
        other.write_text("right")
    assert [target.read_text() for target in targets] == ["left", "right"]
    assert len(list(tmp_path.iterdir())) == 2


@pytest.mark.parametrize(
    ("path", "reason"),
    [
        ("missing/a.txt", "no such file or directory"),
        ("file/a.txt", "not a directory"),
        ("folder", "is a directory"),
        ("/dev/null", "permission denied"),
        ("x" * 300, "file name too long"),
    ],
)
def test_writing_refuses_before_the_work_starts(tmp_path, monkeypatch, path, reason):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    (tmp_path / "folder").mkdir()
    with pytest.raises(OSError, match=f"^cannot write {path}: {reason}$"), writing(path):
        pytest.fail("the block ran")
    with pytest.raises(OSError, match=f"^cannot write {path}: {reason}$"):
        files.check_target(path)


def test_a_flag_of_one_value_that_stands_twice_is_told():
    for name, arguments, line in (
        ("render", ("--spec=spider", "--spec", "crab"), "--spec: 2 values; the last one holds, crab\n"),
        ("play", ("--robot", "tick", "--robot=a", "--robot=b"), "--robot: 3 values; the last one holds, b\n"),
        ("animate", ("--clips=walk", "--clips=run"), ""),  # as commands append flags to those of others
        ("animate", ("--spec=crab", "--spec=crab"), ""),
        ("render", ("--legs=4", "--legs=6"), ""),
        ("evaluate", ("--robot=tick", "--robot=queen"), ""),
    ):
        done = programs.arc_suite(name, *arguments, "--help")
        assert (done.returncode, done.stderr) == (0, line and f"arc-suite {name}: {line}")


def test_a_check_leaves_files_and_folders_as_they_are(tmp_path):
    (tmp_path / "old.txt").write_text("old")
    for path in (None, tmp_path / "old.txt", tmp_path / "new.txt"):
        files.check_target(path)
    files.check_folder(tmp_path / "new" / "folder")
    files.check_folder(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["old.txt"]
    assert (tmp_path / "old.txt").read_text() == "old"


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path):
    file = tmp_path / "file"
    file.touch()
    for path in (file, file / "folder"):
        with pytest.raises(OSError, match=f"^cannot make folder {path}: {file} is a file$"):
            files.check_folder(path)


@pytest.mark.parametrize(
    ("command", "line"),
    [
        ("transfer --policy=none --output=missing/a.csv", "cannot write missing/a.csv: no such file or directory"),
        ("motion none.npz --output=missing/a.npz", "cannot write missing/a.npz: no such file or directory"),
        ("evaluate --policy=none --json=missing/a.json", "cannot write missing/a.json: no such file or directory"),
        ("export none --output=missing/a.onnx", "cannot write missing/a.onnx: no such file or directory"),
        ("benchmark samples --results=file/a", "cannot make folder file/a/samples-ppo: {folder}/file is a file"),
    ],
)
def test_programs_check_their_files_before_they_work(command, line, tmp_path):
    """Even before they read the files of their arguments, none of which is there."""
    (tmp_path / "file").touch()
    program, *arguments = command.split()
    done = programs.arc_suite(program, *arguments, cwd=tmp_path)
    programs.refused(done, f"arc-suite {program}: {line.format(folder=tmp_path)}\n")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_writing_json_is_strict_json(tmp_path):
    pair = collections.namedtuple("pair", "left right")
    with writing_json(tmp_path / "a.json") as report:
        report["a"] = pair(1.5, (float("nan"), float("inf"), {"b": "c"}))
    assert json.loads((tmp_path / "a.json").read_text(), parse_constant=pytest.fail) == {
        "a": {"left": 1.5, "right": [None, None, {"b": "c"}]}
    }


def test_writing_json_writes_nothing_without_a_path_or_after_an_error(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with writing_json(None) as report:
        report["a"] = 1
    with pytest.raises(KeyError), writing_json("a.json") as report:
        raise KeyError
    assert list(tmp_path.iterdir()) == []


KILLED = """
import os, signal
from arc_suite import files
with files.writing("report[1].json") as temporary:
    temporary.write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_what_a_kill_left_is_deleted_by_the_next_that_writes_the_file(tmp_path):
    (tmp_path / "killed.py").write_text(KILLED)
    assert programs.run("killed.py", cwd=tmp_path).returncode == -signal.SIGKILL
    (left,) = tmp_path.glob(".report*")
    *_, process, _ = left.name.split(".")
    changes = ((platform.node(), "elsewhere"), ("report", "other"), (process, str(os.getppid())))
    others = [left.with_name(left.name.replace(*change)) for change in changes]  # also that of a process that runs
    for other in others:
        other.touch()
    with writing(tmp_path / "report[1].json"):
        assert not left.exists()
    assert sorted(tmp_path.glob(".*")) == sorted(others)


@pytest.mark.parametrize("name", [".w.{node}.{dead}.mp4", ".walk.{node}.{dead}.glb", ".walk.{node}.{dead}.json"])
def test_what_a_kill_left_for_other_files_is_deleted_when_it_is_old(name, tmp_path):
    dead = programs.subprocess.Popen(["true"])
    dead.wait()
    left = tmp_path / name.format(node=platform.node(), dead=dead.pid)
    alive = tmp_path / name.format(node=platform.node(), dead=os.getppid())
    elsewhere = tmp_path / name.format(node="elsewhere", dead=dead.pid)
    own_files = [tmp_path / ".w.mp4", tmp_path / f".{platform.node()}.12", tmp_path / f".a.{platform.node()}.b.mp4"]
    for path in (left, alive, elsewhere, *own_files):
        path.touch()
    with writing(tmp_path / "other.png"):
        assert left.exists()  # it may be of a process that is not seen from here
    for path in (left, alive, elsewhere, *own_files):
        os.utime(path, (0, 0))
    with writing(tmp_path / "other.png"):
        assert not left.exists()
    assert all(path.exists() for path in (alive, elsewhere, *own_files))


def test_long_work_writes_a_line_in_half_a_minute_into_a_log(monkeypatch, capsys):
    monkeypatch.setattr(program, "_LOG_INTERVAL", 0.0)  # in place of 30 s
    with program.progress(total=4, desc="training", unit="step") as bar:
        for returned in (1.5, 2.5):
            bar.set_postfix_str(f"return {returned}", refresh=False)
            bar.update(2)
    output = capsys.readouterr()
    assert output.out == "" and "\r" not in output.err and "\x1b" not in output.err
    lines = output.err.splitlines()
    assert lines[0].startswith("training:   0% 0/4 [") and lines[-1].startswith("training: 100% 4/4 [")
    assert all("return" in line for line in lines[1:])


def test_short_work_writes_none(capsys):
    assert list(program.progress(range(3), desc="training")) == [0, 1, 2]
    assert capsys.readouterr().err == ""
