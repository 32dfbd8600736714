"""Run arc_suite/cli/check.py."""

from arc_suite.cli import check, program

if __name__ == "__main__":
    program.run(check.main)
