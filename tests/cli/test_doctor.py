"""The doctor finds what is wrong and says how to mend it; a wrong package is named where the import fails."""

import configparser
import os
import pathlib
import subprocess
import sys

import pytest

import arc_suite
from arc_suite import versions

ROOT = pathlib.Path(__file__).parents[2]
COMMAND = f"pip install {'--no-deps ' if sys.version_info >= (3, 13) else ''}'dm-control==1.0.50'"


def doctor(*path, **variables):
    """Runs the doctor with further folders in front of Python's path; returns status, findings by subject, verdict."""
    environ = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    environ |= {"PYTHONPATH": os.pathsep.join([*map(str, path), str(ROOT)])} | variables
    command = [sys.executable, "-m", "arc_suite", "doctor"]
    done = subprocess.run(command, env=environ, capture_output=True, text=True)
    assert done.stderr == ""
    *lines, verdict = done.stdout.splitlines()
    found = {line.split()[1]: (line.split()[0], line[21:]) for line in lines}
    assert list(found) == ["arc_suite", "system", *versions.REQUIREMENTS, "cores", "MUJOCO_GL", "picture"]
    return done.returncode, found, verdict


def pretend(folder, package, version):
    """Makes Python believe in another version of a package."""
    metadata = folder / f"{package.replace('-', '_')}-{version}.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: {version}\n")


@pytest.mark.slow
def test_healthy():
    status, found, verdict = doctor(MUJOCO_GL="egl")
    assert (status, verdict) == (0, "all is well")
    assert {sign for sign, _ in found.values()} == {"ok"}
    assert found["arc_suite"][1].startswith(f"{arc_suite.__version__}, {ROOT}")
    assert found["dm-control"] == ("ok", "1.0.50, made for ==1.0.50")
    assert found["MUJOCO_GL"] == ("ok", "egl, no display")
    assert found["picture"][1].startswith("drawn by egl, ")


@pytest.mark.slow
def test_wrong_pair(tmp_path):
    pretend(tmp_path, "mujoco", "4.0.0")
    status, found, verdict = doctor(tmp_path)
    assert (status, verdict) == (1, "1 problem")
    assert found["mujoco"] == ("PROBLEM", "4.0.0, made for >=3.17,<3.18; pip install 'mujoco>=3.17,<3.18'")
    assert found["dm-control"][0] == "ok"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("variables", "line"),
    [
        ({"MUJOCO_GL": "off"}, "cannot render: MUJOCO_GL=off turns it off; unset it, or set MUJOCO_GL=egl"),
        (
            {"MUJOCO_GL": "egl", "__EGL_VENDOR_LIBRARY_DIRS": "/nonexistent"},
            "cannot render with MUJOCO_GL=egl: Cannot initialize a headless EGL display; "
            "on Debian, apt-get install libegl1 libgl1 libgl1-mesa-dri and set MUJOCO_GL=egl",
        ),
    ],
)
def test_no_picture(variables, line):
    status, found, verdict = doctor(**variables)
    assert (status, verdict, found["picture"]) == (1, "1 problem", ("PROBLEM", line))


@pytest.mark.slow
def test_a_driver_that_crashes_takes_only_the_picture_along(tmp_path):
    (tmp_path / "sitecustomize.py").write_text(
        "import os, sys\nif 'doctor' in sys.orig_argv[-1] and '-c' in sys.orig_argv: os.abort()\n"
    )
    status, found, _ = doctor(tmp_path)
    assert status == 1
    assert found["picture"] == (
        "PROBLEM",
        "the process ended with status -6; mend the OpenGL driver, or set MUJOCO_GL to egl, osmesa or glfw",
    )


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="takes cores away")
def test_cores_that_are_not_ours(tmp_path):
    (tmp_path / "sitecustomize.py").write_text("import os; os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})")
    _, found, _ = doctor(tmp_path)
    assert found["cores"] == ("ok", f"{os.cpu_count()}; vector environments use 1")


def test_needs_are_those_of_the_package():
    config = configparser.ConfigParser()
    config.read(ROOT / "setup.cfg")
    required = [line.partition(";")[0] for line in config["options"]["install_requires"].split("\n")]
    for package, needed in versions.REQUIREMENTS.items():
        assert f"{package}{needed}" in required


def test_import_that_fails_for_a_wrong_package_names_it(tmp_path):
    pretend(tmp_path, "dm-control", "1.0.9")
    (tmp_path / "dm_control").mkdir()
    (tmp_path / "dm_control" / "__init__.py").write_text("raise AttributeError('flex_vertedge')")
    environ = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])}
    done = subprocess.run([sys.executable, "-c", "import arc_suite"], env=environ, capture_output=True, text=True)
    assert done.returncode == 1
    line = f"cannot import arc_suite: dm-control is 1.0.9 and should be ==1.0.50: {COMMAND}"
    assert done.stderr.splitlines()[-1] == f"ImportError: {line}"
    code = "import sys; sys.argv[1:] = ['doctor']; import arc_suite_command; arc_suite_command.main()"
    done = subprocess.run([sys.executable, "-c", code], env=environ, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (1, f"arc-suite: {line}\n")


def test_import_that_fails_for_another_reason_says_that(tmp_path):
    (tmp_path / "dm_control").mkdir()
    (tmp_path / "dm_control" / "__init__.py").write_text("raise AttributeError('flex_vertedge')")
    environ = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])}
    done = subprocess.run([sys.executable, "-c", "import arc_suite"], env=environ, capture_output=True, text=True)
    assert done.stderr.splitlines()[-1] == "AttributeError: flex_vertedge"
