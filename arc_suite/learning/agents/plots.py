"""Pictures of training: returns of evaluations over environment steps."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter

from arc_suite.evaluation import curve

# Color and marker of an algorithm in all pictures: Okabe and Ito's colors for the paper's six and PPO, Tol's muted
# ones for the others. Both palettes are made for color-blind eyes; markers tell apart what is near.
STYLES = {
    "sac": ("#0072B2", "o"),
    "speq": ("#009E73", "s"),
    "sope_eo": ("#E69F00", "^"),
    "sacfd": ("#D55E00", "v"),
    "speq_o2o": ("#CC79A7", "D"),
    "sope": ("#56B4E9", "P"),
    "ppo": ("#000000", "o"),
    "sac_parallel": ("#882255", "X"),
    "xqc": ("#CC6677", "<"),
    "dagger": ("#999933", "*"),
    "droq": ("#332288", "h"),
    "finetune": ("#44AA99", "p"),
    "bc": ("#DDCC77", "d"),
    "dagger_bodies": ("#AA4499", "*"),
    "finetune_bodies": ("#117733", "p"),
}
_OTHERS = (("#88CCEE", "H"), ("#6699CC", "8"), ("#661100", ">"))  # of other packages, in order
# Line and hollow marker of further kinds of runs of one algorithm in a study; the first has the algorithm's own.
_VARIANTS = (("--", "o"), (":", "s"), ("-.", "^"), ((0, (8, 2)), "D"), ((0, (1, 4)), "v"))
_MARKERS = 15  # of a curve, at most
_GRAY = "#6E6E6E"
_ENTRY, _CHARACTER = 0.8, 0.08  # inches of a legend's entry without a text, and of a letter of the text
_BESIDE = ("axes fraction", "data")  # coordinates of a label to the right of an axis
_GAP = 0.052  # between the labels of two levels, as a share of the axis


class Curve(NamedTuple):
    """Returns of a kind of run.

    Attributes:
        algorithm: which gives the color.
        steps: (points,) environment steps.
        returns: (runs, points) mean return of each evaluation.
    """

    algorithm: str
    steps: np.ndarray
    returns: np.ndarray


def plot_run(
    evaluations: Mapping[str, np.ndarray],
    algorithm: str,
    title: str,
    lines: Mapping[str, float],
    finals: Mapping[str, float],
) -> Figure:
    """Draw the learning curve of a run: the mean return of each evaluation, from the lowest to the highest episode.

    Args:
        evaluations: table of a run (`run_folder.table`): a `step` and a `return` of each episode.
        algorithm: of the run, named at the end of the curve.
        title: of the picture.
        lines: returns to compare with, by name.
        finals: of the paper, by algorithm.
    """
    figure = Figure(figsize=(8.0, 4.5), dpi=120, layout="constrained")
    axis = figure.subplots()
    steps = np.unique(evaluations["step"])
    episodes = [evaluations["return"][evaluations["step"] == step] for step in steps]
    low, mean, high = np.array([(each.min(), each.mean(), each.max()) for each in episodes]).T
    color, marker = _styles([algorithm])[algorithm]
    axis.fill_between(steps, low, high, color=color, alpha=0.15, linewidth=0)
    axis.plot(steps, mean, color=color, marker=marker, markevery=_every(steps))
    _finish(axis, title, lines, finals, _styles([algorithm, *finals]), {algorithm: mean[-1]})
    axis.set_ylabel("return: mean, lowest and highest episode")
    return figure


def plot_study(
    groups: Mapping[str, Mapping[str, Curve]],
    lines: Mapping[str, Mapping[str, float]],
    finals: Mapping[str, Mapping[str, float]],
) -> Figure:
    """Draw the learning curves of a study, a panel for each place.

    A curve is the interquartile mean over runs, with its 95 % bootstrap interval; of a single run the mean return.

    Args:
        groups: by place and kind of run.
        lines: returns to compare with, by place and name.
        finals: of the paper, by place and algorithm.
    """
    columns = min(len(groups), 2)
    rows = -(-len(groups) // columns)
    figure = Figure(figsize=(7.5 * columns, 3.9 * rows + 0.5), dpi=100, layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False)
    used = [each.algorithm for kinds in groups.values() for each in kinds.values()]
    styles = _styles([*used, *(name for every in finals.values() for name in every)])
    variants = _variants(groups)
    for axis in axes.flat[len(groups) :]:
        axis.remove()
    for axis, (place, kinds) in zip(axes.flat, groups.items(), strict=False):
        for kind, each in kinds.items():
            color, marker = styles[each.algorithm]
            style = {"color": color, "marker": marker, "markersize": 5, "markevery": _every(each.steps)}
            robust = curve([each.returns])
            if len(each.returns) > 1:
                axis.fill_between(each.steps, robust.low, robust.high, color=color, alpha=0.15, linewidth=0)
            axis.plot(each.steps, robust.iqm, label=kind, **style | variants[kind])
        _finish(axis, place, lines.get(place, {}), finals.get(place, {}), styles)
    for axis in axes[:, 0]:
        axis.set_ylabel("return of an evaluation")
    handles = {label: line for axis in axes.flat for line, label in zip(*axis.get_legend_handles_labels(), strict=True)}
    fitting = int(figure.get_figwidth() / (_ENTRY + _CHARACTER * max(map(len, handles))))
    ncols = min(len(handles), 3 * columns, max(fitting, 1))
    figure.legend(handles.values(), handles, loc="outside upper left", ncols=ncols, frameon=False)
    return figure


def _styles(names: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Return colors and markers by algorithm; unknown ones get others, in order."""
    others = itertools.cycle(_OTHERS)
    return {name: STYLES[name] if name in STYLES else next(others) for name in dict.fromkeys(names)}


def _variants(groups: Mapping[str, Mapping[str, Curve]]) -> dict[str, dict[str, Any]]:
    """Return by kind what its line has other than the algorithm's style: kinds of one algorithm differ."""
    kinds = {kind: each.algorithm for every in groups.values() for kind, each in every.items()}
    others = [{"linestyle": dashes, "marker": marker, "markerfacecolor": "white"} for dashes, marker in _VARIANTS]
    turns = {name: itertools.cycle([{}, *others]) for name in kinds.values()}
    return {kind: next(turns[algorithm]) for kind, algorithm in kinds.items()}


def _every(steps: np.ndarray) -> int:
    """Return the number of points to each marker, so that there are at most `_MARKERS`."""
    return -(-len(steps) // _MARKERS)


def _finish(
    axis,
    title: str,
    lines: Mapping[str, float],
    finals: Mapping[str, float],
    styles: Mapping,
    ends: Mapping[str, float] | None = None,
) -> None:
    """Draw levels to compare with, and label them and ends of curves on the right of the axis, where no line runs."""
    levels = [(value, name, _GRAY, "--") for name, value in lines.items()]
    levels += [(value, f"{name}, paper", styles[name][0], ":") for name, value in finals.items()]
    for value, _, color, dashes in levels:
        axis.axhline(value, color=color, linestyle=dashes, linewidth=1.0, zorder=0)
    levels += [(value, name, styles[name][0], "-") for name, value in (ends or {}).items()]
    low, high = axis.get_ylim()
    low, high = min(low, 0.0), max([high, *(1.03 * value for value, *_ in levels)])
    axis.set_ylim(low, high)
    gap, levels = _GAP * (high - low), sorted(levels)
    heights = _apart([value for value, *_ in levels], gap, high)
    for (value, name, color, _), height in zip(levels, heights, strict=True):
        arrow = {"arrowstyle": "-", "color": color, "linewidth": 0.6, "relpos": (0.0, 0.5), "shrinkB": 0.0}
        text, places = f"{name} {value:.0f}", ((1.0, value), (1.04, height))
        axis.annotate(text, *places, *[_BESIDE] * 2, arrow, va="center", fontsize=8, color=color)
    axis.set_xlabel("environment steps")
    axis.set_title(title, loc="left", fontweight="bold")
    axis.xaxis.set_major_formatter(EngFormatter(sep=""))
    axis.set_xlim(left=0.0)
    axis.spines[["top", "right"]].set_visible(False)


def _apart(values: Sequence[float], gap: float, top: float) -> list[float]:
    """Return heights near ascending values, `gap` or more apart, the highest at most at `top`."""
    heights: list[float] = []
    for value in values:
        heights.append(max(value, heights[-1] + gap) if heights else value)
    for index in reversed(range(len(heights))):
        heights[index] = min(heights[index], top - gap * (len(heights) - 1 - index))
    return heights
