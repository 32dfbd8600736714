"""Keys of a track of an animation: the fewest samples between which lines and arcs replace the rest."""

import numpy as np

_MIN_SINE = 1e-6  # of the angle of an arc; shorter arcs are straight lines
_MIN_COSINE = 1e-6  # of half an angle: with a smaller one, rounding to 32 bits leaves open which way is shorter


def select_keys(values: np.ndarray, max_error: float) -> np.ndarray:
    """Return the indices of keys with which a track stays near all its samples, both ends included.

    Intervals are cut at their worst sample until all errors are small enough (Ramer, "An iterative procedure for the
    polygonal approximation of plane curves", 1972).

    Args:
        values: (samples, 3) positions, m, or (samples, 4) quaternions of continuous signs.
        max_error: m or rad.
    """
    keys = {0, len(values) - 1}
    intervals = [(0, len(values) - 1)]
    while intervals:
        first, last = intervals.pop()
        if last - first < 2:
            continue
        sample = _find_cut(values[first : last + 1], max_error)
        if sample is not None:
            key = first + sample
            keys.add(key)
            intervals.append((first, key))
            intervals.append((key, last))
    return np.array(sorted(keys))


def _find_cut(values: np.ndarray, max_error: float) -> int | None:
    """Return the sample at which an interval is cut; None for one whose ends suffice."""
    errors = _interpolation_errors(values)
    worst = int(errors.argmax())
    if errors[worst] > max_error:
        return worst
    is_half_turn = values.shape[-1] == 4 and abs(values[0] @ values[-1]) < _MIN_COSINE
    return len(values) // 2 if is_half_turn else None


def _interpolation_errors(values: np.ndarray) -> np.ndarray:
    """Return how far samples are from the line, m, or the arc, rad, between the first and the last.

    The arc is the shorter way round, as players take it; of half a turn, which may be either, that of the signs.
    """
    share = np.linspace(0.0, 1.0, len(values))[:, None]
    first = values[0]
    last = values[-1]
    is_position = values.shape[-1] == 3
    if is_position:
        return np.linalg.norm(values - (1.0 - share) * first - share * last, axis=-1)
    if first @ last < -_MIN_COSINE:
        last = -last
    angle = np.arccos(np.clip(first @ last, -1.0, 1.0))
    sine = np.sin(angle)
    if sine > _MIN_SINE:
        interpolated = (np.sin((1.0 - share) * angle) * first + np.sin(share * angle) * last) / sine
    else:
        interpolated = (1.0 - share) * first + share * last
    cosines = abs((values * interpolated).sum(axis=-1))
    return 2.0 * np.arccos(np.clip(cosines, 0.0, 1.0))
