"""The command `arc-suite`, which runs the programs."""

import importlib
import sys

from arc_suite import checks, versions
from arc_suite.cli import program
from arc_suite.cli.programs import FORMER, PROGRAMS, usage


def main(*given: str) -> None:
    """Run the program of the first argument, with the other arguments as its flags.

    Args:
        *given: arguments before those of the command line.
    """
    # Modules that flags name may lie in the current folder. It comes last: no file there hides an installed module.
    sys.path.append("")
    first, *others = [*given, *sys.argv[1:]] or ["--help"]
    if first in PROGRAMS:
        # Imported here and alone: a program defines its flags when it is imported, and some define the same.
        try:
            module = importlib.import_module(f"{PROGRAMS[first]}.{first}")
        except versions.MissingExtra as error:
            sys.exit(f"arc-suite {first}: {error}")
        program.run(module.main, f"arc-suite {first}", others)
    program.guard(lambda: _answer(first), "arc-suite")


def _answer(argument: str) -> None:
    if argument == "--version":
        print(program.VERSION)
    elif argument in ("--help", "-h"):
        print(usage())
    elif argument in FORMER:
        raise ValueError(f"{argument} is no program any more; {FORMER[argument]}")
    else:
        checks.name(argument, PROGRAMS, "program")
