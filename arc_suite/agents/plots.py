"""Pictures of training: returns of evaluations over environment steps."""

from collections.abc import Mapping
from itertools import cycle

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter

from arc_suite.evaluation import curve

# Okabe and Ito's colours, told apart by colour-blind eyes too.
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#F0E442")
_GREY = "#8C8C8C"


def returns(evaluations: Mapping[str, np.ndarray], title: str, lines: Mapping[str, float]) -> Figure:
    """Draw the learning curve of a run: the mean return of each evaluation, from the lowest to the highest episode.

    Args:
        evaluations: table of a run (`run_folder.table`).
        title: of the picture.
        lines: returns to compare with, by name.
    """
    figure = Figure(figsize=(8.0, 4.5), dpi=120, layout="constrained")
    axis = figure.subplots()
    steps = np.unique(evaluations["step"])
    episodes = [evaluations["return"][evaluations["step"] == step] for step in steps]
    low, mean, high = np.array([(each.min(), each.mean(), each.max()) for each in episodes]).T
    axis.fill_between(steps, low, high, color=_COLOURS[0], alpha=0.15, linewidth=0)
    axis.plot(steps, mean, color=_COLOURS[0], marker="." if len(steps) < 15 else None)
    _finish(axis, title, lines)
    axis.set_ylabel("return of an evaluation")
    return figure


def study(
    groups: Mapping[str, Mapping[str, tuple[np.ndarray, np.ndarray]]], lines: Mapping[str, Mapping[str, float]]
) -> Figure:
    """Draw the learning curves of a study: a row for each place, two pictures of the same numbers in it.

    On the left the mean over runs with their standard deviation, as in the paper; on the right the
    interquartile mean with its 95 % bootstrap interval.

    Args:
        groups: steps (points,) and mean returns (runs, points) by place and kind of run. Of one run, the returns of
            an evaluation's episodes (episodes, points).
        lines: returns to compare with, by place and name.
    """
    figure = Figure(figsize=(12.0, 3.6 * len(groups)), dpi=110, layout="constrained")
    axes = figure.subplots(len(groups), 2, squeeze=False, sharey="row")
    colours = dict(
        zip(dict.fromkeys(kind for kinds in groups.values() for kind in kinds), cycle(_COLOURS), strict=False)
    )
    for (left, right), (place, kinds) in zip(axes, groups.items(), strict=True):
        for kind, (steps, returns) in kinds.items():
            mean, deviation, robust = returns.mean(axis=0), returns.std(axis=0), curve([returns])
            bands = (left, mean, mean - deviation, mean + deviation), (right, robust.iqm, robust.low, robust.high)
            for axis, middle, low, high in bands:
                axis.fill_between(steps, low, high, color=colours[kind], alpha=0.15, linewidth=0)
                axis.plot(steps, middle, color=colours[kind], label=kind, marker="." if len(steps) < 15 else None)
        for axis, title in ((left, "mean, standard deviation"), (right, "interquartile mean, 95 % interval")):
            _finish(axis, f"{place}: {title}", lines.get(place, {}))
        right.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(1.0, 1.0))  # off the curves
        left.set_ylabel("return of an evaluation")
    return figure


def _finish(axis, title: str, lines: Mapping[str, float]) -> None:
    """Draw returns to compare with, and label the picture."""
    for value in lines.values():
        axis.axhline(value, color=_GREY, linestyle="--", linewidth=1.0)
    axis.set_ylim(bottom=min(axis.get_ylim()[0], 0.0))
    room = 0.07 * np.ptp(axis.get_ylim())  # for a name above its line; where another line is nearer, it stands below
    axis.set_ylim(top=max([axis.get_ylim()[1], *(value + room for value in lines.values())]))
    for name, value in lines.items():
        side = "top" if any(value < other < value + room for other in lines.values()) else "bottom"
        axis.annotate(name, (1.0, value), xycoords=("axes fraction", "data"), ha="right", va=side, color=_GREY)
    axis.set_xlabel("environment steps")
    axis.set_title(title, loc="left", fontweight="bold")
    axis.xaxis.set_major_formatter(EngFormatter(sep=""))
    axis.set_xlim(left=0.0)
    axis.spines[["top", "right"]].set_visible(False)
