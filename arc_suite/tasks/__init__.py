"""What bodies are asked to do: name -> task."""

from arc_suite.tasks.contract import Task
from arc_suite.tasks.disturbed import Limp, Roam, Shoved
from arc_suite.tasks.ground import Course, Gaps, Rough, Slopes, Stairs
from arc_suite.tasks.navigate import Navigate
from arc_suite.tasks.steer import Steer
from arc_suite.tasks.walk import Walk

TASKS = {task.name: task for task in (Walk, Steer, Rough, Slopes, Stairs, Gaps, Course, Shoved, Limp, Roam, Navigate)}

__all__ = ["TASKS", "Task"]
