"""The command `arc-suite`, which runs the programs."""

import ast
import importlib
import sys
from pathlib import Path

from arc_suite import checks, versions
from arc_suite.cli import program

PROGRAMS = (
    "build_model",
    "check",
    "render",
    "animate",
    "view",
    "evaluate",
    "style",
    "collect",
    "tune_cpg",
    "train",
    "study",
    "export",
    "survey",
    "doctor",
)

_USAGE = """\
arc-suite PROGRAM [flags]

{programs}

arc-suite PROGRAM --help shows the flags of a program, arc-suite --version the version."""


def main(*given: str) -> None:
    """Run the program of the first argument, with the other arguments as its flags.

    Args:
        *given: arguments before those of the command line.
    """
    first, *others = [*given, *sys.argv[1:]] or ["--help"]
    if first in PROGRAMS:
        # Imported here and alone: a program defines its flags when it is imported, and some define the same.
        try:
            module = importlib.import_module(f"arc_suite.cli.{first}")
        except versions.MissingExtra as error:
            sys.exit(f"arc-suite {first}: {error}")
        program.run(module.main, f"arc-suite {first}", others)
    program.guard(lambda: _answer(first), "arc-suite")


def _answer(argument: str) -> None:
    if argument == "--version":
        print(program.VERSION)
    elif argument in ("--help", "-h"):
        width = max(map(len, PROGRAMS))
        print(_USAGE.format(programs="\n".join(f"  {name:<{width}}  {summary(name)}" for name in PROGRAMS)))
    else:
        checks.name(argument, PROGRAMS, "program")


def summary(name: str) -> str:
    """Return the first line of a program's docstring, read from its source without importing it."""
    source = Path(__file__).with_name(f"{name}.py").read_text(encoding="utf-8")
    return ast.get_docstring(ast.parse(source)).splitlines()[0]
