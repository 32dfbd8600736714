"""Keys that straight lines and arcs between them need."""

import numpy as np


def select_keys(values: np.ndarray, bound: float) -> np.ndarray:
    """Return the indices of keys with which a track stays within a bound of all its samples, both ends included.

    Intervals are halved at their worst sample until they are within the bound (Ramer, "An iterative procedure for the
    polygonal approximation of plane curves", 1972).

    Args:
        values: (samples, 3) places, m, or (samples, 4) quaternions of continuous signs.
        bound: m or rad.
    """
    kept, waiting = {0, len(values) - 1}, [(0, len(values) - 1)]
    while waiting:
        first, last = waiting.pop()
        if last - first < 2:
            continue
        errors = _errors(values[first : last + 1])
        worst = int(errors.argmax())
        if errors[worst] > bound:
            kept.add(first + worst)
            waiting += [(first, first + worst), (first + worst, last)]
    return np.array(sorted(kept))


def _errors(values: np.ndarray) -> np.ndarray:
    """Return how far samples are from the line or the arc between the first and the last."""
    share = np.linspace(0.0, 1.0, len(values))[:, None]
    first, last = values[0], values[-1]
    if values.shape[-1] == 3:
        return np.linalg.norm(values - (1.0 - share) * first - share * last, axis=-1)
    angle = np.arccos(np.clip(first @ last, -1.0, 1.0))
    sine = np.sin(angle)
    if sine > 1e-6:
        between = (np.sin((1.0 - share) * angle) * first + np.sin(share * angle) * last) / sine
    else:
        between = (1.0 - share) * first + share * last
    return 2.0 * np.arccos(np.clip(abs((values * between).sum(axis=-1)), 0.0, 1.0))
