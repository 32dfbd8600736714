"""Files of the project agree: workflows, hooks of pre-commit, CITATION.cff, setup.cfg, Makefile."""

import configparser
import pathlib
import re

import programs
import pytest

import arc_suite

ROOT = pathlib.Path(__file__).parents[2]
WORKFLOWS = "\n".join(path.read_text() for path in sorted((ROOT / ".github" / "workflows").glob("*.yml")))
SETUP = configparser.ConfigParser()
SETUP.read(ROOT / "setup.cfg")


def test_hooks_and_lint_have_the_same_ruff():
    (pinned,) = re.findall(r"^ruff==(\S+)$", SETUP["options.extras_require"]["dev"], re.MULTILINE)
    assert re.findall(r"ruff==([\d.]+)", (ROOT / ".pre-commit-config.yaml").read_text()) == [pinned, pinned]


def test_a_clone_on_the_path_shadows_no_module():
    """Installed for editing, this folder is on Python's path; folders without `__init__.py` yield to any package."""
    modules = {path.stem for path in ROOT.glob("*.py")} | {path.parent.name for path in ROOT.glob("*/__init__.py")}
    assert modules == {"arc_suite", SETUP["options"]["py_modules"]}
    assert SETUP["options"]["package_dir"].split() == ["=", "."]


def test_the_citation_names_this_version():
    assert f"\nversion: {arc_suite.__version__}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"version = {{{arc_suite.__version__}}}" in (ROOT / "docs" / "cite.md").read_text()


def test_workflows_name_targets_that_exist():
    targets = re.findall(r"run: make (\S+)", WORKFLOWS)
    makefile = (ROOT / "Makefile").read_text()
    assert "test" in targets and "dist" in targets
    assert [name for name in targets if not re.search(rf"^{name}:", makefile, re.MULTILINE)] == []


def test_workflows_run_on_versions_of_python_that_are_supported():
    versions = set(re.findall(r"\b3\.\d+\b", "".join(re.findall(r"python: (\[.*\])", WORKFLOWS))))
    assert versions == {"3.11", "3.12", "3.13"}
    assert all(f"Python :: {version}" in SETUP["metadata"]["classifiers"] for version in versions)


@pytest.mark.parametrize("command", sorted(set(re.findall(r"run: (arc-suite .*)", WORKFLOWS))))
def test_a_command_of_a_workflow_is_understood(command):
    arguments = command.removesuffix(" --version").split()
    programs.passed(programs.run(*arguments, "--version", cwd=ROOT))


@pytest.mark.parametrize("name", ["Makefile", ".github/workflows/tests.yml"])
def test_tests_and_tools_that_a_file_runs_exist(name):
    paths = re.findall(r"(?<![\w./-])(?:tests|tools|examples)/[\w./-]*\w", (ROOT / name).read_text())
    assert paths and [path for path in paths if not (ROOT / path).exists()] == []


def test_pages_name_targets_that_exist():
    makefile = (ROOT / "Makefile").read_text()
    named = {name for path in ROOT.glob("docs/*.md") for name in re.findall(r"`make ([a-z-]+)`", path.read_text())}
    assert "test" in named
    assert [name for name in named if not re.search(rf"^([\w-]+ )*{name}( [\w-]+)*:", makefile, re.MULTILINE)] == []
