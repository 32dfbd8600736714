"""Settings of tasks as tables: defaults, bounds and meanings."""

from collections.abc import Mapping

from arc_suite.envs.setup import Setup
from arc_suite.learning.studies.text_tables import table
from arc_suite.robots import ROBOTS
from arc_suite.tasks import setting_table
from arc_suite.tasks.contract import Task
from arc_suite.tasks.setting_table import Setting

HEADS = ("setting", "default", "bounds", "meaning")


def table_of_task(task_class: type[Task]) -> str:
    """Return the table of the settings that a task has in addition to those of all tasks."""
    settings = {robot: setting_table.own_settings(Setup.of(robot, task_class.name).definition) for robot in ROBOTS}
    return table(
        HEADS, [_cells(dict(zip(settings, line, strict=True))) for line in zip(*settings.values(), strict=True)]
    )


def table_of_all_tasks() -> str:
    """Return the table of the settings that every task has."""
    return table(HEADS, [_cells({"all robots": setting}) for setting in setting_table.shared_settings()])


def _cells(settings: Mapping[str, Setting]) -> tuple[str, str, str, str]:
    """Return the cells of a setting's line, given the setting by robot."""
    texts = {robot: setting.value for robot, setting in settings.items()}
    first_setting = next(iter(settings.values()))
    if len(set(texts.values())) == 1:
        default = first_setting.value
    else:
        default = ", ".join(f"{robot} {text}" for robot, text in texts.items())
    value = {"weights": "see Reward"}.get(first_setting.name, default)
    return f"`{first_setting.name}`", value, first_setting.bounds, first_setting.meaning
