"""The wheel: what is in it, and that it works where there is no clone."""

import email
import os
import pathlib
import re
import shutil
import subprocess
import sys
import sysconfig
import zipfile

import mujoco
import programs
import pytest

import arc_suite

ROOT = pathlib.Path(__file__).parents[2]
NOT_SOURCES = shutil.ignore_patterns(".*", "__pycache__", "*.egg-info", "build", "out")
BUILT = ("viewer.js", "play.js", "mujoco.wasm.zlib")  # by `make web`

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Builds in a copy: a build leaves files among the sources, and reuses what another one left."""
    folder = tmp_path_factory.mktemp("wheel")
    shutil.copytree(ROOT, folder / "sources", ignore=NOT_SOURCES)
    for name in BUILT:
        file = folder / "sources" / "arc_suite" / "animation" / "web" / name
        if not file.exists():  # `make web` has not been run here
            file.parent.mkdir(exist_ok=True)
            file.write_text("// in its place\n")
    command = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--wheel-dir", folder, folder / "sources"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def run(wheel, tmp_path_factory):
    """Installs into an empty environment that borrows dependencies alone, and runs commands there."""
    folder = tmp_path_factory.mktemp("environment")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder], check=True)
    install = ["install", "--quiet", "--no-deps", "--no-index", "--disable-pip-version-check", wheel]
    subprocess.run([sys.executable, "-m", "pip", "--python", folder / "bin" / "python", *install], check=True)
    (site,) = folder.glob("lib/python*/site-packages")
    # Comes after the environment's own; that a clone is installed there for development is not taken over.
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib"))
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}

    def run(program, *arguments):
        command = [folder / "bin" / program, *arguments]
        return programs.passed(subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True))

    return run


def metadata(wheel):
    with zipfile.ZipFile(wheel) as archive:
        (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        return email.message_from_bytes(archive.read(name))


@pytest.mark.long
def test_the_wheel_holds_the_package_and_nothing_else(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    folder = ROOT / "arc_suite"
    paths = [*folder.rglob("*.py"), *folder.glob("policies/packaged/*"), *folder.glob("robots/examples/*.json")]
    paths += [
        folder / name for name in ("py.typed", "cpg/searched.json", "evaluation/anchors.csv", "evaluation/judging.csv")
    ]
    paths += [folder / "animation" / name for name in ("page.html", "play.html", "design/gallery.html")]
    paths += [folder / "animation" / "web" / name for name in BUILT]
    package = {str(path.relative_to(ROOT)) for path in paths} | {"arc_suite_command.py"}
    prefix = f"arc_suite-{arc_suite.__version__}.dist-info/"
    assert {name for name in names if not name.startswith(prefix)} == package
    assert [name for name in names if name.endswith("/LICENSE")]


def test_its_description_has_no_link_that_only_a_repository_has(wheel):
    about = metadata(wheel)
    assert (about["Version"], about["License-Expression"]) == (arc_suite.__version__, "Apache-2.0")
    assert about["Author"] == "the arc_suite developers"
    assert (about["Home-page"], about["Project-URL"]) == (None, None), "there is no site yet"
    assert "Programming Language :: Python :: 3.13" in about.get_all("Classifier")
    description = about.get_payload()
    links = re.findall(r"\]\(([^)]*)\)", description)
    assert links
    assert [link for link in links if not link.startswith("https://")] == []
    assert "<img" not in description


@pytest.mark.long
def test_the_package_comes_from_the_wheel(run):
    code = "import arc_suite; print(arc_suite.__file__)"
    assert pathlib.Path(run("python", "-c", code).strip()).parents[1].name == "site-packages"
    assert str(ROOT) not in run("python", "-c", code)


@pytest.mark.long
def test_programs(run):
    assert run("arc-suite", "--version").startswith(f"arc_suite {arc_suite.__version__}, ")
    model = mujoco.MjModel.from_xml_string(run("arc-suite", "build_model", "--legs", "6", "--links", "3"))
    assert model.nu == 18
    assert mujoco.MjModel.from_xml_string(run("arc-suite", "build_model", "--spec", "spider")).nu == 24
    assert run("arc-suite", "--help") == run("python", "-m", "arc_suite", "--help")
    table = run("arc-suite", "evaluate", "--robot", "tick", "--episodes", "1")
    assert table.splitlines()[-2].startswith("tick, refined ")  # a note on its motors comes last
    assert "arc-suite doctor" in run("python", "-m", "arc_suite", "doctor", "--help")


def test_dist_without_the_viewer_fails(tmp_path):
    """Other builds go on without it."""
    shutil.copytree(ROOT / "web", tmp_path / "web")
    shutil.copy(ROOT / "Makefile", tmp_path)
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "npm").write_text("#!/bin/sh\necho no such registry >&2\nexit 1\n")
    (tmp_path / "bin" / "npm").chmod(0o755)
    environ = os.environ | {"PATH": os.pathsep.join([str(tmp_path / "bin"), os.environ["PATH"]])}
    done = subprocess.run(["make", "dist"], cwd=tmp_path, env=environ, capture_output=True, text=True)
    assert done.returncode != 0
    assert done.stderr.splitlines()[0] == "no such registry"
    assert not (tmp_path / "dist").exists()
