"""Runs programs of the suite on this machine: some at a time, each a process with a log of its own.

Submitit serves clusters alone, see `studies.cluster`: its local executor starts all jobs at once, and its jobs ignore
SIGTERM.
"""

import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from tqdm import tqdm

from arc_suite.cli.program import say

_PAUSE, _WATCH = 0.2, 1.0  # s between two looks at the processes, and between two calls of `watch`


def run(
    commands: Mapping[str, Callable[[], Sequence[str]]],
    logs: Path,
    jobs: int,
    result: Callable[[str], str] = "{}: finished".format,
    watch: Callable[[], None] = lambda: None,
) -> list[str]:
    """Run commands, print what becomes of each, and return the names of those that failed.

    A failure does not stop the others. An interruption ends all, by SIGTERM, and waits for them.

    Args:
        commands: functions by name, called when their process begins, that return the arguments of `arc-suite`.
        logs: folder of NAME.log, which output is added to.
        jobs: processes at a time.
        result: returns the line of a name whose process has succeeded.
        watch: called once a second.

    Raises:
        OSError: a log cannot be written, or what a command raises.
    """
    waiting, running, failed, due = list(commands), {}, [], 0.0
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                name = waiting.pop(0)
                running[name] = _process(commands[name](), log(logs, name))
                say(f"{name}: running")
            for name, process in list(running.items()):
                if process.poll() is not None:
                    del running[name]
                    if process.returncode:
                        failed.append(name)
                        say(f"{name}: failed")
                        tqdm.write(f"{log(logs, name)}: {last_line(log(logs, name))}", file=sys.stderr)
                    else:
                        say(result(name))
            if time.monotonic() >= due:
                watch()
                due = time.monotonic() + _WATCH
            time.sleep(_PAUSE)
    finally:
        for end in (subprocess.Popen.terminate, subprocess.Popen.wait):
            for process in running.values():
                end(process)
    return failed


def log(logs: Path, name: str) -> Path:
    """Return the path of a process's log."""
    return logs / f"{name}.log"


def last_line(path: Path) -> str:
    """Return the last line of a log."""
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    return lines[-1] if lines else "says nothing"


def _process(arguments: Sequence[str], path: Path) -> subprocess.Popen:
    command = [sys.executable, "-m", "arc_suite", *arguments]
    with path.open("ab") as output:
        return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT)
