"""Run arc_suite/cli/doctor.py: `python -m arc_suite.doctor`."""

from arc_suite.cli import doctor, program

if __name__ == "__main__":
    program.run(doctor.main)
