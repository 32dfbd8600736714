"""`make demo` finds a Python that the suite runs on, or says in one line what to install."""

import os
import pathlib
import re
import subprocess

import pytest

SCRIPT = pathlib.Path(__file__).parents[2] / "tools" / "ensure_venv.sh"
CONFIG = SCRIPT.parents[1] / "setup.cfg"
# A Python that the suite runs on: it makes environments, and writes down what it installs.
FITS = """
case "$1 $2" in
"-m venv") mkdir -p "$4/bin"; echo "$0" > "$4/made_by"; cp "$0" "$4/bin/python";;
"-m pip") shift 2; echo "$*" > "${0%/bin/python}/installed";;
"-c import sys; sys.exit(sys.version_info < (3, 13))") exit STATUS;;
esac
"""
PYTHONS = {
    "fits": FITS.replace("STATUS", "1"),
    "3.13": FITS.replace("STATUS", "0"),
    "3.15": 'case "$1" in -V) echo "Python 3.15.0";; *) exit 1;; esac',
    "broken": "echo no such version >&2; exit 127",
}


@pytest.fixture
def run(tmp_path):
    def run(**pythons):
        for name, kind in pythons.items():
            program = tmp_path / name.replace("_", ".")
            program.write_text(f"#!/bin/sh\n{PYTHONS[kind]}\n")
            program.chmod(0o755)
        for tool in ("mkdir", "dirname", "cp"):
            (tmp_path / tool).symlink_to(f"/bin/{tool}")
        venv = tmp_path / "venv"
        environ = os.environ | {"PATH": str(tmp_path)}
        done = subprocess.run(["/bin/sh", SCRIPT, venv], env=environ, capture_output=True, text=True)
        made_by = pathlib.Path((venv / "made_by").read_text().strip()).name if venv.exists() else None
        return done.returncode, done.stderr, made_by

    return run


@pytest.mark.parametrize(
    ("pythons", "chosen"),
    [
        ({"python3_11": "fits", "python3_12": "fits", "python3": "fits"}, "python3.11"),
        ({"python3_11": "broken", "python3_12": "fits", "python3": "3.15"}, "python3.12"),
        ({"python3_12": "fits"}, "python3.12"),
        ({"python3_12": "broken", "python3": "fits"}, "python3"),
        ({"python3_13": "3.13", "python3": "3.15"}, "python3.13"),
    ],
)
def test_the_first_python_that_fits_is_taken(run, pythons, chosen):
    assert run(**pythons) == (0, "", chosen)


@pytest.mark.parametrize(
    ("pythons", "found"), [({"python3": "3.15", "python3_12": "broken"}, "Python 3.15.0"), ({}, "no Python")]
)
def test_without_one_a_line_says_what_to_install(run, pythons, found):
    line = f"arc_suite needs Python 3.11 to 3.14, found {found}: install one, such as by 'uv python install 3.12'\n"
    assert run(**pythons) == (1, line, None)


@pytest.mark.parametrize(("python", "comes"), [("fits", False), ("3.13", True)])
def test_from_3_13_on_dm_control_comes_first_and_alone(run, tmp_path, python, comes):
    run(python3=python)
    installed = tmp_path / "venv" / "installed"
    (pinned,) = re.findall(r"^    (dm-control==[^;]*);", CONFIG.read_text(), re.MULTILINE)
    assert (installed.read_text() if installed.exists() else "") == comes * f"install -q --no-deps {pinned}\n"


@pytest.mark.parametrize(("target", "extra"), [("demo", ".[video]"), ("test", ".[dev]")])
def test_what_a_target_installs(target, extra):
    command = ["make", "--dry-run", "--directory", CONFIG.parent, "VENV=/nonexistent", target]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert [line.split()[-1] for line in done.stdout.splitlines() if "pip install" in line] == [f"'{extra}'"]


AS_ROOT = "missing Debian packages, installed now as root: "
OF_ROOT = "missing: please have root run apt-get install libegl1 libgl1\n"


@pytest.mark.parametrize(
    ("programs", "line"),
    [
        ({}, "missing: please install what Debian calls libegl1 libgl1\n"),
        ({"apt-get": "", "id": "echo 1000"}, OF_ROOT),
        ({"apt-get": "", "id": "echo 1000", "sudo": "exit 1"}, OF_ROOT),
        ({"apt-get": "echo $* >> ran", "id": "echo 0"}, f"{AS_ROOT}apt-get install libegl1 libgl1\n"),
        (
            {"apt-get": "echo $* >> ran", "id": "echo 1000", "sudo": "[ $1 = -n ] || $*"},
            f"{AS_ROOT}sudo apt-get install libegl1 libgl1\n",
        ),
    ],
)
def test_debian_packages_are_named_before_root_installs_them(tmp_path, programs, line):
    for name, text in programs.items():
        (tmp_path / name).write_text(f"#!/bin/sh\n{text}\n")
        (tmp_path / name).chmod(0o755)
    command = ["/bin/sh", SCRIPT.with_name("ensure_packages.sh"), "libegl1", "libgl1"]
    done = subprocess.run(command, cwd=tmp_path, env={"PATH": f"{tmp_path}"}, capture_output=True, text=True)
    assert done.stderr == line
    installs = line.startswith(AS_ROOT)
    assert (done.returncode, (tmp_path / "ran").exists()) == (0 if installs else 1, installs)
