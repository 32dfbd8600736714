"""`python -m arc_suite.doctor` runs `arc_suite.cli.doctor`."""

import sys

from arc_suite.cli.doctor import main

if __name__ == "__main__":
    sys.exit(main())
