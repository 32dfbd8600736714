"""Former paths of modules: saved specs of environments, notebooks and other packages import them.

An import by a former path gives the module of today itself, not a copy of it.
"""

import importlib
import importlib.abc
import importlib.machinery
import sys

# Former paths -> paths of today. A package's entry is also for the modules in it.
MOVED = {
    "arc_suite.envs.bodies": "arc_suite.bodies",
    "arc_suite.envs.worlds": "arc_suite.learning.worlds",
    "arc_suite.models.families": "arc_suite.bodies.families",
    "arc_suite.models.importing": "arc_suite.importing",
    "arc_suite.policies.universal": "arc_suite.bodies.universal",
    "arc_suite.robots.generator": "arc_suite.bodies.generator",
    "arc_suite.robots.shaping": "arc_suite.bodies.shaping",
    "arc_suite.robots.varied": "arc_suite.bodies.varied",
    "arc_suite.tasks.tokens": "arc_suite.bodies.tokens",
}


class Finder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Finder and loader of the import system that imports modules by their former paths."""

    def find_spec(self, fullname: str, path=None, target=None) -> importlib.machinery.ModuleSpec | None:
        """Return the spec of a module with a former path; None for other modules."""
        if find_path(fullname) is None:
            return None
        return importlib.machinery.ModuleSpec(fullname, self)

    def exec_module(self, module) -> None:
        """Replace the empty module that the import system has made by the module of today."""
        sys.modules[module.__name__] = importlib.import_module(find_path(module.__name__))


def find_path(name: str) -> str | None:
    """Return the path of today, given a former path; None for other paths."""
    for former, path in MOVED.items():
        if name == former or name.startswith(f"{former}."):
            return path + name.removeprefix(former)
    return None


def install_finder() -> None:
    """Let imports of former paths find the modules of today.

    This finder must be the first: the usual one would import an empty folder of a former path as a namespace package.
    Checkouts leave such folders.
    """
    sys.meta_path.insert(0, Finder())
