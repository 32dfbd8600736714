"""Print the settings of a task: value, bounds and meaning of each.

  arc-suite settings --robot tick --task walk
  arc-suite settings --spec spider --task rough
  arc-suite settings --task walk --set gait=wave

Values are those of this body; --set shows what follows from a setting. Settings go into --set name=value of
every program with --task, and into task_kwargs of arc_suite.load and gymnasium.make. Where a setting takes
two numbers, every episode draws its own between them.
"""

import textwrap
from collections.abc import Iterable

from absl import flags

from arc_suite.cli.flags import define_body, define_task, only_body, task_from_flags
from arc_suite.envs.setup import Setup
from arc_suite.tasks.setting_table import Setting, own_settings, shared_settings

FLAGS = flags.FLAGS
define_body()
define_task()

_INDENT = 4  # columns before a meaning


def main() -> None:
    """Print the settings of the task."""
    body = only_body()
    task_name, task_kwargs = task_from_flags()
    setup = Setup.of(body, task_name, task_kwargs)
    task = setup.definition
    time_limit = task.step_limit * task.scene.control_timestep  # s
    _print_settings(f"{setup.task_label} of {setup.name}", own_settings(task, setup.task_kwargs))
    print()
    shared_values = {"time_limit": time_limit} | dict(setup.kind.modifiers) | setup.task_kwargs
    _print_settings("every task", shared_settings(shared_values))


def _print_settings(heading: str, settings: Iterable[Setting]) -> None:
    """Print a heading, and two lines or more for each setting: name, value and bounds, then the meaning."""
    print(f"Settings of {heading}:\n")
    for setting in settings:
        limits = "" if setting.bounds == "-" else f"  [{setting.bounds}]"
        meaning = textwrap.wrap(setting.meaning, flags.get_help_width() - _INDENT, break_on_hyphens=False)
        print(f"{setting.name} = {setting.value}{limits}")
        for line in meaning:
            print(" " * _INDENT + line)
