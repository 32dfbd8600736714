"""How well generated bodies follow commands: `make check-following`, minutes.

Prints the mean error of each body over the ten commands of the test of steering, in the body's own
units, and whether it fell; then, of each family, how many fell, and how many err by 0.15 at most.
Fails if one fell, or more than a tenth of a family err by more.
"""

import pathlib
import sys

import numpy as np
from tqdm import trange

sys.path[:0] = [str(pathlib.Path(__file__).parent / folder) for folder in ("cpg", "fixtures")]

from test_steering import COMMANDS, obeyed  # noqa: E402

from arc_suite.registry import family_of  # noqa: E402

BODIES, MOST, SHARE = 60, 0.15, 0.9


def followed(family: str) -> bool:
    """Try the bodies of a family, print how they follow, and return whether they do."""
    errors, fell = [], []
    for seed in trange(BODIES, desc=family, disable=None):
        motion, falls = obeyed(family_of(family)(seed))
        errors.append(abs(motion - COMMANDS).mean())
        fell.append(falls.sum())
        told = f"mean error {errors[-1]:.3f}, fell in {fell[-1]} of {len(COMMANDS)} commands"
        print(f"{family}_{seed}: {told}", flush=True)
    errors, fell = np.array(errors), np.array(fell)
    quantiles = ", ".join(f"{value:.3f}" for value in np.quantile(errors, (0.5, 0.9, 1.0)))
    print(f"{family}: mean error, median, nine tenths and most: {quantiles}")
    obedient, fallen = (errors <= MOST).mean(), (fell > 0).sum()
    print(f"{family}: {obedient:.0%} err by {MOST} at most; {fallen} bodies of {len(fell)} fell")
    return not fallen and obedient >= SHARE


if __name__ == "__main__":
    sys.exit(not all([followed("random"), followed("varied")]))
