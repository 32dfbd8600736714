"""A picture of a search's course. Needs matplotlib (extra `dev`)."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from preset_search.evaluator import STYLE
from preset_search.search import Generation

# Okabe and Ito's colors, which color-blind readers can tell apart.
_BLUE = "#0072B2"
_GREEN = "#009E73"
_GRAY = "#8C8C8C"
_STYLE_COLORS = ("#D55E00", "#CC79A7", "#E69F00")


def course(robot: str, reward: float, generations: Sequence[Generation], length: int) -> Figure:
    """Draw returns and style over generations, with those of the preset `medium`.

    Args:
        robot: robot of the search.
        reward: mean reward of `medium`.
        generations: generations of the search.
        length: control steps of an episode, to convert rewards to returns.
    """
    figure = Figure(figsize=(8.0, 6.0), dpi=120, layout="constrained")
    returns, style = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    counts = np.arange(1, len(generations) + 1)
    fitness = length * np.array([np.percentile(generation.fitness, (25, 50, 75)) for generation in generations]).T
    returns.fill_between(counts, fitness[0], fitness[2], color=_BLUE, alpha=0.2, linewidth=0)
    returns.plot(counts, fitness[1], color=_BLUE, label="fitness, median and middle half")
    best = [length * generation.reward for generation in generations]
    returns.plot(counts, best, color=_GREEN, label="return of the fittest")
    returns.axhline(length * reward, color=_GRAY, linestyle="--", label="return of medium")
    # Candidates that fall would flatten the rest.
    returns.set_ylim(min(length * reward, np.percentile(fitness[0], 20)) - 100.0, max(best) + 100.0)
    returns.set_ylabel(f"return of {length} control steps")
    returns.set_title(robot, loc="left", fontweight="bold")

    shares = np.transpose([generation.style for generation in generations])
    for name, color, values in zip(STYLE, _STYLE_COLORS, shares, strict=True):
        style.plot(counts, values, color=color, label=name)
    style.axhline(1.0, color=_GRAY, linestyle="--", label="medium")
    style.set_ylabel("the fittest's costs of style,\nas shares of medium's")
    style.set_xlabel("generation")
    style.set_ylim(0.0, 1.5)
    for axis in (returns, style):
        axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False, ncols=4, fontsize=8, borderpad=0.0)
        axis.spines[["top", "right"]].set_visible(False)
        axis.xaxis.set_major_locator(MaxNLocator(integer=True))
    return figure
