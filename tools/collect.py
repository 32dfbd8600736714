"""Run arc_suite/cli/collect.py."""

from arc_suite.cli import collect, program

if __name__ == "__main__":
    program.run(collect.main)
