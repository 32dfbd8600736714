"""Former paths of modules: saved specs of environments, notebooks and other packages import them.

An alias is the module itself.
"""

import importlib
import importlib.abc
import importlib.machinery
import sys

# Of packages, their modules too.
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
    """Imports a module by its former path."""

    def find_spec(self, fullname: str, path=None, target=None) -> importlib.machinery.ModuleSpec | None:
        """Return a spec of a former path; None for other names."""
        return None if find_path(fullname) is None else importlib.machinery.ModuleSpec(fullname, self)

    def exec_module(self, module) -> None:
        """Put the module of today in the place of the empty one that the import system has made."""
        sys.modules[module.__name__] = importlib.import_module(find_path(module.__name__))


def find_path(name: str) -> str | None:
    """Return the path of today of a module, or of a module in a package, that has moved; None for others."""
    for former, path in MOVED.items():
        if name == former or name.startswith(f"{former}."):
            return path + name.removeprefix(former)
    return None


def install_finder() -> None:
    """Let imports of former paths find the modules of today.

    The finder comes first: an empty folder of a former path, as checkouts leave them, would be a namespace package.
    """
    sys.meta_path.insert(0, Finder())
