"""Legged game creatures that walk in style: a dm_control task suite.

As a dm_env and as a Gymnasium environment::

    import arc_suite
    environment = arc_suite.load("queen", "walk")

    import gymnasium
    env = gymnasium.make("arc_suite/queen-walk-v0")
"""

import sys
from collections.abc import Mapping
from typing import Any

if sys.orig_argv[1:3] == ["-m", "arc_suite"]:  # a program, from whose first import on Ctrl-C is one line
    from arc_suite.cli import interrupts

    interrupts.exit_at_once()

from arc_suite import moved, versions
from arc_suite.simulation import opengl

moved.install_finder()
with versions.explain_import_errors():
    opengl.select_backend()  # before anything imports dm_control

    from arc_suite import registration, registry
    from arc_suite.envs.dm import load
    from arc_suite.envs.prepare import symmetry
    from arc_suite.envs.setup import Setup
    from arc_suite.registration import register

    registration.register_ids()

__version__ = "0.1.0"
ALL_TASKS: tuple[tuple[str, str], ...]  # of __getattr__, as packages register further ones
TASKS_BY_DOMAIN: Mapping[str, tuple[str, ...]]
__all__ = ["load", "symmetry", "register", "Setup", "TASKS_BY_DOMAIN", "ALL_TASKS"]  # noqa: F822  # the last two are of __getattr__


def __getattr__(name: str) -> Any:
    if name == "ALL_TASKS":
        return registry.all_tasks()
    if name == "TASKS_BY_DOMAIN":
        return registry.tasks_by_domain()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
