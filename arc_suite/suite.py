"""Names of `dm_control.suite`, as its users type them: `from arc_suite import suite`, `suite.load("queen", "walk")`.

Attributes:
    ALL_TASKS: pairs of a robot and a task, with those that other packages have registered.
    BENCHMARKING: the pairs of the benchmark.
    TASKS_BY_DOMAIN: tasks by robot.
"""

import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from arc_suite import registry
from arc_suite.envs.dm import load

__all__ = ["load", "ALL_TASKS", "BENCHMARKING", "TASKS_BY_DOMAIN"]

ALL_TASKS: tuple[tuple[str, str], ...]  # of __getattr__, as packages register further ones
TASKS_BY_DOMAIN: Mapping[str, tuple[str, ...]]
BENCHMARKING = registry.BENCHMARKING

if not TYPE_CHECKING:  # for checkers every name would exist

    def __getattr__(name: str) -> Any:
        match name:
            case "ALL_TASKS":
                return registry.all_tasks()
            case "TASKS_BY_DOMAIN":
                return registry.tasks_by_domain()
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}", name=name, obj=sys.modules[__name__])
