"""Reference pages: the command line, the settings of all tasks, and the API by autodoc."""

import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

from arc_suite.cli.programs import PROGRAMS, program_summary
from arc_suite.learning.studies.text_tables import table
from website import markdown, returns, settings

# Modules that users import, by title of their page.
API = {
    "Environments": ("arc_suite", "arc_suite.envs.vector", "arc_suite.envs.bodies", "arc_suite.envs.pixels"),
    "Demonstrators and policies": ("arc_suite.cpg", "arc_suite.policies"),
    "Training and evaluation": ("arc_suite.learning", "arc_suite.evaluation", "arc_suite.evaluation.published"),
    "Style": ("arc_suite.style", "arc_suite.style.metrics"),
    "Datasets": ("arc_suite.data",),
    "Pictures and clips": ("arc_suite.animation", "arc_suite.animation.clips"),
    "Bodies": ("arc_suite.robots.spec", "arc_suite.robots.spec_files", "arc_suite.bodies.generator"),
    "Gaits and shapes": ("arc_suite.robots.gaits", "arc_suite.bodies.shaping", "arc_suite.bodies.families"),
    "Tasks": (
        "arc_suite.tasks.contract",
        "arc_suite.tasks.modifiers",
        "arc_suite.tasks.terms",
        "arc_suite.tasks.privileged",
    ),
    "Arenas": ("arc_suite.arenas.arena",),
    "Studies": ("arc_suite.learning.studies.tables",),
}


def api_name(title: str) -> str:
    """Return the name of a page of the API."""
    return f"api_{title.lower().replace(' ', '_')}"


# Pages by name.
TITLES = {
    "commands": "Command line",
    "settings": "Settings of all tasks",
    **{api_name(title): f"API: {title.lower()}" for title in API},
}


def pages() -> Iterator[tuple[str, str]]:
    """Yield names of pages and their texts."""
    yield "commands", commands_page()
    yield "settings", settings_page()
    for title, modules in API.items():
        yield api_name(title), api_page(title, modules)


def settings_page() -> str:
    """Return the page of the settings that every task has."""
    return markdown.page(
        TITLES["settings"],
        "Keys of `task_kwargs` of `arc_suite.load` and `gymnasium.make`, and of `--set name=value`. Where a setting "
        "takes two numbers, every episode draws its own between them. The pages of the [tasks](../tasks.md) list the "
        "settings of each, and [modifiers](../modifiers.md) has examples.",
        settings.of_all_tasks(),
    )


def commands_page() -> str:
    """Return the page of all programs, with the help of each."""
    with ThreadPoolExecutor() as pool:
        helps = list(pool.map(_help, PROGRAMS))
    parts = [f"## `{name}`\n\n```text\n{text}\n```" for name, text in zip(PROGRAMS, helps, strict=True)]
    listed = table(("program", "does"), ([f"[`{name}`](#{name})", program_summary(name)] for name in PROGRAMS))
    return markdown.page(TITLES["commands"], "What `arc-suite PROGRAM --help` prints.", listed, *parts)


def _help(program: str) -> str:
    command = [sys.executable, "-m", "arc_suite", program, "--help"]
    done = subprocess.run(command, cwd=returns.ROOT, capture_output=True, encoding="utf-8", check=True)
    return done.stdout.strip()


def api_page(title: str, modules: tuple[str, ...]) -> str:
    """Return a page of Sphinx directives that take the docstrings of modules."""
    parts = [f"```{{eval-rst}}\n.. automodule:: {name}\n   :members:\n```" for name in modules]
    return markdown.page(
        TITLES[api_name(title)], *(f"## `{name}`\n\n{part}" for name, part in zip(modules, parts, strict=True))
    )
