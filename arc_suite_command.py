"""The console script `arc-suite`, which shows its help without the package, whose import loads MuJoCo."""

import runpy
import sys
from pathlib import Path

_PROGRAMS = Path(__file__).with_name("arc_suite") / "cli" / "programs.py"


def main() -> None:
    """Print the help, or run the program of the first argument."""
    if sys.argv[1:2] in ([], ["-h"], ["--help"]):
        print(runpy.run_path(str(_PROGRAMS))["usage"]())
    else:
        try:
            from arc_suite.cli import main
        except ImportError as error:
            sys.exit(f"arc-suite: {error}")
        main.main()
