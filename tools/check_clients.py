"""Runs the code of docs/clients.md and docs/first_steps.md, each section in an environment of its own.

    python tools/check_clients.py

A section with a `pip install` line is a client; its commands and code run in order. What one leaves in Minari's folder
of datasets, or in the folder where its page runs, the later ones find.
Prints a line for each and exits with status 1 if one fails.
"""

import os
import pathlib
import re
import shlex
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import page_commands

from arc_suite.cli import program

_ROOT = page_commands.ROOT
PAGES = [_ROOT / "docs" / f"{name}.md" for name in ("clients", "first_steps")]
_INSTALL = re.compile(r"^```sh\npip install (.*)\n```\n", re.MULTILINE)
_SHELLS = {"sh": ["bash", "-e"], "python": ["python"]}


class Client(NamedTuple):
    """A section of a page.

    Attributes:
        name: its heading.
        packages: what pip is to install, `arc_suite` among it where the client can live with it.
        blocks: in the section's order, without the installation.
    """

    name: str
    packages: list[str]
    blocks: list[page_commands.Block]


def clients(page: str) -> Iterator[Client]:
    """Yield the clients of a page's text, in its order."""
    for name, text in page_commands.sections(page).items():
        for packages in _INSTALL.findall(text):
            yield Client(name, shlex.split(packages), list(page_commands.blocks(_INSTALL.sub("", text))))


def check(client: Client, surroundings: Mapping[str, str], folder: pathlib.Path) -> str:
    """Make a client's environment, if it is not there, and run its blocks.

    Args:
        client: client of the page.
        surroundings: variables of the blocks' environment.
        folder: where they run, and that their files go into.

    Returns:
        What is wrong, in one line.
    """
    venv = _ROOT / f".venv-clients-{re.sub('[^a-z0-9]+', '-', client.name.lower())}"
    python = venv / "bin" / "python"
    commands = [[_ROOT / "tools" / "ensure_venv.sh", venv], [python, "-m", "pip", "install", "-q", *client.packages]]
    wrong = next(filter(None, (_run(command, os.environ, _ROOT) for command in commands)), "")
    surroundings = surroundings | {"PATH": f"{python.parent}{os.pathsep}{surroundings['PATH']}"}
    for block in client.blocks:
        script = folder / (block.file or "block")
        script.write_text(block.text, encoding="utf-8")
        if not block.file:
            wrong = wrong or _run([*_SHELLS[block.kind], script], surroundings, folder)
    return wrong


def _run(command: list, surroundings: Mapping[str, str], folder: pathlib.Path) -> str:
    """Run a command, and return what is wrong, in one line; nothing if it succeeds."""
    result = subprocess.run(command, cwd=folder, env=dict(surroundings), capture_output=True, encoding="utf-8")
    if result.returncode == 0:
        return ""
    lines = result.stderr.strip().splitlines() or ["no message"]
    return f"{' '.join(map(str, command))}: status {result.returncode}: {lines[-1]}"


def main() -> int:
    """Print a line for each client; return the exit status."""
    has_failed = False
    for page in PAGES:
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            shutil.copytree(_ROOT / "examples", folder / "examples")
            # Some clients leave caches and tokens in the user's home.
            variables = {"HOME": name, "MINARI_DATASETS_PATH": str(folder / "datasets"), "MPLBACKEND": "Agg"}
            for client in clients(page.read_text(encoding="utf-8")):
                start = time.perf_counter()
                problem = check(client, os.environ | variables, folder)
                if problem:
                    has_failed = True
                print(f"{client.name:40}{time.perf_counter() - start:7.1f} s  {problem or 'ok'}", flush=True)
    return int(has_failed)


if __name__ == "__main__":
    program.run(main)
