"""Pictures of tracks: foot contacts against the schedule, reward by term, speed against target, path of the torso.

Each function takes labeled tracks, one or two to compare, and returns a figure. Needs matplotlib
(extra `animate`).
"""

import functools
from collections.abc import Mapping
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from arc_suite.animation.colors import BLUE, FAINT, INK, PALE, VERMILION, term_colors
from arc_suite.style import metrics
from arc_suite.style.tracks import Track

_LOOK: dict[Any, Any] = {
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
_WIDTH = 9.5  # inches
_BELOW: dict[str, Any] = {"loc": "outside lower center", "handlelength": 1.4, "borderpad": 0.2}  # a legend
_ARROWS: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "width": 0.003}
_ARROWS |= {"headwidth": 5, "headlength": 5.5, "headaxislength": 5}
_BESIDE: dict[str, Any] = {"alignment": "left", "loc": "center left", "bbox_to_anchor": (1.01, 0.5)}  # a legend
_BESIDE |= {"fontsize": 8.5, "labelspacing": 0.3, "handlelength": 1.2}
_WINDOW = 4.0  # s of foot contacts


def _drawn(draw):
    @functools.wraps(draw)
    def wrapped(tracks: Mapping[str, Track]) -> Figure:
        with matplotlib.rc_context(_LOOK):
            figure = draw(tracks)
            figure.get_layout_engine().set(w_pad=0.1, h_pad=0.06, hspace=0.06)
            figure.draw_without_rendering()  # while the look holds
            return figure

    return wrapped


@_drawn
def gait(tracks: Mapping[str, Track]) -> Figure:
    """Draw the gait: bars of stance over time, by leg, on the prescribed schedule; four seconds amid the track."""
    legs = max(len(track.legs) for track in tracks.values())
    figure, axes = _rows(tracks, 0.36 * legs + 0.75)
    for (label, track), axis in zip(tracks.items(), axes, strict=True):
        middle, half = len(track.times) // 2, round(0.5 * _WINDOW / track.time_step)
        rows = slice(max(0, middle - half), middle + half)
        start, dt = track.times[rows][0] - track.time_step, track.time_step
        stance, schedule = track.stance[rows], track.schedule[rows]
        for leg in range(len(track.legs)):
            for mask, height, color in (
                (schedule[:, leg], 0.84, PALE),
                (stance[:, leg] & schedule[:, leg], 0.4, BLUE),
                (stance[:, leg] & ~schedule[:, leg], 0.4, VERMILION),
            ):
                spans = [(start + dt * first, dt * (last - first)) for first, last in _runs(mask)]
                axis.broken_barh(spans, (leg - height / 2, height), color=color, linewidth=0)
        compliance, duty, error = metrics.gait_compliance(track), metrics.duty_factor(track), metrics.phase_error(track)
        wanted = track.duty_factors.mean()
        for column, heading, texts in (
            (1.06, "compliance", [f"{100 * share:.0f} %" for share in compliance]),
            (1.195, f"duty factor\n({wanted:.2f} wanted)", [f"{share:.2f}" for share in duty]),
            (1.315, "late by", ["–" if np.isnan(late) else f"{late:+z.2f} cycles" for late in error]),
        ):
            place = {"transform": axis.get_yaxis_transform(), "ha": "center", "fontsize": 8.5}
            axis.text(column, -0.6, heading, va="bottom", color=FAINT, linespacing=1.25, **place)
            for leg, text in enumerate(texts):
                axis.text(column, leg, text, va="center", **place)
        axis.set_title(label)
        axis.set_yticks(range(len(track.legs)), track.legs)
        axis.set_ylim(len(track.legs) - 0.5, -0.5)
        axis.set_xlim(start, start + dt * len(stance))
        axis.tick_params(axis="y", length=0)
        axis.spines["left"].set_visible(False)
    axes[-1].set_xlabel("time (s)")
    entries = {
        "prescribed stance (bare where missed)": PALE,
        "stance as prescribed": BLUE,
        "stance in place of swing": VERMILION,
    }
    figure.legend(handles=[Patch(color=color, label=text) for text, color in entries.items()], ncols=3, **_BELOW)
    return figure


@_drawn
def reward(tracks: Mapping[str, Track]) -> Figure:
    """Draw the reward's weighted terms over time, gains stacked upwards and costs downwards, as means over a cycle."""
    figure, axes = _rows(tracks, 2.75, sharey=True)
    for (label, track), axis in zip(tracks.items(), axes, strict=True):
        weighted = {name: weight * track.terms[name] for name, weight in track.weights.items()}
        gains = [name for name, weight in track.weights.items() if weight > 0.0]
        costs = [name for name in track.weights if name not in gains]
        handles = {}
        for names in (gains, costs):
            floor = np.zeros(len(track.times))
            for name in names:
                ceiling = floor + _over_a_cycle(track, weighted[name])
                look = {"facecolor": term_colors(weighted)[name], "linewidth": 0}
                label = f"{weighted[name].mean():+.3f}  {name.replace('_', ' ')}"
                handles[name] = axis.fill_between(track.times, floor, ceiling, label=label, **look)
                floor = ceiling
        means, label = _over_a_cycle(track, track.rewards), f"{track.rewards.mean():+.3f}  reward"
        (total,) = axis.plot(track.times, means, color="black", linewidth=1.2, label=label)
        axis.axhline(0.0, color="white", linewidth=0.8)
        axis.set_title(f"{label}: return {track.rewards.sum():.0f}")
        axis.set_ylabel("reward a step")
        axis.set_xlim(0.0, track.times[-1])
        entries = [total, *(handles[name] for name in (*reversed(gains), *costs))]
        axis.legend(handles=entries, title="mean a step", **_BESIDE)
    axes[-1].set_xlabel("time (s)")
    return figure


@_drawn
def speed(tracks: Mapping[str, Track]) -> Figure:
    """Draw forward speed over time against the target: its mean over a gait cycle, and the range of the steps in it."""
    figure = Figure(figsize=(_WIDTH, 3.5), layout="constrained")
    axis = figure.subplots()
    first = next(iter(tracks.values()))
    if not np.isnan(target := first.target_velocity):
        axis.axhline(target, color=INK, linewidth=1, linestyle=(0, (5, 3)), label=f"target: {target:.2f} m/s")
    for (label, track), color in zip(tracks.items(), (BLUE, VERMILION), strict=False):
        x = track.positions[:, 0]
        steps = np.diff(x) / track.time_step if len(x) > 1 else np.array([np.nan])
        times = track.times[-len(steps) :]
        low, high = _range_over_a_cycle(track, steps)
        axis.fill_between(times, low, high, color=color, alpha=0.2, linewidth=0)
        name = f"{label}: {metrics.speed(track):z.2f} m/s"
        axis.plot(times, _over_a_cycle(track, steps), color=color, linewidth=1.8, label=name)
    axis.set_title("Forward speed: mean over a gait cycle, and range of the steps within")
    axis.set_ylabel("speed (m/s)")
    axis.set_xlabel("time (s)")
    axis.set_xlim(0.0, max(track.times[-1] for track in tracks.values()))
    figure.legend(ncols=2, **_BELOW)
    return figure


@_drawn
def path(tracks: Mapping[str, Track]) -> Figure:
    """Draw the path of the torso from above, in equal scales; arrows show where the robot faces."""
    points = np.concatenate([track.positions[:, :2] for track in tracks.values()])
    (left, low), (right, high) = points.min(axis=0), points.max(axis=0)
    width = 1.1 * max(right - left, 1.5 * (high - low), 1.0)
    height = max(1.3 * (high - low), 0.16 * width)
    figure = Figure(figsize=(_WIDTH, 0.92 * _WIDTH * height / width + 1.5), layout="constrained")
    axis = figure.subplots()
    straight = not np.isnan(next(iter(tracks.values())).target_velocity)  # whether the target is along x
    if straight:
        axis.axhline(0.0, color=INK, linewidth=1, linestyle=(0, (5, 3)), zorder=0)
    for (label, track), color in zip(tracks.items(), (BLUE, VERMILION), strict=False):
        x, y = track.positions[:, 0], track.positions[:, 1]
        axis.plot(x, y, color=color, linewidth=1.6, label=f"{label}: {x[-1] - x[0]:.1f} m forward")
        path = np.concatenate([[0.0], np.hypot(np.diff(x), np.diff(y)).cumsum()])
        arrows = np.flatnonzero(np.diff(path // (0.08 * width))) + 1
        facing = metrics.forward_axes(track)[arrows, :2].T
        axis.quiver(x[arrows], y[arrows], *facing, color=color, scale=25.0 / width, **_ARROWS)
    axis.plot(*points[0], "o", color=INK, markersize=5, zorder=5)
    axis.set_xlim(0.5 * (left + right - width), 0.5 * (left + right + width))
    axis.set_ylim(0.5 * (low + high - height), 0.5 * (low + high + height))
    axis.set_aspect("equal")
    axis.locator_params(axis="y", nbins=4)
    axis.set_title("Path of the torso from above")
    axis.set_xlabel("x (m), target direction" if straight else "x (m)")
    axis.set_ylabel("y (m)")
    figure.legend(ncols=2, **_BELOW)
    return figure


PICTURES = {function.__name__: function for function in (gait, reward, speed, path)}
GAIT_PICTURES = ("gait",)  # those that only tracks of a task with a gait have


def _rows(tracks, height, **shared):
    figure = Figure(figsize=(_WIDTH, height * len(tracks) + 0.55), layout="constrained")
    return figure, figure.subplots(len(tracks), squeeze=False, **shared)[:, 0]


def _runs(mask):
    """Return the first and one past the last index of every run of true values."""
    return np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int))).reshape(-1, 2)


def _steps_in_a_cycle(track) -> float:
    """Return the control steps in a cycle of the gait clock; in the whole track, if there is none or it stands."""
    frequency = 0.0 if track.parameters is None else track.parameters.gait_frequency
    return 1.0 / (max(frequency, 1.0 / track.times[-1]) * track.time_step)


def _over_a_cycle(track, values):
    """Return the moving average over a cycle, which need not be whole steps; at the ends over what there is of it."""
    width = _steps_in_a_cycle(track)
    reach = int(np.ceil(width / 2))
    window = (0.5 * width + 0.5 - abs(np.arange(-reach, reach + 1))).clip(0.0, 1.0)
    sums, weights = (np.convolve(x, window)[reach:-reach] for x in (values, np.ones(len(values))))
    return sums / weights


def _range_over_a_cycle(track, values):
    """Return the least and the greatest of the values in the cycle about each."""
    reach = round(_steps_in_a_cycle(track) / 2)
    padded = np.pad(values, reach, mode="reflect" if len(values) > reach else "edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1)
    return windows.min(axis=-1), windows.max(axis=-1)
