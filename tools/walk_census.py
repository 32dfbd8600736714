"""Run arc_suite/cli/survey.py."""

from arc_suite.cli import program, survey

if __name__ == "__main__":
    program.run(survey.main)
