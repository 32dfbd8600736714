"""Run arc_suite/cli/build_model.py."""

from arc_suite.cli import build_model, program

if __name__ == "__main__":
    program.run(build_model.main)
