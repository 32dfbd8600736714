"""The leaderboard takes entries of others after playing them again, and own studies."""

import json

import programs
import pytest

from arc_suite.learning.studies import leaderboard


@pytest.fixture(scope="module")
def entry(tmp_path_factory):
    """A file that `arc-suite evaluate --json` wrote: episodes of some thirty steps."""
    path = tmp_path_factory.mktemp("entry") / "entry.json"
    programs.passed(programs.arc_suite("evaluate", "--robot=tick", "--policy=random", f"--json={path}"))
    return path


def enter(folder, entry, *arguments):
    return programs.arc_suite("enter", entry, *arguments, cwd=folder)


def test_an_entry_is_played_again_and_added(entry, tmp_path):
    for name in ("noise", "noise", "more"):  # the second replaces the first
        out = programs.passed(enter(tmp_path, entry, f"--name={name}"))
    mean = json.loads(entry.read_text())["robots"]["tick"]["return"]["mean"]
    assert out == f"tick, walk: more, return {mean:.1f}, all episodes equal\nwrote studies/README.md\n"
    rows = [line for line in (tmp_path / "studies" / "README.md").read_text().splitlines() if line.startswith("| tick")]
    assert [row.split(" | ")[1] for row in rows] == ["noise", "more"]
    assert f" | {mean:.1f} | " in rows[0] and "[entry](entries/tick-walk-noise.json)" in rows[0]
    assert (tmp_path / "studies" / "entries" / "tick-walk-noise.json").read_text() == entry.read_text()


def test_rows_of_studies_stay(entry, tmp_path):
    cells = dict.fromkeys(leaderboard.HEADS, "-")
    cells |= {"robot, task": "tick, walk", "algorithm": "own", "seeds": "1", "return": "99.0"}
    for study in ("mine", "others", "mine"):  # the third replaces the first
        leaderboard.write(tmp_path / "studies", study, [cells | {"study": study, "configuration": study}])
    programs.passed(enter(tmp_path, entry, "--name=noise"))
    page = (tmp_path / "studies" / "README.md").read_text()
    assert page.count("| tick, walk | own | ") == 2 and "| [mine](mine/README.md) |" in page
    assert page.index("| tick, walk | own | ") < page.index("| tick, walk | noise | ")  # the higher return first


def _changed(report, *keys, value):
    for key in keys[:-1]:
        report = report[key]
    report[keys[-1]] = value


@pytest.mark.parametrize(
    ("keys", "value", "message"),
    [
        (("versions", "mujoco"), "3.0.0", "versions: the file says "),
        (("policy_sha256",), "00", 'policy_sha256: the file says "00", and here it is null'),
        (("robots", "tick", "preset"), ["medium"], "unknown preset "),
        (("policy",), "os:system", "policy 'os:system': expected --policy with its file, got none"),
        (("seed",), 5, "expected episodes from seed 0, got 5"),
        (("robots", "tick", "provenance", "task_sha256"), "00", 'task_sha256: the file says "00", and here it is '),
        (("robots", "tick", "provenance", "body_sha256"), "00", 'body_sha256: the file says "00", and here it is '),
        (("robots", "tick", "provenance", "task"), "nowhere:stroll", "task 'nowhere:stroll': files import nothing; "),
        (("robots", "tick", "provenance"), [], "no entry: provenance: expected a mapping of names to values, got []"),
        (("robots", "tick", "episodes"), [], "expected 100 episodes of tick, got 0; evaluate without --episodes\n"),
        (("policy",), "mine:make", 'policy: the file says "mine:make", and here it is "random"\n'),
        (("robots", "tick", "episodes", 3, "total"), 3999.0, "returns of tick: the file says ["),
        (("robots",), {}, "expected robots, got none"),
    ],
)
def test_what_differs_is_one_line_and_enters_nothing(entry, tmp_path, keys, value, message):
    report = json.loads(entry.read_text())
    _changed(report, *keys, value=value)
    (tmp_path / "entry.json").write_text(json.dumps(report))
    done = enter(tmp_path, "entry.json", "--name=noise", *["--policy=random"][: value == "mine:make"])
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith(f"arc-suite enter: entry.json: {message}") and done.stderr.count("\n") == 1
    assert not (tmp_path / "studies").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "expected a file that arc-suite evaluate --json wrote; see --help"),
        (("none.json",), "cannot read none.json: no such file or directory"),
        (("text.json",), "text.json: no entry: "),
        (("list.json",), "list.json: no entry: entry: expected a mapping of names to values, got []"),
    ],
)
def test_what_is_no_entry_is_one_line(tmp_path, arguments, message):
    (tmp_path / "text.json").write_text("text")
    (tmp_path / "list.json").write_text("[]")
    done = programs.arc_suite("enter", *arguments, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (1, "") and done.stderr.startswith(f"arc-suite enter: {message}")


def test_a_name_is_no_path(entry, tmp_path):
    done = enter(tmp_path, entry, "--name=../a|b")
    assert done.stderr == "arc-suite enter: --name=../a|b: expected letters, digits, _, - and .\n"
