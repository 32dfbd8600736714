"""Colors of pictures, Okabe and Ito's and Tol's, which color-blind readers can tell apart."""

import itertools
from collections.abc import Iterable

BLUE = "#0072B2"
VERMILION = "#D55E00"
INK = "#333333"  # dark gray
FAINT = "#8C8C8C"  # middle gray
PALE = "#E3E3E3"  # light gray

# By the name of a reward's term.
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
_MORE_COLORS = ("#44AA99", "#AA4499", "#DDCC77", "#6699CC")  # of terms that have none, after the unused ones


def term_colors(names: Iterable[str]) -> dict[str, str]:
    """Return the colors of a reward's terms by name; a term without a color of its own gets an unused one."""
    names = list(names)
    unused_colors = [color for name, color in TERM_COLORS.items() if name not in names]
    next_color = itertools.cycle([*unused_colors, *_MORE_COLORS])
    return {name: TERM_COLORS[name] if name in TERM_COLORS else next(next_color) for name in names}
