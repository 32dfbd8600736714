"""Find names and statements that make a reader stop, in Python code.

`python tools/plainness.py` checks arc_suite and tools, and exits with 1 if it finds any.
`python tools/plainness.py --change COMMIT` checks the lines that were added since a commit.
`python tools/plainness.py --counts arc_suite tools` prints how many there are in each folder.

It finds three kinds:

- parallel assignments, `a, b = x, y`. Swaps are plain, and so are pairs that a function returns.
- functions named by a participle, such as `moved`. A verb with its object says what happens: `move_torso`. Methods that
  other packages implement keep the names of their contract.
- locals that say nothing, such as `found` or `own`.
"""

import argparse
import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

_VAGUE_LOCALS = """
asked both done drawn each found given gone held here inner kept known made named new old one other others outer own
ready rest said seen taken there told wanted way whole
"""
_IRREGULAR_PARTICIPLES = """
bent broken built chosen drawn flown found frozen given grown held hidden kept known laid lost made sent shown sought
spoken stood sunk swept taken thought thrown told won worn written
"""
VAGUE_LOCALS = frozenset(_VAGUE_LOCALS.split())
IRREGULAR_PARTICIPLES = frozenset(_IRREGULAR_PARTICIPLES.split())  # those that do not end in "ed"
VERBS_IN_ED = frozenset({"bed", "embed", "exceed", "feed", "need", "proceed", "seed", "shed", "speed"})
AUXILIARIES = frozenset({"are", "get", "has", "is", "was", "with"})  # words that make a question of a participle
# Methods of contracts that bodies, tasks, commands and modifiers of other packages implement, and functions that the
# documentation names.
CONTRACT_NAMES = frozenset(
    {
        "desired",
        "ended",
        "env_is_wrapped",
        "mirrored",
        "mutated",
        "privileged",
        "resampled",
        "scaled",
        "shaped",
        "traced",
    }
)


class Finding(NamedTuple):
    """A place that makes a reader stop."""

    path: Path
    line: int
    kind: str
    text: str


class Counts(NamedTuple):
    """Numbers of all assignments, functions and locals of a file."""

    assignments: int
    functions: int
    locals: int


def is_participle(name: str) -> bool:
    """Return whether the name of a function is, or ends with, a participle without a verb in front."""
    words = name.strip("_").split("_")
    if len(words) > 1 and words[0] in AUXILIARIES:
        return False
    last_word = words[-1]
    if last_word in IRREGULAR_PARTICIPLES:
        return True
    return last_word.endswith("ed") and last_word not in VERBS_IN_ED


def is_parallel(assignment: ast.Assign) -> bool:
    """Return whether an assignment gives several names a value each, without a swap."""
    target = assignment.targets[0]
    value = assignment.value
    if not (isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)):
        return False
    names = {ast.unparse(item) for item in target.elts}
    values = {ast.unparse(item) for item in value.elts}
    return names.isdisjoint(values)


def is_property(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    """Return whether a function is a property, whose name is an adjective or a noun."""
    return any("property" in ast.unparse(decorator) for decorator in function.decorator_list)


def is_named_by_participle(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    """Return whether a function of this project's choice is named by a participle."""
    if function.name.startswith("__") or function.name in CONTRACT_NAMES or is_property(function):
        return False
    return is_participle(function.name)


def class_fields(tree: ast.Module) -> set[ast.expr]:
    """Return the names of fields that classes declare, which are no locals."""
    fields = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            fields |= {statement.target for statement in node.body if isinstance(statement, ast.AnnAssign)}
    return fields


def examine(path: Path) -> tuple[list[Finding], Counts]:
    """Return what a file holds that makes a reader stop, and how much code it holds.

    Raises:
        ValueError: the file is no Python code.
    """
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    try:
        tree = ast.parse(text)
    except SyntaxError as error:
        raise ValueError(f"{path}: {error}") from None
    findings = []
    assignments = functions = local_names = 0
    fields = class_fields(tree)
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign):
            assignments += 1
            if is_parallel(node):
                findings.append(Finding(path, node.lineno, "parallel assignment", lines[node.lineno - 1].strip()))
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            functions += 1
            if is_named_by_participle(node):
                findings.append(Finding(path, node.lineno, "participle", node.name))
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store) and node not in fields:
            local_names += 1
            if node.id in VAGUE_LOCALS:
                findings.append(Finding(path, node.lineno, "vague local", node.id))
    return findings, Counts(assignments, functions, local_names)


def python_files(path: Path) -> Iterator[Path]:
    """Yield the Python files of a folder, or a file itself.

    Raises:
        OSError: there is no such file or folder.
    """
    if path.is_dir():
        yield from sorted(path.rglob("*.py"))
    elif path.exists():
        yield path
    else:
        raise OSError(f"{path}: no such file or folder")


def added_lines(commit: str) -> dict[Path, set[int]]:
    """Return the numbers of the lines of each file that were added since a commit.

    Raises:
        ValueError: an unknown commit, or no checkout of git.
    """
    command = ["git", "diff", "--unified=0", "--no-color", commit, "--", "arc_suite/*.py", "tools/*.py"]
    result = subprocess.run(command, capture_output=True, text=True, encoding="utf-8")
    if result.returncode != 0:
        raise ValueError(f"git cannot compare with {commit}: {result.stderr.strip().splitlines()[0]}")
    numbers: dict[Path, set[int]] = {}
    path = None
    for line in result.stdout.splitlines():
        if line.startswith("+++ "):
            path = Path(line.removeprefix("+++ b/"))  # of a file that was deleted: /dev/null, which has no added lines
        elif line.startswith("@@"):
            first, count = re.search(r"\+(\d+)(?:,(\d+))?", line).groups(default="1")
            numbers.setdefault(path, set()).update(range(int(first), int(first) + int(count)))
    return {path: lines for path, lines in numbers.items() if lines}


def find_in_files(paths: list[Path]) -> list[Finding]:
    """Return what all Python files of files and folders hold."""
    findings = []
    for path in paths:
        for file in python_files(path):
            findings += examine(file)[0]
    return findings


def find_in_change(commit: str) -> list[Finding]:
    """Return what the lines hold that were added since a commit."""
    findings = []
    for path, lines in added_lines(commit).items():
        findings += [finding for finding in examine(path)[0] if finding.line in lines]
    return findings


def print_counts(folders: list[Path]) -> None:
    """Print a row for each folder."""
    print(f"{'folder':34} {'parallel':>14} {'participles':>14} {'vague locals':>14}")
    for folder in folders:
        findings: list[Finding] = []
        totals = Counts(0, 0, 0)
        for path in python_files(folder):
            file_findings, counts = examine(path)
            findings += file_findings
            totals = Counts(
                totals.assignments + counts.assignments,
                totals.functions + counts.functions,
                totals.locals + counts.locals,
            )
        kinds = [finding.kind for finding in findings]
        columns = zip(("parallel assignment", "participle", "vague local"), totals, strict=True)
        cells = " ".join(f"{kinds.count(kind):>5} of {total:>5}" for kind, total in columns)
        print(f"{str(folder):34} {cells}")


def main() -> int:
    """Print findings, one line each, and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="*", type=Path, default=[Path("arc_suite"), Path("tools")])
    parser.add_argument("--change", metavar="COMMIT")
    parser.add_argument("--counts", action="store_true")
    arguments = parser.parse_args()
    if arguments.counts:
        print_counts(arguments.folders)
        return 0
    try:
        findings = find_in_change(arguments.change) if arguments.change else find_in_files(arguments.folders)
    except (OSError, ValueError) as error:
        sys.exit(f"plainness: {error}")
    for finding in findings:
        print(f"{finding.path}:{finding.line}: {finding.kind}: {finding.text}")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
