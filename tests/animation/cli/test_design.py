"""`arc-suite design` searches, goes on when it was broken off, and leaves the same files."""

import csv
import json
import sys

import imageio.v3 as imageio
import imports
import programs
import pytest

from arc_suite.robots.spec_files import load_body

QUICK = ("--steps=10", "--seed=3", "--nopages")


def design(*arguments):
    return programs.arc_suite("design", *QUICK, *arguments)


def contents(folder):
    return {path.relative_to(folder): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """A folder with a search over variants of Tick that any cell's walk may win."""
    folder = tmp_path_factory.mktemp("design") / "ticks"
    return folder, design("--around=tick", "--goal=speed", "--bodies=20", "--processes=1", f"--output={folder}")


def test_files(found):
    folder, done = found
    if "cannot render" in done.stderr:
        pytest.skip(done.stderr)
    assert (done.returncode, done.stderr) == (0, "")
    with (folder / "bodies.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["number"]) for row in rows] == list(range(20))
    best = {row["cell"]: row for row in rows if row["elite"] == "1"}
    assert {path.stem for path in (folder / "bodies").iterdir()} == best.keys()
    report = json.loads((folder / "design.json").read_text())
    assert {elite["cell"]: str(elite["second"]["speed"]) for elite in report["elites"]} == {
        cell: row["speed_2"] for cell, row in best.items()
    }
    for cell in best:
        body = load_body(folder / "bodies" / f"{cell}.json")
        assert body.name.startswith("tick_") and len(body.legs) == 6
        assert cell in done.stdout
    assert imageio.imread(folder / "gallery.png").ndim == 3
    header, *lines = [line for line in done.stdout.splitlines() if line.startswith(("cell ", *best))]
    columns = ["cell", "body", "speed, m/s", "evaluated again", "power, W/kg"]
    ends = [header.index(column) + len(column) for column in columns]
    assert all(line[end - 1] != " " and line[end : end + 1] in ("", " ") for line in lines for end in ends[1:])


@pytest.mark.release
def test_processes_make_no_difference(found, tmp_path):
    folder, done = found
    again = design("--around=tick", "--goal=speed", "--bodies=20", "--processes=2", f"--output={tmp_path / 'ticks'}")
    assert again.returncode == done.returncode
    assert contents(tmp_path / "ticks") == contents(folder)


@pytest.mark.release
def test_killed_and_run_again_it_ends_as_if_nothing_had_happened(tmp_path):
    straight, broken = tmp_path / "straight", tmp_path / "broken"
    arguments = ("--goal=speed", "--map=legs", "--processes=2")
    done = design(*arguments, "--bodies=40", f"--output={straight}")
    command = [sys.executable, "-m", "arc_suite", "design", *QUICK, *arguments, "--bodies=2000", f"--output={broken}"]
    lines = programs.killed(command, journal := broken / "journal.jsonl", 2)
    journal.write_bytes(b"".join(lines[:2]) + lines[1][:300])  # a batch, and one that was being written
    again = design(*arguments, "--bodies=40", f"--output={broken}")
    assert again.stdout.replace("broken", "straight") == done.stdout
    assert contents(broken) == contents(straight)


def test_another_search_is_refused_and_left_alone(found):
    folder, _ = found
    before = contents(folder)
    done = design("--around=tick", "--goal=speed", "--bodies=20", "--mass=3", f"--output={folder}")
    programs.refused(done, f"arc-suite design: {folder}")
    assert "of a search with budget" in done.stderr and "write to another folder" in done.stderr
    assert contents(folder) == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--goal=sped",), "unknown goal 'sped'; did you mean 'speed'?"),
        (("--map=legs,legs",), "map: expected one or two different axes of legs, links, height, width, got legs,legs"),
        (("--mass=-1",), "mass: expected a number from 1e-06 to 1e+06, got -1.0"),
        (("--span=nan",), "span: expected a number from 0.05 to 100, got nan"),
        (("--mass=1e6", "--span=0.06"), "no body: "),
        (("--bodies=0",), "flag --bodies=0: expected an integer in the range [1, 100000]"),
        (("--task=stair",), "unknown task 'stair'; did you mean 'stairs'?"),
        (("--task=stairs", "--set=terrain_seed=x"), "terrain_seed: expected an integer from 0 to 4294967295, got 'x'"),
        (("--set=speed=3",), "unknown setting of walk 'speed'"),
        (("--set=rise",), "--set rise: expected name=value"),
        (("--goal=tracking", "--task=walk"), "--goal=tracking: task walk does not measure tracking"),
        (("--around=tik",), "unknown robot 'tik'; did you mean 'tick'?"),
        (("--around=missing.json",), "cannot read missing.json: no such file or directory"),
    ],
)
def test_bad_arguments_are_one_line(tmp_path, arguments, message):
    programs.refused(design(*arguments, f"--output={tmp_path / 'gallery'}"), f"arc-suite design: {message}")
    assert not (tmp_path / "gallery").exists()


def test_an_imported_robot_has_no_mass_to_choose(tmp_path):
    done = design(f"--around={imports.FILES / 'hexapod.urdf'}", "--mass=3", f"--output={tmp_path / 'gallery'}")
    programs.refused(done, "arc-suite design: --mass: goes without --around hexapod_2kg")


@pytest.mark.release
@pytest.mark.parametrize("name", ["go2_like.xml", "hexapod.urdf"])
def test_variants_of_an_imported_robot(name, tmp_path):
    done = design(f"--around={imports.FILES / name}", "--goal=speed", "--bodies=20", f"--output={tmp_path / 'gallery'}")
    if "cannot render" in done.stderr:
        pytest.skip(done.stderr)
    assert done.returncode == 0
    paths = list((tmp_path / "gallery" / "bodies").iterdir())
    heights = {load_body(path).torso.standing_height for path in paths}
    assert len(heights) == len(paths) > 1
    assert imports.body(name).torso.standing_height not in heights


def test_a_folder_is_required():
    programs.refused(design(), "arc-suite design: no folder to write to; say --output=FOLDER\n")


def test_a_search_that_finds_nothing_says_why(tmp_path):
    done = design("--bodies=20", "--power=0.001", "--processes=1", f"--output={tmp_path}")
    assert (done.returncode, done.stderr.count("\n")) == (1, 1)
    assert done.stderr.startswith("arc-suite design: none of 20 bodies counts; most often: ")
    assert (tmp_path / "bodies.csv").read_text().count("\n") == 21
