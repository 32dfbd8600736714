"""How well random bodies follow commands: `make check-following`, minutes.

Prints the mean error of each body over the ten commands of the test of steering, in the body's own
units, and whether it fell; then how many of all fell, and how many err by 0.15 at most. Fails if one
fell, or more than a tenth err by more.
"""

import pathlib
import sys

import numpy as np
from tqdm import trange

sys.path.insert(0, str(pathlib.Path(__file__).parent / "cpg"))

from test_steering import COMMANDS, obeyed  # noqa: E402

from arc_suite.robots import generator  # noqa: E402

BODIES, MOST, SHARE = 100, 0.15, 0.9


def main() -> int:
    """Try the bodies, and return the exit status."""
    errors, fell = [], []
    for seed in trange(BODIES, disable=None):
        motion, fallen = obeyed(generator.random_body(seed))
        errors.append(abs(motion - COMMANDS).mean())
        fell.append(fallen.sum())
        print(f"random_{seed}: mean error {errors[-1]:.3f}, fell in {fell[-1]} of {len(COMMANDS)} commands", flush=True)
    errors, fell = np.array(errors), np.array(fell)
    quantiles = ", ".join(f"{value:.3f}" for value in np.quantile(errors, (0.5, 0.9, 1.0)))
    print(f"mean error, median, nine tenths and most: {quantiles}")
    print(f"{(errors <= MOST).mean():.0%} err by {MOST} at most; {(fell > 0).sum()} bodies of {len(fell)} fell")
    return int(fell.any() or (errors <= MOST).mean() < SHARE)


if __name__ == "__main__":
    sys.exit(main())
