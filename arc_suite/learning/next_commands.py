"""Commands that a person wants after a training, for its run."""

import json
import shlex
from pathlib import Path

from arc_suite.cli.programs import source_path
from arc_suite.envs.setup import Setup
from arc_suite.tasks.blocks import PAGE_BLOCKS

_UNSEEN_BODY = "spider"  # that a policy of many bodies walks


def has_built_pages() -> bool:
    """Return whether this installation can write pages to play in: `make web` builds their scripts."""
    return (source_path("play").parents[1] / "web" / "play.js").is_file()


def next_commands(setup: Setup, folder: Path, has_pages: bool) -> list[str]:
    """Return the commands that score a run's policy, film it, and make a page to play in.

    Without pages, or of a policy that no page can play, the last opens a window.

    Args:
        setup: setup of the training.
        folder: folder of the run.
        has_pages: whether pages can be written where the commands run.
    """
    policy = f"--policy {shlex.quote(str(folder))}"
    name = shlex.quote(folder.name)
    if setup.several:
        policy_of_body = f"--spec {_UNSEEN_BODY} {policy}"
        return [
            f"arc-suite transfer {policy}",
            f"arc-suite render {policy_of_body} -o {name}.mp4",
            f"arc-suite {_play_or_view(policy_of_body, name, has_pages)}",
        ]
    judged_setup = setup.judging()
    policy = " ".join([policy, *_flags_of_other_packages(judged_setup)])
    last = _play_or_view(policy, name, has_pages and _suits_pages(setup))
    return [f"arc-suite evaluate {policy}", f"arc-suite render {policy} -o {name}.mp4", f"arc-suite {last}"]


def _play_or_view(flags: str, name: str, on_page: bool) -> str:
    """Return the arguments of `arc-suite` that make a page to play in, or open a window."""
    return f"play {flags} -o {name}.html" if on_page else f"view {flags}"


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
