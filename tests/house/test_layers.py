"""What import-linter's contracts in pyproject.toml do not say of imports."""

import contextlib
import graphlib
import importlib
import pathlib
import re

import grimp
import gymnasium
import interpreters
import pytest

from arc_suite import moved


def test_no_import_goes_round():
    """The contracts look at siblings; here a package and its own modules count, too."""
    graph = grimp.build_graph("arc_suite", cache_dir=None)
    imports = {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}
    graphlib.TopologicalSorter(imports).prepare()


def test_import_is_light():
    """Neither the wings nor what only extras or windows need."""
    heavy = ("torch", "jax", "stable_baselines3", "shimmy", "matplotlib", "imageio", "viser")
    heavy += ("arc_suite.learning", "arc_suite.animation")
    code = f"import sys, arc_suite; print(sorted(sys.modules.keys() & {set(heavy)}))"
    assert interpreters.printed(code) == ["[]"]


@pytest.mark.parametrize("name", ["learning.train", "evaluation.evaluate", "animation.animate", "style.measure"])
def test_functions_are_there_without_an_import_of_their_package(name):
    """As docs/programs.md writes them."""
    assert interpreters.printed(f"import arc_suite; print(arc_suite.{name}.__name__)") == [name.split(".")[1]]


# Loads a robot, and plays a step with its demonstrator.
_STEP = """
import sys
import arc_suite
from arc_suite.cpg import Demonstrator
environment = arc_suite.load("queen", "walk")
demonstrator = Demonstrator(environment, "medium")
environment.step(demonstrator(environment.reset()))
rooms = ("importing", "bodies", "learning", "animation")
print(sorted(name for name in sys.modules if name.startswith(tuple(f"arc_suite.{room}" for room in rooms))))
"""


def test_step_imports_neither_wing_nor_annex():
    assert interpreters.printed(_STEP) == ["[]"]


def test_modules_of_a_former_package_are_aliases():
    """Not second copies of them."""
    former, today = "arc_suite.models.importing.naming", "arc_suite.importing.naming"
    assert importlib.import_module(former) is importlib.import_module(today)


@pytest.mark.parametrize("former", moved.MOVED)
def test_former_paths_are_aliases(former):
    assert importlib.import_module(former) is importlib.import_module(moved.MOVED[former])


def test_code_and_pages_name_modules_by_their_paths_of_today():
    """Former paths are for what others have saved."""
    root = pathlib.Path(__file__).parents[2]
    patterns = []
    for former in moved.MOVED:
        package, _, name = former.rpartition(".")
        patterns += [rf"{re.escape(former)}\b", rf"from {re.escape(package)} import [^\n]*\b{name}\b"]
    is_former = re.compile("|".join(patterns))
    folders = ("arc_suite", "tools", "tests", "docs", "examples", "studies")
    files = [root / "README.md", *(file for folder in folders for file in (root / folder).rglob("*.*"))]
    texts = {file: file.read_text() for file in files if file.suffix in (".py", ".md", ".ipynb")}
    lines = [
        f"{file.relative_to(root)}: {match[0]}" for file, text in texts.items() for match in is_former.finditer(text)
    ]
    former_in_use = [
        line for line in lines if not line.startswith(("arc_suite/moved.py", "tests/house/test_layers.py"))
    ]
    assert former_in_use == []


def test_saved_spec_of_different_bodies_opens():
    """By the path that specs of before name."""
    spec = gymnasium.envs.registration.EnvSpec(
        id="arc_suite/bodies-walk-v0",
        vector_entry_point="arc_suite.envs.bodies:BodiesEnv",
        kwargs={"task_name": "walk"},
    )
    with contextlib.closing(gymnasium.make_vec(spec, num_envs=2, bodies=["queen", "tick"])) as environments:
        assert [body.name for body in environments.unwrapped.bodies] == ["queen", "tick"]
