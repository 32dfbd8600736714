"""Run the command line: `python -m arc_suite PROGRAM` is `arc-suite PROGRAM`."""

from arc_suite.cli.main import main

if __name__ == "__main__":
    main()
