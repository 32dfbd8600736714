"""The programs of `arc-suite`, and its help; the standard library alone is imported here."""

import ast
from pathlib import Path

PROGRAMS = (
    "build_model",
    "check",
    "render",
    "animate",
    "play",
    "view",
    "studio",
    "evaluate",
    "style",
    "collect",
    "tune_cpg",
    "train",
    "study",
    "benchmark",
    "enter",
    "export",
    "survey",
    "transfer",
    "design",
    "doctor",
)

_USAGE = """\
arc-suite PROGRAM [flags]

{programs}

arc-suite PROGRAM --help shows the flags of a program, arc-suite --version the version."""


def usage() -> str:
    """Return the help of `arc-suite`."""
    width = max(map(len, PROGRAMS))
    return _USAGE.format(programs="\n".join(f"  {name:<{width}}  {summary(name)}" for name in PROGRAMS))


def summary(name: str) -> str:
    """Return the first line of a program's docstring, read from its source without importing it."""
    source = Path(__file__).with_name(f"{name}.py").read_text(encoding="utf-8")
    return ast.get_docstring(ast.parse(source)).splitlines()[0]
