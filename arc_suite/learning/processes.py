"""Runs programs of the suite on this machine: a few at a time, each a process with its own log.

Submitit serves clusters only, see `studies.cluster`. Its local executor starts all jobs at once, and its jobs ignore
SIGTERM.
"""

import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from tqdm import tqdm

from arc_suite.cli.program import say

_POLL_INTERVAL = 0.2  # s between two looks at the processes
_WATCH_INTERVAL = 1.0  # s between two calls of `watch`


def run(
    commands: Mapping[str, Callable[[], Sequence[str]]],
    logs: Path,
    jobs: int,
    result: Callable[[str], str] = "{}: finished".format,
    watch: Callable[[], None] = lambda: None,
) -> list[str]:
    """Run commands, print the outcome of each, and return the names of those that failed.

    A failure does not stop the others. An interruption ends all processes by SIGTERM, and waits for them.

    Args:
        commands: functions by name that return the arguments of `arc-suite`; each is called when its process begins.
        logs: folder of the logs NAME.log; output is appended.
        jobs: number of processes at a time.
        result: function of a name that returns the line to print when its process has succeeded.
        watch: function that is called once a second.

    Raises:
        OSError: a log cannot be written, or a command raises it.
    """
    names_to_start = list(commands)
    processes: dict[str, subprocess.Popen] = {}  # running ones by name
    failed_names = []
    next_watch = 0.0  # s of the monotonic clock
    try:
        while names_to_start or processes:
            while names_to_start and len(processes) < jobs:
                name = names_to_start.pop(0)
                path = log(logs, name)
                processes[name] = _start_process(commands[name](), path)
                say(f"{name}: running, {path}")
            for name, process in list(processes.items()):
                if process.poll() is None:
                    continue
                del processes[name]
                if process.returncode:
                    failed_names.append(name)
                    say(f"{name}: failed")
                    path = log(logs, name)
                    tqdm.write(f"{path}: {last_line(path)}", file=sys.stderr)
                else:
                    say(result(name))
            if time.monotonic() >= next_watch:
                watch()
                next_watch = time.monotonic() + _WATCH_INTERVAL
            time.sleep(_POLL_INTERVAL)
    finally:
        for process in processes.values():
            process.terminate()
        for process in processes.values():
            process.wait()
    return failed_names


def log(logs: Path, name: str) -> Path:
    """Return the path of a process's log."""
    return logs / f"{name}.log"


def last_line(path: Path, count: int = 1) -> str:
    """Return the last line of a log, or so many lines; `says nothing` for an empty log."""
    lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    return "\n".join(lines[-count:]) if lines else "says nothing"


def _start_process(arguments: Sequence[str], path: Path) -> subprocess.Popen:
    """Start `arc-suite` with arguments, whose output is appended to a log."""
    command = [sys.executable, "-m", "arc_suite", *arguments]
    with path.open("ab") as output:
        return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT)
