"""Legged game creatures that walk in style: a dm_control task suite.

import arc_suite
environment = arc_suite.load("queen", "walk")

import gymnasium
env = gymnasium.make("arc_suite/queen-walk-v0")
"""

from arc_suite import rendering, versions

with versions.explained():
    rendering.select_backend()  # before anything imports dm_control

    from arc_suite import registration
    from arc_suite.suite import ALL_TASKS, TASKS_BY_DOMAIN, load

    registration.register()

__all__ = ["ALL_TASKS", "TASKS_BY_DOMAIN", "load"]
