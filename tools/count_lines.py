"""Counts lines of code of the package, its core, annexes and wings, and the tests, and functions of more than 40 lines.

Docstrings, comments and blank lines do not count.

Examples:
  python tools/count_lines.py
  python tools/count_lines.py --functions
  python tools/count_lines.py ../another_checkout
"""

import ast
import io
import tokenize
from collections.abc import Iterator
from pathlib import Path

from absl import flags

from arc_suite.cli import program

ROOT = Path(__file__).resolve().parents[1]
LONG = 40
APART = ("importing", "bodies", "learning", "animation")  # from the core
_LAYOUT = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}

_FUNCTIONS = flags.DEFINE_bool("functions", False, f"List the package's functions of more than {LONG} lines of code.")


def code_lines(text: str) -> set[int]:
    """Return the numbers of the lines of a source that hold code."""
    lines = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in _LAYOUT:
            lines.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node):
            lines.difference_update(range(node.body[0].lineno, node.body[0].end_lineno + 1))
    blank = {number for number, line in enumerate(text.splitlines(), 1) if not line.strip()}  # also inside a string
    return lines - blank


def functions(text: str) -> Iterator[tuple[str, int]]:
    """Yield the name of each function of a source and its lines of code."""
    lines = code_lines(text)
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            yield node.name, len(lines.intersection(range(node.lineno, node.end_lineno + 1)))


def sources(folder: Path) -> dict[Path, str]:
    """Return the text of each Python file below a folder."""
    return {path: path.read_text(encoding="utf-8") for path in sorted(folder.rglob("*.py"))}


def long_functions(folder: Path) -> list[str]:
    """Return a line for each function below a folder that has more than 40 lines of code."""
    found = [(path, *each) for path, text in sources(folder).items() for each in functions(text)]
    return [f"{path.relative_to(folder)}: {name}: {count}" for path, name, count in found if count > LONG]


def counts(root: Path) -> dict[str, int]:
    """Return the lines of code of each part of a checkout."""
    sizes = {path.relative_to(root): len(code_lines(text)) for path, text in sources(root / "arc_suite").items()}
    apart = {room: sum(size for path, size in sizes.items() if path.parts[1] == room) for room in APART}
    package = sum(sizes.values())
    tests = sum(len(code_lines(text)) for text in sources(root / "tests").values())
    return {"package": package, "core": package - sum(apart.values())} | apart | {"tests": tests}


def main(root: str = str(ROOT)) -> None:
    for name, count in counts(Path(root)).items():
        print(f"{name:10} {count:7,}")
    found = long_functions(Path(root) / "arc_suite")
    print(f"{len(found)} functions of more than {LONG} lines of code")
    if _FUNCTIONS.value:
        print("\n".join(found))


if __name__ == "__main__":
    program.run(main)
