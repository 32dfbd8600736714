"""Counts lines of code of the package, its core, annexes and wings, and the tests, and functions of more than 40 lines.

Docstrings, comments and blank lines do not count.

Examples:
  python tools/count_lines.py
  python tools/count_lines.py --functions
  python tools/count_lines.py ../another_checkout
"""

import ast
import functools
import io
import tokenize
from collections.abc import Iterator
from pathlib import Path

from absl import flags

from arc_suite.cli import program

ROOT = Path(__file__).resolve().parents[1]
MAX_FUNCTION_LINES = 40
OUTSIDE_CORE = ("importing", "bodies", "learning", "animation")  # folders of the package
_LAYOUT = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}

_FUNCTIONS = flags.DEFINE_bool(
    "functions", False, f"List the package's functions of more than {MAX_FUNCTION_LINES} lines of code."
)


@functools.cache
def code_lines(text: str) -> frozenset[int]:
    """Return the numbers of the lines of a source that hold code."""
    lines = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in _LAYOUT:
            lines.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef) and ast.get_docstring(node):
            lines.difference_update(range(node.body[0].lineno, node.body[0].end_lineno + 1))
    # A text in several lines may have empty ones.
    blank = {number for number, line in enumerate(text.splitlines(), 1) if not line.strip()}
    return frozenset(lines - blank)


def functions(text: str, shortest: int = 0) -> Iterator[tuple[str, int]]:
    """Yield the name of each function of a source and its lines of code, of more than `shortest` lines of any kind."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef):
            span = range(node.lineno, node.end_lineno + 1)
            if len(span) > shortest:
                yield node.name, len(code_lines(text).intersection(span))


def sources(folder: Path) -> dict[Path, str]:
    """Return the text of each Python file below a folder."""
    return {path: path.read_text(encoding="utf-8") for path in sorted(folder.rglob("*.py"))}


def long_functions(folder: Path) -> list[str]:
    """Return a line for each function below a folder that has more than 40 lines of code."""
    lines = []
    for path, text in sources(folder).items():
        for name, count in functions(text, MAX_FUNCTION_LINES):
            if count > MAX_FUNCTION_LINES:
                lines.append(f"{path.relative_to(folder)}: {name}: {count}")
    return lines


def counts(root: Path) -> dict[str, int]:
    """Return the lines of code of each part of a checkout."""
    sizes = {path.relative_to(root): len(code_lines(text)) for path, text in sources(root / "arc_suite").items()}
    size_of_folder = {
        folder: sum(size for path, size in sizes.items() if path.parts[1] == folder) for folder in OUTSIDE_CORE
    }
    package = sum(sizes.values())
    core = package - sum(size_of_folder.values())
    tests = sum(len(code_lines(text)) for text in sources(root / "tests").values())
    return {"package": package, "core": core, **size_of_folder, "tests": tests}


def main(root: str = str(ROOT)) -> None:
    """Print the lines of each part, and the number of long functions."""
    for name, count in counts(Path(root)).items():
        print(f"{name:10} {count:7,}")
    lines = long_functions(Path(root) / "arc_suite")
    print(f"{len(lines)} functions of more than {MAX_FUNCTION_LINES} lines of code")
    if _FUNCTIONS.value:
        print("\n".join(lines))


if __name__ == "__main__":
    program.run(main)
