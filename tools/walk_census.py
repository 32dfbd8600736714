"""Run arc_suite/cli/census.py."""

from arc_suite.cli import census, program

if __name__ == "__main__":
    program.run(census.main)
