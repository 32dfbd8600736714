"""Reference pages: the command line, the settings of all tasks, and the API by autodoc."""

import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

from arc_suite.cli.programs import PROGRAMS, program_summary
from arc_suite.learning.studies.text_tables import table
from website import markdown, returns, settings

# Modules that users import, by title of the page about them.
API_MODULES = {
    "Environments": ("arc_suite", "arc_suite.envs.vector", "arc_suite.bodies", "arc_suite.envs.pixels"),
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
    """Return the name of an API page, given its title."""
    return f"api_{title.lower().replace(' ', '_')}"


# Titles of the pages by name.
TITLES = {
    "commands": "Command line",
    "settings": "Settings of all tasks",
    **{api_name(title): f"API: {title.lower()}" for title in API_MODULES},
}


def pages() -> Iterator[tuple[str, str]]:
    """Yield the name and the text of each page."""
    yield "commands", commands_page()
    yield "settings", settings_page()
    for title, modules in API_MODULES.items():
        yield api_name(title), api_page(title, modules)


def settings_page() -> str:
    """Return the page of the settings that every task has."""
    return markdown.page(
        TITLES["settings"],
        "Keys of `task_kwargs` of `arc_suite.load` and `gymnasium.make`, and of `--set name=value`. Where a setting "
        "takes two numbers, every episode draws its own between them. The pages of the [tasks](../tasks.md) list the "
        "settings of each, and [modifiers](../modifiers.md) has examples.",
        settings.table_of_all_tasks(),
    )


def commands_page() -> str:
    """Return the page of all programs, with the help text of each."""
    with ThreadPoolExecutor() as pool:
        help_texts = list(pool.map(_read_help, PROGRAMS))
    lines = [[f"[`{name}`](#{name})", program_summary(name)] for name in PROGRAMS]
    program_table = table(("program", "does"), lines)
    sections = [f"## `{name}`\n\n```text\n{text}\n```" for name, text in zip(PROGRAMS, help_texts, strict=True)]
    return markdown.page(TITLES["commands"], "What `arc-suite PROGRAM --help` prints.", program_table, *sections)


def _read_help(program: str) -> str:
    """Return what a program prints with `--help`."""
    command = [sys.executable, "-m", "arc_suite", program, "--help"]
    process = subprocess.run(command, cwd=returns.ROOT, capture_output=True, encoding="utf-8", check=True)
    return process.stdout.strip()


def api_page(title: str, modules: tuple[str, ...]) -> str:
    """Return a page of Sphinx directives that show the docstrings of modules."""
    sections = []
    for name in modules:
        directive = f"```{{eval-rst}}\n.. automodule:: {name}\n   :members:\n```"
        sections.append(f"## `{name}`\n\n{directive}")
    return markdown.page(TITLES[api_name(title)], *sections)
