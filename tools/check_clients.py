"""Runs the code of docs/clients.md, each client in an environment of its own.

    python tools/check_clients.py

A section with a `pip install` line is a client. What one leaves in Minari's folder of datasets, or in the folder where
its code runs, the later ones find.
Prints a line for each and exits with status 1 if one fails.
"""

import os
import pathlib
import re
import shlex
import subprocess
import tempfile
import time
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from arc_suite.cli import program

_ROOT = pathlib.Path(__file__).parents[1]
PAGE = _ROOT / "docs" / "clients.md"
_SECTION = re.compile(r"^## (?P<name>[^\n]*)\n(?P<text>.*?)(?=^## |\Z)", re.MULTILINE | re.DOTALL)
_INSTALL = re.compile(r"^```sh\npip install (.*)\n```", re.MULTILINE)
_CODE = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)


class Client(NamedTuple):
    """A section of the page.

    Attributes:
        name: its heading.
        packages: what pip is to install, `arc_suite` among it where the client can live with it.
        blocks: of code, each a script.
    """

    name: str
    packages: list[str]
    blocks: list[str]


def clients(page: str) -> Iterator[Client]:
    """Yield the clients of the page's text, in its order."""
    for section in _SECTION.finditer(page):
        for packages in _INSTALL.findall(section["text"]):
            yield Client(section["name"], shlex.split(packages), _CODE.findall(section["text"]))


def check(client: Client, surroundings: Mapping[str, str], folder: pathlib.Path) -> str:
    """Make a client's environment, if it is not there, and run its code.

    Args:
        client: of the page.
        surroundings: variables of the code's environment.
        folder: for its scripts, and for what they write where they run.

    Returns:
        What is wrong, in one line.
    """
    venv = _ROOT / f".venv-clients-{client.name.lower()}"
    python = venv / "bin" / "python"
    packages = [part for package in client.packages for part in _of_this_repository(package)]
    commands = [[_ROOT / "tools" / "ensure_venv.sh", venv], [python, "-m", "pip", "install", "-q", *packages]]
    wrong = next(filter(None, (_run(command, os.environ, _ROOT) for command in commands)), "")
    for block in client.blocks if not wrong else ():
        script = folder / "block.py"
        script.write_text(block, encoding="utf-8")
        wrong = wrong or _run([python, script], surroundings, folder)
    return wrong


def _of_this_repository(package: str) -> list[str]:
    extras = package.removeprefix("arc_suite")
    return ["-e", f"{_ROOT}{extras}"] if package.startswith("arc_suite") else [package]


def _run(command: list, surroundings: Mapping[str, str], folder: pathlib.Path) -> str:
    """What is wrong with a command, in one line."""
    done = subprocess.run(command, cwd=folder, env=dict(surroundings), capture_output=True, encoding="utf-8")
    lines = done.stderr.strip().splitlines() or ["no message"]
    return f"{' '.join(map(str, command))}: status {done.returncode}: {lines[-1]}" if done.returncode else ""


def main() -> int:
    """Print a line for each client; return the exit status."""
    failed = False
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        # Some leave caches and tokens in the user's home.
        surroundings = os.environ | {"HOME": str(folder), "MINARI_DATASETS_PATH": str(folder / "datasets")}
        for client in clients(PAGE.read_text(encoding="utf-8")):
            start = time.perf_counter()
            problem = check(client, surroundings, folder)
            failed |= bool(problem)
            print(f"{client.name:20}{time.perf_counter() - start:7.1f} s  {problem or 'ok'}", flush=True)
    return int(failed)


if __name__ == "__main__":
    program.run(main)
