"""Reports of style: all metrics of a track by name, and their statistics over episodes."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from arc_suite import evaluation
from arc_suite.style import metrics
from arc_suite.style.tracks import Track, only_setup
from arc_suite.tasks.clock import TWO_PI

_TOLERANCE = 1e-4  # relative error of a frequency that is measured from the clock


def _stride_frequency(track: Track) -> float:
    """Return the frequency of the clock while it advances, Hz; NaN for a gait whose legs always stand, or never."""
    parameters = track.parameters
    if not 0.0 < parameters.duty_factor < 1.0:
        return np.nan
    advances = np.diff(track.phases) % TWO_PI
    mean = np.nan
    if advances.any():
        mean = advances[advances > 0.0].mean() / (TWO_PI * track.time_step)
    prescribed = parameters.gait_frequency
    is_changed_by_command = prescribed and abs(mean / prescribed - 1.0) > _TOLERANCE
    return float(mean) if is_changed_by_command else prescribed  # the prescribed one is without rounding


def _stride_length(track: Track) -> float:
    """Return the displacement in a stride at the target speed, m; NaN where no stride or no speed is prescribed."""
    return track.target_velocity / (_stride_frequency(track) or np.nan)


def _duty_factor(track: Track) -> float:
    """Return the mean duty factor of the gait, without rounding where it is constant."""
    first = track.duty_factors[0]
    return float(first + (track.duty_factors - first).mean())


class Metric(NamedTuple):
    """The entry of a metric in the table.

    Attributes:
        function: function of a track.
        unit: shares and indices have none.
        prescribed: the value that the task prescribes, of a track; None if it prescribes none.
        of_gait: whether it needs the prescribed gait or pose; left out in a task without one.
    """

    function: Callable[[Track], np.ndarray | float]
    unit: str
    prescribed: Callable[[Track], float] | None = None
    of_gait: bool = False


class Measurement(NamedTuple):
    """The body's value of a metric, and each leg's by name; no legs where it is not a metric of legs."""

    value: float
    legs: Mapping[str, float]


METRICS = {
    metric.function.__name__: metric
    for metric in (
        Metric(metrics.gait_compliance, "", lambda track: 1.0, of_gait=True),
        Metric(metrics.duty_factor, "", _duty_factor, of_gait=True),
        Metric(metrics.phase_error, "cycles", lambda track: 0.0, of_gait=True),
        Metric(metrics.phase_scatter, "", lambda track: 0.0, of_gait=True),
        Metric(metrics.stride_length, "m", _stride_length, of_gait=True),
        Metric(metrics.stride_frequency, "Hz", _stride_frequency, of_gait=True),
        Metric(metrics.foot_slip, "m/m"),
        Metric(metrics.foot_clearance, "m", of_gait=True),
        Metric(metrics.speed, "m/s", lambda track: track.target_velocity),
        Metric(metrics.heading_error, "rad"),
        Metric(metrics.lateral_drift, "m/m"),
        Metric(metrics.torso_pitch, "rad"),
        Metric(metrics.torso_roll, "rad"),
        Metric(metrics.height_variation, "m"),
        Metric(metrics.posture_deviation, "rad", of_gait=True),
        Metric(metrics.action_change, ""),
        Metric(metrics.torque, "N m"),
        Metric(metrics.asymmetry, "m", of_gait=True),
        Metric(metrics.cost_of_transport, "J/(N m)"),
    )
}


def measure(track: Track) -> dict[str, Measurement]:
    """Return the metrics of a track by name; metrics of the gait only if the task prescribes one.

    A robot's phase error is the mean size of its legs' errors, so that early and late do not
    cancel. Legs whose value is NaN do not count; NaN if that is all of them.
    """
    return {
        name: _measurement(track, name, metric.function(track))
        for name, metric in METRICS.items()
        if track.parameters is not None or not metric.of_gait
    }


def _measurement(track, name, values) -> Measurement:
    if np.ndim(values) == 0:
        return Measurement(float(values), {})
    counted = abs(values) if name == "phase_error" else values
    counted = counted[~np.isnan(counted)]
    value = float(counted.mean()) if counted.size else np.nan
    return Measurement(value, dict(zip(track.legs, map(float, values), strict=True)))


def report(tracks: Iterable[Track]) -> dict[str, Any]:
    """Return the metrics of a policy, over tracks of one setup.

    Returns:
        `seeds` of the episodes, `return` and `length` as summaries of the evaluation protocol, `progress` as summaries
        by name, and under `metrics`, by name, the `unit`, the mean of the value `prescribed` or None, the summary of
        the `robot`, and of each of the `legs`.

    Raises:
        ValueError: no tracks, or tracks of several setups.
    """
    tracks = list(tracks)
    only_setup(tracks)
    measured = [measure(track) for track in tracks]
    return {
        "seeds": [track.seed for track in tracks],
        "return": evaluation.summary([track.rewards.sum() for track in tracks]),
        "length": evaluation.summary([len(track.times) for track in tracks]),
        "progress": {
            name: evaluation.summary([track.progress[name] for track in tracks]) for name in tracks[0].progress
        },
        "metrics": {
            name: {
                "unit": metric.unit,
                "prescribed": _prescribed_value(metric, tracks),
                "robot": evaluation.summary([measurement[name].value for measurement in measured]),
                "legs": {
                    leg: evaluation.summary([measurement[name].legs[leg] for measurement in measured])
                    for leg in measured[0][name].legs
                },
            }
            for name, metric in METRICS.items()
            if name in measured[0]
        },
    }


def _prescribed_value(metric: Metric, tracks: Sequence[Track]) -> float | None:
    """Return the mean over tracks of the value that is prescribed for a metric, or None."""
    if not metric.prescribed:
        return None
    values = [metric.prescribed(track) for track in tracks]
    value = values[0] if len(set(values)) == 1 else float(np.mean(values))
    return None if value is None or np.isnan(value) else value
