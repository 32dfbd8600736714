"""Colors of pictures, Okabe and Ito's and Tol's, which color-blind readers can tell apart."""

import itertools
from collections.abc import Iterable

BLUE, VERMILION = "#0072B2", "#D55E00"
INK, FAINT, PALE = "#333333", "#8C8C8C", "#E3E3E3"
TERM_COLORS = {
    "forward": BLUE,
    "healthy": "#56B4E9",
    "gait_bonus": "#009E73",
    "gait_cost": VERMILION,
    "control": "#E69F00",
    "smoothness": "#F0E442",
    "contact": "#CC79A7",
    "angular_velocity": "#882255",
    "vertical_velocity": "#332288",
    "posture": "#999933",
}
_SPARE = ("#44AA99", "#AA4499", "#DDCC77", "#6699CC")


def term_colors(names: Iterable[str]) -> dict[str, str]:
    """Return colors of a reward's terms by name; those that have none of their own get what others have not."""
    names = list(names)
    free = itertools.cycle([*(color for name, color in TERM_COLORS.items() if name not in names), *_SPARE])
    return {name: TERM_COLORS.get(name) or next(free) for name in names}
