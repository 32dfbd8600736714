"""Returns that the paper publishes for the task walk, by robot. `studies/paper.csv` holds the same as a table."""

import itertools

# Of the demonstrators, read off the expert lines of the figures.
DEMONSTRATORS = {"queen": 2048.0, "bastion": 2311.0, "tick": 1971.0, "leaper": 2630.0}

STEPS = (50_000, 100_000, 200_000, 500_000, 1_000_000)  # environment steps of the points of a curve

# Points of the curves by algorithm: means of five seeds, smoothed, read off within about 30. None could not be read.
CURVES: dict[str, dict[str, tuple[float | None, ...]]] = {
    "leaper": {
        "sac": (300, 1190, 2050, 2590, 2860),
        "speq": (None, 1450, 2240, 2900, 3120),
        "sope_eo": (640, 1910, 2950, 3240, 3310),
        "sacfd": (460, 800, 1570, 3140, 3520),
        "speq_o2o": (530, 1410, 2440, 3410, 3550),
        "sope": (1030, 2530, 3410, 3710, 3760),
    },
    "bastion": {
        "sac": (800, 1260, 2160, 2880, 3080),
        "speq": (970, 1810, 2670, 3140, 3350),
        "sope_eo": (850, 1870, 2830, 3330, 3530),
        "sacfd": (1030, 1330, 2340, 3340, 3530),
        "speq_o2o": (1740, 2850, 3460, 3610, 3680),
        "sope": (1600, 2790, 3390, 3570, 3690),
    },
    "queen": {
        "sac": (880, 1260, 2510, 3320, 3520),
        "speq": (1140, 1620, 2190, 3070, 3330),
        "sope_eo": (980, 1790, 2780, 3450, 3580),
        "sacfd": (710, 1010, 1100, 2350, 3220),
        "speq_o2o": (1280, 2310, 2810, 3350, 3620),
        "sope": (1240, 2150, 2950, 3520, 3730),
    },
    "tick": {
        "sac": (270, 350, 1080, 2140, 2590),
        "speq": (440, 1780, 2960, 3470, 3590),
        "sope_eo": (380, 1160, 2420, 3270, 3490),
        "sacfd": (100, 290, 690, 2600, 3160),
        "speq_o2o": (940, 2370, 3280, 3640, 3720),
        "sope": (720, 2190, 2990, 3480, 3610),
    },
}

# After 1,000,000 steps, by algorithm.
FINALS = {robot: {name: points[-1] for name, points in curves.items()} for robot, curves in CURVES.items()}


def at(robot: str, algorithm: str, steps: int) -> float | None:
    """Return the return of the paper's algorithm after environment steps, interpolated between points of its curve.

    None before the first point, after the last, and for other robots and algorithms.
    """
    curve = CURVES.get(robot, {}).get(algorithm, ())
    points = [(step, value) for step, value in zip(STEPS, curve, strict=False) if value is not None]
    for (step, value), (next_step, next_value) in itertools.pairwise(points):
        if step <= steps <= next_step:
            return value + (next_value - value) * (steps - step) / (next_step - step)
    return None
