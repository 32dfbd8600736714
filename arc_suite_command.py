"""The console script `arc-suite`, which shows its help without the package, whose import loads MuJoCo."""

import runpy
import sys
from pathlib import Path
from typing import Any

_FOLDER = Path(__file__).with_name("arc_suite") / "cli"


def main() -> None:
    """Print the help, or run the program of the first argument."""
    _run("interrupts.py")["exit_at_once"]()
    if sys.argv[1:] in ([], ["help"], ["-h"], ["--help"]):
        print(_run("programs.py")["usage"]())
    else:
        try:
            from arc_suite.cli import main
        except ImportError as error:
            sys.exit(f"arc-suite: {error}")
        main.main()


def _run(file: str) -> dict[str, Any]:
    """Return what a file of the command line defines, without importing the package."""
    return runpy.run_path(str(_FOLDER / file))
