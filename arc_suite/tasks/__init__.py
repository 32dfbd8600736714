"""Tasks: what bodies are rewarded for, by name."""

from arc_suite.tasks.contract import Task
from arc_suite.tasks.mimic import Mimic
from arc_suite.tasks.recover import Recover
from arc_suite.tasks.suite import (
    Course,
    Directed,
    Gaps,
    Leap,
    Limp,
    Navigate,
    Roam,
    Rough,
    Shoved,
    Slopes,
    Stairs,
    Steer,
)
from arc_suite.tasks.walk import Walk

_TASK_CLASSES: tuple[type[Task], ...] = (
    Walk,
    Steer,
    Directed,
    Rough,
    Slopes,
    Stairs,
    Gaps,
    Course,
    Leap,
    Shoved,
    Limp,
    Roam,
    Navigate,
    Mimic,
    Recover,
)
TASKS = {task.name: task for task in _TASK_CLASSES}

__all__ = ["TASKS", "Task"]
