"""The command `arc-suite`, which runs the programs."""

import importlib
import sys
from collections.abc import Sequence
from types import ModuleType
from typing import NoReturn

from arc_suite import checks, registry, versions
from arc_suite.cli import interrupts, program
from arc_suite.cli.programs import (
    CURES_OF_WORDS,
    FORMER_PROGRAMS,
    PROGRAMS,
    WORDS,
    docstring_of,
    installed_programs,
    usage,
)
from arc_suite.cli.version import describe_suite

_HELP_WORDS = ("help", "--help", "-h")


def main(*arguments: str) -> None:
    """Run the program of the first argument, with the other arguments as its flags, and exit.

    Args:
        *arguments: before those of the command line.
    """
    interrupts.exit_at_once()
    # Modules that flags name may lie in the current folder. It comes last: no file there hides an installed module.
    sys.path.append("")
    program_name, *program_arguments = [*arguments, *sys.argv[1:]] or ["help"]
    if program_name in _HELP_WORDS and program_arguments:  # as in `arc-suite help train`
        program_name, *further_words = program_arguments
        if further_words:
            program.guard(lambda: _refuse_word(further_words[0]), "arc-suite")
        program_arguments = ["--help"]
    # `guard` and `run` exit the process.
    if program_name in ("version", "--version", "-V"):
        program.guard(lambda: _print_version(program_arguments), "arc-suite")
    elif program_name in _HELP_WORDS:
        program.guard(lambda: print(usage()), "arc-suite")
    elif program_name in PROGRAMS:
        module = _import_program(program_name)
    else:
        module = _program_of_another_package(program_name)
    program.run(module.main, f"arc-suite {program_name}", program_arguments)


def _refuse_word(word: str) -> NoReturn:
    """Raise ValueError for a word behind the program of arc-suite help."""
    raise ValueError(f"unexpected argument {checks.preview(word)}; help takes one program")


def _print_version(arguments: Sequence[str]) -> None:
    if arguments:
        raise ValueError(f"unexpected argument {checks.preview(arguments[0])}; version takes none")
    print(describe_suite())


def _import_program(name: str) -> ModuleType:
    """Return the module of a program of the suite; exit where it needs packages that are not installed.

    No other program is imported: programs define their flags when they are imported, and some define the same flags.
    """
    try:
        return importlib.import_module(f"{PROGRAMS[name]}.{name}")
    except versions.MissingExtra as error:
        sys.exit(f"arc-suite {name}: {error}")


def _program_of_another_package(name: str) -> ModuleType:
    """Return the module of a program by `module:name`, or by the name of an entry point; exit where there is none."""
    try:
        entry_points = installed_programs()
        if name.startswith("-"):
            raise ValueError(f"{name}: expected a program before its flags, such as arc-suite evaluate {name}")
        for flag, words in (("robot", registry.robot_words()), ("task", registry.TASKS)):
            if name in words:
                raise ValueError(f"{name}: expected a program first, such as arc-suite evaluate --{flag}={name}")
        if name in FORMER_PROGRAMS:
            raise ValueError(f"{name} is no program any more; {FORMER_PROGRAMS[name]}")
        if name in entry_points:
            full_name = f"{entry_points[name].module}:{name}"
        elif ":" in name:
            full_name = name
        elif name in CURES_OF_WORDS:
            raise ValueError(f"unknown program {name!r}; {CURES_OF_WORDS[name]}")
        else:
            full_name = checks.name(name, [*PROGRAMS, *entry_points, *WORDS], "program")
        module = registry.find("program", full_name, PROGRAMS)
        if not callable(getattr(module, "main", None)) or not docstring_of(module):
            raise ValueError(f"program {full_name!r}: expected a module with a docstring and a function main")
    except ValueError as error:
        sys.exit(f"arc-suite: {error}")
    return module
