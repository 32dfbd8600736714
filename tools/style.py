"""Run arc_suite/cli/style.py."""

from arc_suite.cli import program, style

if __name__ == "__main__":
    program.run(style.main)
