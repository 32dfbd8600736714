"""Commands that a person wants after a training, for its run."""

import json
import shlex
from pathlib import Path

from arc_suite.envs.setup import Setup
from arc_suite.tasks.blocks import PAGE_BLOCKS

_UNSEEN_BODY = "spider"  # that a policy of many bodies walks


def next_commands(setup: Setup, folder: Path) -> list[str]:
    """Return the commands that score a run's policy, film it, and make a page to play in.

    Of a policy that no page can play, the last opens a window.

    Args:
        setup: setup of the training.
        folder: folder of the run.
    """
    policy = f"--policy {shlex.quote(str(folder))}"
    name = shlex.quote(folder.name)
    if setup.several:
        policy_of_body = f"--spec {_UNSEEN_BODY} {policy}"
        return [
            f"arc-suite transfer {policy}",
            f"arc-suite render {policy_of_body} -o {name}.mp4",
            f"arc-suite play {policy_of_body} -o {name}.html",
        ]
    judged_setup = setup.judging()
    policy = " ".join([policy, *_flags_of_other_packages(judged_setup)])
    last = f"play {policy} -o {name}.html" if _suits_pages(setup) else f"view {policy}"
    return [f"arc-suite evaluate {policy}", f"arc-suite render {policy} -o {name}.mp4", f"arc-suite {last}"]


def _flags_of_other_packages(setup: Setup) -> list[str]:
    """Return flags that name the modules of a setup again, as files import nothing; none for a setup of the suite."""
    settings = setup.task_kwargs
    robot_flags = [f"--robot {setup.robot}"] if _names_module(setup.robot) else []
    if not any(map(_names_module, (setup.task, *settings))):
        return robot_flags
    settings_flags = [f"--set {shlex.quote(f'{name}={json.dumps(value)}')}" for name, value in settings.items()]
    return [*robot_flags, f"--task {setup.task}", *settings_flags]


def _names_module(name: str) -> bool:
    return ":" in name and not name.startswith("{")  # a body in JSON


def _suits_pages(setup: Setup) -> bool:
    """Return whether a page can play a policy of a setup: by what it observes, and by its actions."""
    blocks = set(setup.definition.sizes) - set(setup.excluded_blocks)
    has_other_actions = "actions" in setup.task_kwargs
    return blocks <= set(PAGE_BLOCKS) and not has_other_actions and not _flags_of_other_packages(setup)
