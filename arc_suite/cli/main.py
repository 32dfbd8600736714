"""The command `arc-suite`, which runs the programs."""

import importlib
import sys
from types import ModuleType

from arc_suite import checks, registry, versions
from arc_suite.cli import program
from arc_suite.cli.programs import FORMER_PROGRAMS, PROGRAMS, installed_programs, usage


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
    if first in ("--help", "-h", "--version"):
        program.guard(lambda: print(program.VERSION if first == "--version" else usage()), "arc-suite")
    module = _program_of_another_package(first)
    program.run(module.main, f"arc-suite {first}", others)


def _program_of_another_package(name: str) -> ModuleType:
    """Return the module of a program by `module:name`, or by the name of an entry point; exit where there is none."""
    try:
        points = installed_programs()
        if name in FORMER_PROGRAMS:
            raise ValueError(f"{name} is no program any more; {FORMER_PROGRAMS[name]}")
        if name in points:
            name = f"{points[name].value}:{name}"
        elif ":" not in name:
            checks.name(name, [*PROGRAMS, *points], "program")
        module = registry.find("program", name, PROGRAMS)
        if not callable(getattr(module, "main", None)) or not module.__doc__:
            raise ValueError(f"program {name!r}: expected a module with a docstring and a function main")
    except ValueError as error:
        sys.exit(f"arc-suite: {error}")
    return module
