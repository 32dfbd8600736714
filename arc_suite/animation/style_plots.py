"""Pictures of tracks: foot contacts against the schedule, reward by term, speed against target, path of the torso.

Each function takes labeled tracks, one or two to compare, and returns a figure. Needs matplotlib (extra `animate`).
"""

import functools
from collections.abc import Mapping
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from arc_suite.animation.colors import BLUE, FAINT, INK, PALE, VERMILION, term_colors
from arc_suite.motions.runs import find_runs
from arc_suite.style import metrics
from arc_suite.style.tracks import Track

_STYLE: dict[Any, Any] = {
    "font.size": 9.5,
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlepad": 9,
    "axes.labelcolor": INK,
    "axes.edgecolor": FAINT,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "text.color": INK,
    "xtick.color": FAINT,
    "ytick.color": FAINT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "savefig.dpi": 150,
}
_WIDTH = 9.5  # inches, of a figure
_GAIT_HEIGHT_PER_LEG = 0.36  # inches
_GAIT_MARGIN = 0.75  # inches, above and below the legs of a track
_REWARD_HEIGHT = 2.75  # inches, of a track
_SPEED_HEIGHT = 3.5  # inches
_LEGEND_HEIGHT = 0.55  # inches
_SMALL_FONT = 8.5  # points
_DASHES = (0, (5, 3))  # line style of a target
_LEGEND_BELOW: dict[str, Any] = {"loc": "outside lower center", "handlelength": 1.4, "borderpad": 0.2}
_LEGEND_ON_THE_RIGHT: dict[str, Any] = {
    "alignment": "left",
    "loc": "center left",
    "bbox_to_anchor": (1.01, 0.5),
    "fontsize": _SMALL_FONT,
    "labelspacing": 0.3,
    "handlelength": 1.2,
}
_ARROWS: dict[str, Any] = {
    "angles": "xy",
    "scale_units": "xy",
    "width": 0.003,
    "headwidth": 5,
    "headlength": 5.5,
    "headaxislength": 5,
}
_GAIT_WINDOW = 4.0  # s of foot contacts
_SCHEDULE_BAR = 0.84  # height of a bar, of the distance between two legs
_STANCE_BAR = 0.4
_ARROW_DISTANCE = 0.08  # between two arrows on a path, of the width of the axes
_ARROWS_IN_WIDTH = 25.0  # lengths of an arrow in the width of the axes


def _in_our_style(draw):
    """Wrap a function that draws a figure: it uses the style above."""

    @functools.wraps(draw)
    def draw_in_style(tracks: Mapping[str, Track]) -> Figure:
        with matplotlib.rc_context(_STYLE):
            figure = draw(tracks)
            figure.get_layout_engine().set(w_pad=0.1, h_pad=0.06, hspace=0.06)
            figure.draw_without_rendering()  # while the style holds
            return figure

    return draw_in_style


@_in_our_style
def gait(tracks: Mapping[str, Track]) -> Figure:
    """Draw the gait: bars of stance over time, by leg, on the prescribed schedule; four seconds amid the track."""
    most_legs = max(len(track.legs) for track in tracks.values())
    figure, axes = _stack_axes(tracks, _GAIT_HEIGHT_PER_LEG * most_legs + _GAIT_MARGIN)
    for (label, track), axis in zip(tracks.items(), axes, strict=True):
        _draw_stances(axis, track)
        _write_gait_metrics(axis, track)
        axis.set_title(label)
        axis.set_yticks(range(len(track.legs)), track.legs)
        axis.set_ylim(len(track.legs) - 0.5, -0.5)
        axis.tick_params(axis="y", length=0)
        axis.spines["left"].set_visible(False)
    axes[-1].set_xlabel("time (s)")
    colors = {
        "prescribed stance (bare where missed)": PALE,
        "stance as prescribed": BLUE,
        "stance in place of swing": VERMILION,
    }
    handles = [Patch(color=color, label=text) for text, color in colors.items()]
    figure.legend(handles=handles, ncols=3, **_LEGEND_BELOW)
    return figure


def _draw_stances(axis, track: Track) -> None:
    """Draw bars of stance and schedule of each leg, in the window amid a track."""
    middle = len(track.times) // 2
    half_window = round(0.5 * _GAIT_WINDOW / track.time_step)
    window = slice(max(0, middle - half_window), middle + half_window)
    start = track.times[window][0] - track.time_step
    stance = track.stance[window]
    schedule = track.schedule[window]
    for leg in range(len(track.legs)):
        leg_stance = stance[:, leg]
        leg_schedule = schedule[:, leg]
        bars = (  # when they show, their height and their color
            (leg_schedule, _SCHEDULE_BAR, PALE),
            (leg_stance & leg_schedule, _STANCE_BAR, BLUE),
            (leg_stance & ~leg_schedule, _STANCE_BAR, VERMILION),
        )
        for is_shown, height, color in bars:
            spans = []  # pairs of a start and a duration, s
            for first, end in find_runs(is_shown):
                spans.append((start + track.time_step * first, track.time_step * (end - first)))
            axis.broken_barh(spans, (leg - height / 2, height), color=color, linewidth=0)
    axis.set_xlim(start, start + track.time_step * len(stance))


def _write_gait_metrics(axis, track: Track) -> None:
    """Write columns of compliance, duty factor and phase error of each leg to the right of its bars."""
    prescribed_duty_factor = track.duty_factors.mean()
    delays = []
    for error in metrics.phase_error(track):
        delays.append("–" if np.isnan(error) else f"{error:+z.2f} cycles")
    columns = (  # x, heading, and a text for each leg
        (1.06, "compliance", [f"{100 * share:.0f} %" for share in metrics.gait_compliance(track)]),
        (
            1.195,
            f"duty factor\n({prescribed_duty_factor:.2f} wanted)",
            [f"{share:.2f}" for share in metrics.duty_factor(track)],
        ),
        (1.315, "late by", delays),
    )
    # x is in widths of the axes, y counts legs.
    placement = {"transform": axis.get_yaxis_transform(), "ha": "center", "fontsize": _SMALL_FONT}
    for x, heading, texts in columns:
        axis.text(x, -0.6, heading, va="bottom", color=FAINT, linespacing=1.25, **placement)
        for leg, text in enumerate(texts):
            axis.text(x, leg, text, va="center", **placement)


@_in_our_style
def reward(tracks: Mapping[str, Track]) -> Figure:
    """Draw the reward's weighted terms over time, gains stacked upwards and costs downwards, as means over a cycle."""
    figure, axes = _stack_axes(tracks, _REWARD_HEIGHT, sharey=True)
    for (label, track), axis in zip(tracks.items(), axes, strict=True):
        term_handles = _draw_terms(axis, track)
        reward_label = f"{track.rewards.mean():+.3f}  reward"
        mean_rewards = _mean_over_a_cycle(track, track.rewards)
        (reward_handle,) = axis.plot(track.times, mean_rewards, color="black", linewidth=1.2, label=reward_label)
        axis.axhline(0.0, color="white", linewidth=0.8)
        axis.set_title(f"{label}: return {track.rewards.sum():.0f}")
        axis.set_ylabel("reward a step")
        axis.set_xlim(0.0, track.times[-1])
        axis.legend(handles=[reward_handle, *term_handles], title="mean a step", **_LEGEND_ON_THE_RIGHT)
    axes[-1].set_xlabel("time (s)")
    return figure


def _draw_terms(axis, track: Track) -> list:
    """Draw the weighted terms of a reward, and return their handles for a legend, from the top down."""
    weighted_terms = {name: weight * track.terms[name] for name, weight in track.weights.items()}
    colors = term_colors(weighted_terms)
    gains = [name for name, weight in track.weights.items() if weight > 0.0]
    costs = [name for name in track.weights if name not in gains]
    handle_of_term = {}
    for names in (gains, costs):
        lower_edge = np.zeros(len(track.times))
        for name in names:
            upper_edge = lower_edge + _mean_over_a_cycle(track, weighted_terms[name])
            term_label = f"{weighted_terms[name].mean():+.3f}  {name.replace('_', ' ')}"
            handle_of_term[name] = axis.fill_between(
                track.times, lower_edge, upper_edge, label=term_label, facecolor=colors[name], linewidth=0
            )
            lower_edge = upper_edge
    return [handle_of_term[name] for name in (*reversed(gains), *costs)]


@_in_our_style
def speed(tracks: Mapping[str, Track]) -> Figure:
    """Draw forward speed over time against the target: its mean over a gait cycle, and the range of the steps in it."""
    figure = Figure(figsize=(_WIDTH, _SPEED_HEIGHT), layout="constrained")
    axis = figure.subplots()
    target = _first_target_velocity(tracks)
    if not np.isnan(target):
        axis.axhline(target, color=INK, linewidth=1, linestyle=_DASHES, label=f"target: {target:.2f} m/s")
    for (label, track), color in zip(tracks.items(), (BLUE, VERMILION), strict=False):
        x = track.positions[:, 0]
        speeds = np.diff(x) / track.time_step if len(x) > 1 else np.array([np.nan])
        times = track.times[-len(speeds) :]
        lowest, highest = _range_over_a_cycle(track, speeds)
        axis.fill_between(times, lowest, highest, color=color, alpha=0.2, linewidth=0)
        mean_label = f"{label}: {metrics.speed(track):z.2f} m/s"
        axis.plot(times, _mean_over_a_cycle(track, speeds), color=color, linewidth=1.8, label=mean_label)
    axis.set_title("Forward speed: mean over a gait cycle, and range of the steps within")
    axis.set_ylabel("speed (m/s)")
    axis.set_xlabel("time (s)")
    axis.set_xlim(0.0, max(track.times[-1] for track in tracks.values()))
    figure.legend(ncols=2, **_LEGEND_BELOW)
    return figure


@_in_our_style
def path(tracks: Mapping[str, Track]) -> Figure:
    """Draw the path of the torso from above, in equal scales; arrows show where the robot faces."""
    points = np.concatenate([track.positions[:, :2] for track in tracks.values()])
    left, bottom = points.min(axis=0)
    right, top = points.max(axis=0)
    width = 1.1 * max(right - left, 1.5 * (top - bottom), 1.0)  # m, of the axes: a margin around the paths
    height = max(1.3 * (top - bottom), 0.16 * width)  # m, of the axes
    axes_width = 0.92 * _WIDTH  # inches
    figure_height = axes_width * height / width + 1.5  # inches, with title and legend
    figure = Figure(figsize=(_WIDTH, figure_height), layout="constrained")
    axis = figure.subplots()
    target_is_along_x = not np.isnan(_first_target_velocity(tracks))
    if target_is_along_x:
        axis.axhline(0.0, color=INK, linewidth=1, linestyle=_DASHES, zorder=0)
    for (label, track), color in zip(tracks.items(), (BLUE, VERMILION), strict=False):
        x = track.positions[:, 0]
        y = track.positions[:, 1]
        axis.plot(x, y, color=color, linewidth=1.6, label=f"{label}: {x[-1] - x[0]:.1f} m forward")
        path_lengths = np.concatenate([[0.0], np.hypot(np.diff(x), np.diff(y)).cumsum()])
        arrows = np.flatnonzero(np.diff(path_lengths // (_ARROW_DISTANCE * width))) + 1
        forward_x, forward_y = metrics.forward_axes(track)[arrows, :2].T
        axis.quiver(x[arrows], y[arrows], forward_x, forward_y, color=color, scale=_ARROWS_IN_WIDTH / width, **_ARROWS)
    start_x, start_y = points[0]
    axis.plot(start_x, start_y, "o", color=INK, markersize=5, zorder=5)
    axis.set_xlim(0.5 * (left + right - width), 0.5 * (left + right + width))
    axis.set_ylim(0.5 * (bottom + top - height), 0.5 * (bottom + top + height))
    axis.set_aspect("equal")
    axis.locator_params(axis="y", nbins=4)
    axis.set_title("Path of the torso from above")
    axis.set_xlabel("x (m), target direction" if target_is_along_x else "x (m)")
    axis.set_ylabel("y (m)")
    figure.legend(ncols=2, **_LEGEND_BELOW)
    return figure


PICTURES = {function.__name__: function for function in (gait, reward, speed, path)}
GAIT_PICTURES = ("gait",)  # those that only tracks of a task with a gait have


def _stack_axes(tracks: Mapping[str, Track], height: float, **shared):
    """Return a figure with axes for each track, one above the other, and these axes.

    Args:
        tracks: tracks to be drawn.
        height: height of the axes of a track, inches.
        shared: see `Figure.subplots`.
    """
    figure = Figure(figsize=(_WIDTH, height * len(tracks) + _LEGEND_HEIGHT), layout="constrained")
    axes = figure.subplots(len(tracks), squeeze=False, **shared)
    return figure, axes[:, 0]


def _first_target_velocity(tracks: Mapping[str, Track]) -> float:
    """Return the target velocity of the first track, m/s; NaN if it has none."""
    first_track, *_ = tracks.values()
    return first_track.target_velocity


def _steps_in_a_cycle(track: Track) -> float:
    """Return the control steps in a cycle of the gait clock; in the whole track, if there is none or it stands."""
    frequency = 0.0
    if track.parameters is not None:
        frequency = track.parameters.gait_frequency
    lowest_frequency = 1.0 / track.times[-1]  # of one cycle in the whole track
    return 1.0 / (max(frequency, lowest_frequency) * track.time_step)


def _mean_over_a_cycle(track: Track, values):
    """Return the moving average over a cycle, which need not be whole steps; at the ends over what there is of it."""
    width = _steps_in_a_cycle(track)
    reach = int(np.ceil(width / 2))
    distances = abs(np.arange(-reach, reach + 1))  # steps from the middle
    window = (0.5 * width + 0.5 - distances).clip(0.0, 1.0)
    sums = np.convolve(values, window)[reach:-reach]
    weights = np.convolve(np.ones(len(values)), window)[reach:-reach]
    return sums / weights


def _range_over_a_cycle(track: Track, values):
    """Return the least and the greatest of the values in the cycle about each."""
    reach = round(_steps_in_a_cycle(track) / 2)
    padded = np.pad(values, reach, mode="reflect" if len(values) > reach else "edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
    return windows.min(axis=-1), windows.max(axis=-1)
