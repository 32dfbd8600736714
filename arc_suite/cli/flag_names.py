"""Names of the flags of programs, read from their sources: no program is imported, as its extra may not be there."""

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from arc_suite.cli.programs import source_path

_FOLDER = Path(__file__).parent
_SHARED = ast.parse((_FOLDER / "flags.py").read_text(encoding="utf-8"))  # whose functions define flags of many programs
_OF_ALL_PROGRAMS = ast.parse((_FOLDER / "program.py").read_text(encoding="utf-8"))
_DEFINERS = {node.name: node for node in _SHARED.body if isinstance(node, ast.FunctionDef)}
_BOOLEAN = ("DEFINE_bool", "DEFINE_boolean")


class FlagName(NamedTuple):
    """A flag as one types it.

    Attributes:
        name: name without dashes.
        short_name: letter without its dash; "" for none.
        takes_value: whether a value follows.
    """

    name: str
    short_name: str
    takes_value: bool


def flag_names(program: str) -> list[FlagName]:
    """Return the flags of a program of the suite, by the alphabet."""
    source = ast.parse(source_path(program).read_text(encoding="utf-8"))
    return sorted({*_read_flags(source), *_read_flags(_OF_ALL_PROGRAMS)})


def _read_flags(tree: ast.AST) -> Iterator[FlagName]:
    """Yield the flags that a source defines, by absl or by functions that programs share."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        match node.func:
            case ast.Attribute(attr=function) if function.startswith("DEFINE_"):
                yield _flag_of(node, takes_value=function not in _BOOLEAN)
            case ast.Name(id=function) if function in _DEFINERS:
                yield from _read_flags(_DEFINERS[function])


def _flag_of(call: ast.Call, takes_value: bool) -> FlagName:
    """Return the flag that a call of absl defines."""
    short_names = [keyword.value.value for keyword in call.keywords if keyword.arg == "short_name"]
    return FlagName(call.args[0].value, "".join(short_names), takes_value)
