"""Runs of true values in a mask over time, such as the stances of a foot."""

import numpy as np


def find_runs(mask: np.ndarray) -> np.ndarray:
    """Return the first index of each run of true values in a mask (n,), and the index after its last, (runs, 2)."""
    changes = np.diff(mask.astype(int), prepend=0, append=0)
    return np.flatnonzero(changes).reshape(-1, 2)
