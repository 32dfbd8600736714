"""Run arc_suite/cli/render.py."""

from arc_suite.cli import program, render

if __name__ == "__main__":
    program.run(render.main)
