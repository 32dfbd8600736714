"""Run arc_suite/cli/tune_cpg.py."""

from arc_suite.cli import program, tune_cpg

if __name__ == "__main__":
    program.run(tune_cpg.main)
