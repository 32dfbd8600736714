"""Pictures of training: returns of evaluations over environment steps."""

import itertools
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import EngFormatter

from arc_suite.evaluation import MIN_RUNS, curve

# Color and marker of an algorithm in all pictures. The paper's six algorithms and PPO have Okabe and Ito's colors, the
# others have Tol's muted colors. Both palettes are made for color-blind eyes; markers separate similar colors.
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
_STYLES_OF_OTHERS = (("#88CCEE", "H"), ("#6699CC", "8"), ("#661100", ">"))  # of other packages' algorithms, in order
# Line style and hollow marker of further kinds of runs of one algorithm; the first kind has the algorithm's style.
_VARIANTS = (("--", "o"), (":", "s"), ("-.", "^"), ((0, (8, 2)), "D"), ((0, (1, 4)), "v"))
_MAX_MARKERS = 15  # of a curve
_GRAY = "#6E6E6E"
_LEGEND_ENTRY_WIDTH = 0.8  # of an entry without its text, inches
_LEGEND_CHARACTER_WIDTH = 0.08  # inches
_LABEL_COORDINATES = ("axes fraction", "data")  # x and y of a label to the right of an axis
_LABEL_X = 1.04  # axes fraction
_LABEL_GAP = 0.052  # between two labels, as a share of the height of the axis
_TOP_MARGIN = 1.03  # ratio of the top of the axis to the highest level


class _Level(NamedTuple):
    """A return with a label on the right of the axis, and maybe a line across it; levels sort by the return.

    Attributes:
        value: the return.
        name: in the label.
        color: color of line and label.
        dashes: line style; "-" for the end of a curve, which has no line across the axis.
    """

    value: float
    name: str
    color: str
    dashes: str


class Curve(NamedTuple):
    """Returns of a kind of run.

    Attributes:
        algorithm: name of the algorithm, which determines the color.
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
        algorithm: algorithm of the run, named at the end of the curve.
        title: title of the picture.
        lines: returns to compare with, by name.
        finals: final returns of the paper, by algorithm.
    """
    figure = Figure(figsize=(8.0, 4.5), dpi=120, layout="constrained")
    axis = figure.subplots()
    steps = np.unique(evaluations["step"])
    episodes = [evaluations["return"][evaluations["step"] == step] for step in steps]
    lowest = np.array([returns.min() for returns in episodes])
    mean = np.array([returns.mean() for returns in episodes])
    highest = np.array([returns.max() for returns in episodes])
    color, marker = _styles([algorithm])[algorithm]
    axis.fill_between(steps, lowest, highest, color=color, alpha=0.15, linewidth=0)
    axis.plot(steps, mean, color=color, marker=marker, markevery=_points_per_marker(steps))
    _finish_axis(axis, title, lines, finals, _styles([algorithm, *finals]), {algorithm: mean[-1]})
    axis.set_ylabel("return: mean, lowest and highest episode")
    return figure


def plot_study(
    groups: Mapping[str, Mapping[str, Curve]],
    lines: Mapping[str, Mapping[str, float]],
    finals: Mapping[str, Mapping[str, float]],
) -> Figure:
    """Draw the learning curves of a study, with a panel for each place: a robot and a task.

    A curve is the mean return over runs, with its 95 % interval if there are `MIN_RUNS` runs or more.

    Args:
        groups: curves by place and kind of run.
        lines: returns to compare with, by place and name.
        finals: final returns of the paper, by place and algorithm.
    """
    columns = min(len(groups), 2)
    rows = -(-len(groups) // columns)  # rounded up
    figure = Figure(figsize=(7.5 * columns, 3.9 * rows + 0.5), dpi=100, layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False)
    algorithms = [kind_curve.algorithm for kinds in groups.values() for kind_curve in kinds.values()]
    paper_algorithms = [algorithm for place_finals in finals.values() for algorithm in place_finals]
    styles = _styles([*algorithms, *paper_algorithms])
    variants = _variants(groups)
    unused_axes = axes.flat[len(groups) :]
    for axis in unused_axes:
        axis.remove()
    for axis, (place, kinds) in zip(axes.flat, groups.items(), strict=False):
        for kind, kind_curve in kinds.items():
            _draw_curve(axis, kind, kind_curve, styles[kind_curve.algorithm], variants[kind])
        _finish_axis(axis, place, lines.get(place, {}), finals.get(place, {}), styles)
    for axis in axes[:, 0]:
        axis.set_ylabel("return of an evaluation")
    _draw_legend(figure, axes, max_columns=3 * columns)
    return figure


def _draw_curve(axis, kind: str, kind_curve: Curve, style: tuple[str, str], variant: Mapping[str, Any]) -> None:
    """Draw the curve of a kind of run; its style is a color and a marker, and a variant changes the line."""
    color, marker = style
    means = curve([kind_curve.returns])
    if len(kind_curve.returns) >= MIN_RUNS:
        axis.fill_between(kind_curve.steps, means.low, means.high, color=color, alpha=0.15, linewidth=0)
    line_style = {
        "color": color,
        "marker": marker,
        "markersize": 5,
        "markevery": _points_per_marker(kind_curve.steps),
        **variant,
    }
    axis.plot(kind_curve.steps, means.mean, label=kind, **line_style)


def _draw_legend(figure: Figure, axes: np.ndarray, max_columns: int) -> None:
    """Draw a legend of all kinds of runs above the panels."""
    line_of_kind = {}
    for axis in axes.flat:
        axis_lines, kinds = axis.get_legend_handles_labels()
        line_of_kind |= dict(zip(kinds, axis_lines, strict=True))
    longest = max(len(kind) for kind in line_of_kind)  # characters
    fitting_columns = int(figure.get_figwidth() / (_LEGEND_ENTRY_WIDTH + _LEGEND_CHARACTER_WIDTH * longest))
    columns = min(len(line_of_kind), max_columns, max(fitting_columns, 1))
    figure.legend(line_of_kind.values(), line_of_kind, loc="outside upper left", ncols=columns, frameon=False)


def _styles(names: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Return colors and markers by algorithm; algorithms of other packages get the further styles, in order."""
    further_styles = itertools.cycle(_STYLES_OF_OTHERS)
    styles = {}
    for name in dict.fromkeys(names):  # each once
        styles[name] = STYLES[name] if name in STYLES else next(further_styles)
    return styles


def _variants(groups: Mapping[str, Mapping[str, Curve]]) -> dict[str, dict[str, Any]]:
    """Return by kind of run the options of its line that differ from the style of its algorithm.

    The first kind of an algorithm has none; further kinds of the same algorithm differ from each other.
    """
    algorithm_of_kind = {kind: kind_curve.algorithm for kinds in groups.values() for kind, kind_curve in kinds.items()}
    hollow_variants = [
        {"linestyle": dashes, "marker": marker, "markerfacecolor": "white"} for dashes, marker in _VARIANTS
    ]
    next_variants = {name: itertools.cycle([{}, *hollow_variants]) for name in algorithm_of_kind.values()}
    return {kind: next(next_variants[algorithm]) for kind, algorithm in algorithm_of_kind.items()}


def _points_per_marker(steps: np.ndarray) -> int:
    """Return how many points of a curve have one marker, so that there are at most `_MAX_MARKERS`."""
    return -(-len(steps) // _MAX_MARKERS)  # rounded up


def _finish_axis(
    axis,
    title: str,
    lines: Mapping[str, float],
    finals: Mapping[str, float],
    styles: Mapping,
    ends: Mapping[str, float] | None = None,
) -> None:
    """Draw levels to compare with, label them and ends of curves on the right of the axis, and set title and limits.

    Args:
        axis: axis of the panel.
        title: title of the panel.
        lines: returns to compare with, by name.
        finals: final returns of the paper, by algorithm.
        styles: colors and markers by algorithm.
        ends: final returns of curves, by algorithm; None for no labels at their ends.
    """
    levels = [_Level(value, name, _GRAY, "--") for name, value in lines.items()]
    for algorithm, value in finals.items():
        color, _ = styles[algorithm]
        levels.append(_Level(value, f"{algorithm}, paper", color, ":"))
    for level in levels:
        axis.axhline(level.value, color=level.color, linestyle=level.dashes, linewidth=1.0, zorder=0)
    for algorithm, value in (ends or {}).items():
        color, _ = styles[algorithm]
        levels.append(_Level(value, algorithm, color, "-"))

    bottom, top = axis.get_ylim()
    bottom = min(bottom, 0.0)
    top = max([top, *(_TOP_MARGIN * level.value for level in levels)])
    axis.set_ylim(bottom, top)
    _draw_labels(axis, sorted(levels), gap=_LABEL_GAP * (top - bottom), top=top)

    axis.set_xlabel("environment steps")
    axis.set_title(title, loc="left", fontweight="bold")
    axis.xaxis.set_major_formatter(EngFormatter(sep=""))
    axis.set_xlim(left=0.0)
    axis.spines[["top", "right"]].set_visible(False)


def _draw_labels(axis, levels: Sequence[_Level], gap: float, top: float) -> None:
    """Label ascending levels on the right of the axis, each with a thin line from the level to the label."""
    heights = _spread_heights([level.value for level in levels], gap, top)
    for level, height in zip(levels, heights, strict=True):
        axis.annotate(
            f"{level.name} {level.value:.0f}",
            xy=(1.0, level.value),
            xytext=(_LABEL_X, height),
            xycoords=_LABEL_COORDINATES,
            textcoords=_LABEL_COORDINATES,
            arrowprops={
                "arrowstyle": "-",
                "color": level.color,
                "linewidth": 0.6,
                "relpos": (0.0, 0.5),  # from the middle of the left side of the label
                "shrinkB": 0.0,
            },
            va="center",
            fontsize=8,
            color=level.color,
        )


def _spread_heights(values: Sequence[float], gap: float, top: float) -> list[float]:
    """Return heights near ascending values, `gap` or more apart, the highest at most at `top`."""
    heights: list[float] = []
    for value in values:
        heights.append(max(value, heights[-1] + gap) if heights else value)
    for index in reversed(range(len(heights))):
        heights_above = len(heights) - 1 - index
        heights[index] = min(heights[index], top - gap * heights_above)
    return heights
