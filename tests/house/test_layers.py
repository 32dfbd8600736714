"""What import-linter's contracts in pyproject.toml do not say of imports."""

import contextlib
import graphlib
import importlib

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


def test_saved_spec_of_different_bodies_opens():
    """By the path that specs of before name."""
    spec = gymnasium.envs.registration.EnvSpec(
        id="arc_suite/bodies-walk-v0",
        vector_entry_point="arc_suite.envs.bodies:BodiesEnv",
        kwargs={"task_name": "walk"},
    )
    with contextlib.closing(gymnasium.make_vec(spec, num_envs=2, bodies=["queen", "tick"])) as environments:
        assert [body.name for body in environments.unwrapped.bodies] == ["queen", "tick"]
