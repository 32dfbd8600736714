"""What bodies are to do: name -> task."""

from arc_suite.tasks.contract import Task
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

_LANES = Rough, Slopes, Stairs, Gaps, Course, Leap
TASKS = {task.name: task for task in (Walk, Steer, Directed, *_LANES, Shoved, Limp, Roam, Navigate)}

__all__ = ["TASKS", "Task"]
