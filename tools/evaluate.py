"""Run arc_suite/cli/evaluate.py."""

from arc_suite.cli import evaluate, program

if __name__ == "__main__":
    program.run(evaluate.main)
