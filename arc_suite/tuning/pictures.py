"""A picture of a search's course. Needs matplotlib (extra `plot`)."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from arc_suite.tuning.judge import STYLE
from arc_suite.tuning.search import Generation


def course(robot: str, reward: float, generations: Sequence[Generation], length: int) -> Figure:
    """Returns and style over generations, beside those of the preset `medium`.

    Args:
        robot: whose search it was.
        reward: mean reward of `medium`.
        generations: of the search.
        length: control steps of an episode, by which rewards become returns.
    """
    figure = Figure(figsize=(8.0, 5.6), dpi=150, layout="constrained")
    returns, style = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
    counts = np.arange(1, len(generations) + 1)
    fitness = length * np.array([np.percentile(generation.fitness, (25, 50, 75)) for generation in generations]).T
    returns.fill_between(counts, fitness[0], fitness[2], color="#0072B2", alpha=0.2, linewidth=0)
    returns.plot(counts, fitness[1], color="#0072B2", label="fitness of the candidates: median and middle half")
    best = [length * generation.reward for generation in generations]
    returns.plot(counts, best, color="#009E73", label="return of the fittest")
    returns.axhline(length * reward, color="#8C8C8C", linestyle="--", label="return of medium")
    # The first generations hold candidates that fall; they would flatten the rest.
    returns.set_ylim(bottom=min(length * reward, np.percentile(fitness[0], 20)) - 100.0)
    returns.set_ylabel(f"of {length} control steps")
    returns.set_title(f"{robot}: a search by CMA-ES", loc="left", fontweight="bold")
    returns.legend(loc="lower right", frameon=False)
    for name, color, shares in zip(
        STYLE, ("#D55E00", "#CC79A7", "#E69F00"), np.transpose([g.style for g in generations]), strict=True
    ):
        style.plot(counts, shares, color=color, label=f"{name} of the fittest")
    style.axhline(1.0, color="#8C8C8C", linestyle="--", label="medium")
    style.set_ylabel("share of medium's")
    style.set_xlabel("generation")
    style.set_ylim(0.0, 1.5)
    style.legend(loc="lower right", frameon=False, ncols=4)
    for axis in (returns, style):
        axis.spines[["top", "right"]].set_visible(False)
    return figure
