"""Legged game creatures that walk in style: a dm_control task suite.

As a dm_env and as a Gymnasium environment::

    import arc_suite
    environment = arc_suite.load("queen", "walk")

    import gymnasium
    env = gymnasium.make("arc_suite/queen-walk-v0")
"""

import importlib
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if sys.orig_argv[1:3] == ["-m", "arc_suite"]:  # a program, from whose first import on Ctrl-C is one line
    from arc_suite.cli import interrupts

    interrupts.exit_at_once()

from arc_suite import moved, versions
from arc_suite.simulation import opengl, viewer

moved.install_finder()
with versions.explain_import_errors():
    opengl.select_backend()  # before anything imports dm_control
    viewer.check_windows()

    from arc_suite import registration, suite
    from arc_suite.envs.dm import load
    from arc_suite.envs.prepare import symmetry
    from arc_suite.envs.setup import Setup
    from arc_suite.registration import register
    from arc_suite.suite import BENCHMARKING

    registration.register_ids()

__version__ = "0.1.0"
ALL_TASKS: tuple[tuple[str, str], ...]  # see `suite`
TASKS_BY_DOMAIN: Mapping[str, tuple[str, ...]]
__all__ = ["load", "symmetry", "register", "Setup", "suite", "TASKS_BY_DOMAIN", "ALL_TASKS", "BENCHMARKING"]

# Packages that the core does not import: `arc_suite.learning` imports it.
_PACKAGES = ("animation", "bodies", "data", "evaluation", "importing", "learning", "policies", "style")

if TYPE_CHECKING:
    from arc_suite import animation as animation
    from arc_suite import bodies as bodies
    from arc_suite import data as data
    from arc_suite import evaluation as evaluation
    from arc_suite import importing as importing
    from arc_suite import learning as learning
    from arc_suite import policies as policies
    from arc_suite import style as style
else:  # for checkers every name would exist

    def __getattr__(name: str) -> Any:
        if name in _PACKAGES:
            return importlib.import_module(f"{__name__}.{name}")
        if name in ("ALL_TASKS", "TASKS_BY_DOMAIN"):
            return getattr(suite, name)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}", name=name, obj=sys.modules[__name__])
