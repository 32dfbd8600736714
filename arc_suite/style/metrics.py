"""Metrics of style: pure functions of a track, in NumPy.

A metric of legs gives one value for each leg, (feet,), and the robot's value is their mean. Any other metric gives a
number. A value is NaN if the motion that it measures did not happen, such as the stride of a robot that stands. A
robot gets nowhere if it moves less than 5 % of the distance at the target speed: then it has no course, and its costs
per meter are infinite.
"""

import numpy as np

from arc_suite import rotations
from arc_suite.models.sizing import size_body
from arc_suite.style.tracks import Track

TWO_PI = 2.0 * np.pi

_MIN_DISTANCE_SHARE = 0.05  # of the distance at the target speed; a robot that moves less gets nowhere
_MIN_STRENGTH_SHARE = 0.1  # of the schedule's vector strength; a leg below it follows another rhythm or none
_BINS = 20  # parts of a cycle, in which paths of feet are averaged


def gait_compliance(track: Track) -> np.ndarray:
    """Share of time that a foot is in stance or swing as prescribed (the paper's Section 4); (feet,) in 0 to 1."""
    return (track.stance == track.schedule).mean(axis=0)


def duty_factor(track: Track) -> np.ndarray:
    """Share of time in stance (Alexander, "The gaits of bipedal and quadrupedal animals", 1984); (feet,) in 0 to 1.

    Stance is a foot below the paper's threshold, as everywhere in the gait's metrics.
    """
    return track.stance.mean(axis=0)


def phase_error(track: Track) -> np.ndarray:
    """Lateness of the middle of stance against the schedule, in cycles of the clock; (feet,) in -0.5 to 0.5.

    It is positive where a foot stands later than in the schedule.

    The middle of stance is its circular mean over the clock (Fisher, "Statistical analysis of circular data", 1993).
    That of the schedule is computed from the same samples. NaN for a leg that never changes between stance and swing,
    or does so in another rhythm than the clock's.
    """
    phase_vectors = np.exp(1j * track.leg_phases)

    def mean_vector(stance):
        """Return complex numbers (feet,): the angle is the middle of stance, the size its vector strength."""
        # Without its mean, a foot that always stands has the vector 0.
        return ((stance - stance.mean(axis=0)) * phase_vectors).mean(axis=0)

    actual = mean_vector(track.stance)
    prescribed = mean_vector(track.schedule)
    has_phase = (abs(actual) > _MIN_STRENGTH_SHARE * abs(prescribed)) & (abs(prescribed) > 1e-9)
    return np.where(has_phase, np.angle(actual * prescribed.conj()) / TWO_PI, np.nan)


def phase_scatter(track: Track) -> float:
    """Circular variance of the legs' phase errors (Fisher, 1993), 0 to 1.

    0 if all legs are late by the same time: the gait is the prescribed one with a lag. 1 if half of the legs are half
    a cycle off the others, as in a hop. NaN for fewer than two legs that have a phase.
    """
    errors = phase_error(track)
    errors = errors[~np.isnan(errors)]
    return float(1.0 - abs(np.exp(1j * TWO_PI * errors).mean())) if errors.size > 1 else np.nan


def stride_length(track: Track) -> np.ndarray:
    """Mean displacement of a foot from touchdown to touchdown along world x (Alexander, 1984), m; (feet,).

    Negative backwards. NaN for a foot without two touchdowns. A touchdown ends a swing in which the foot rose over
    half of its clearance: a foot that bounces in stance does not stride.
    """
    lengths = np.full(len(track.legs), np.nan)
    for leg, steps in enumerate(_touchdown_steps(track)):
        if steps.size > 1:
            first, last = track.foot_positions[steps[[0, -1]], leg, 0]
            lengths[leg] = (last - first) / (steps.size - 1)
    return lengths


def stride_frequency(track: Track) -> np.ndarray:
    """Number of strides, from touchdown to touchdown, in a second (Alexander, 1984), Hz; (feet,).

    Touchdowns are those of `stride_length`; NaN for a foot without two of them.
    """
    durations = np.full(len(track.legs), np.nan)  # of a stride, s
    for leg, steps in enumerate(_touchdown_steps(track)):
        if steps.size > 1:
            durations[leg] = track.time_step * (steps[-1] - steps[0]) / (steps.size - 1)
    return 1.0 / durations


def _touchdown_steps(track) -> list[np.ndarray]:
    """Return the steps of the touchdowns of each leg; see `stride_length`."""
    begins_stance = track.stance[1:] & ~track.stance[:-1]  # of the second step on
    is_lifted = ~track.stance & (_heights(track) > 0.5 * foot_clearance(track))
    lifted_steps = is_lifted.cumsum(axis=0)
    touchdowns = []
    for leg in range(len(track.legs)):
        steps = np.flatnonzero(begins_stance[:, leg]) + 1
        # Number of lifted steps between a start of stance and the one before, or the start of the track.
        lifted_steps_before = np.diff(lifted_steps[steps, leg], prepend=0)
        touchdowns.append(steps[lifted_steps_before > 0])
    return touchdowns


def foot_slip(track: Track) -> np.ndarray:
    """Path of a foot that slides on the ground, divided by the displacement of the torso, m/m; (feet,).

    The path is the integral of the horizontal speed of the foot's lowest point: rolling does not count. It is the foot
    slippage of Hwangbo et al., "Learning agile and dynamic motor skills for legged robots", 2019, as a length.
    """
    horizontal_speeds = np.hypot(track.foot_velocities[..., 0], track.foot_velocities[..., 1])
    sliding_speeds = horizontal_speeds * track.contacts
    return _per_meter(track, sliding_speeds.sum(axis=0) * track.time_step)


def foot_clearance(track: Track) -> np.ndarray:
    """Greatest height of a foot's lowest point over the ground, mean over the clock's cycles, m; (feet,).

    It is the peak height of swing. For a foot that never swings it is the height at which the foot is dragged. The
    first and the last cycle of a track are incomplete, and count only if there are no others.
    """
    cycle_starts = np.flatnonzero(np.diff(track.phases) < 0.0) + 1
    cycles = np.split(_heights(track), cycle_starts)
    if len(cycles) > 2:
        cycles = cycles[1:-1]
    return np.mean([cycle.max(axis=0) for cycle in cycles], axis=0)


def _heights(track) -> np.ndarray:
    """Return the heights of the feet's lowest points over the ground, (steps, feet) m."""
    return track.foot_heights - track.foot_radii


def speed(track: Track) -> float:
    """Mean velocity of the torso along world x (the paper's Section 4), m/s; NaN for a single step."""
    duration = _duration(track)
    return float((track.positions[-1, 0] - track.positions[0, 0]) / duration) if duration else np.nan


def heading_error(track: Track) -> float:
    """Mean angle between the torso's forward axis and world x, seen from above, rad; 0 to pi."""
    forward = forward_axes(track)
    return float(abs(np.arctan2(forward[:, 1], forward[:, 0])).mean())


def lateral_drift(track: Track) -> float:
    """Displacement along world y, divided by the straight line from start to end, m/m; 0 to 1.

    It is the sine of the angle between the course and world x: 1 for a robot that walks sideways. NaN for a robot that
    gets nowhere.
    """
    sideways = abs(track.positions[-1, 1] - track.positions[0, 1])
    displacement = _displacement(track)
    return float(sideways / displacement) if displacement else np.nan


def torso_pitch(track: Track) -> float:
    """Root mean square of the torso's pitch, the angle of its forward axis to the horizontal, rad."""
    return _rms(np.arcsin(forward_axes(track)[:, 2].clip(-1.0, 1.0)))


def torso_roll(track: Track) -> float:
    """Root mean square of the torso's roll, by which it is turned about its forward axis, rad."""
    axes = rotations.matrix(track.quaternions)  # columns: forward, left and up in the world
    left_z = axes[:, 2, 1]
    up_z = axes[:, 2, 2]
    return _rms(np.arctan2(left_z, up_z))


def height_variation(track: Track) -> float:
    """Standard deviation of the torso's height over the ground, m."""
    return float(track.torso_heights.std())


def posture_deviation(track: Track) -> np.ndarray:
    """Root mean square angle of a leg's joints from the standing pose (of the paper's posture cost), rad; (feet,)."""
    return _rms_by_leg(track, track.joint_angles - track.parameters.default_angles)


def action_change(track: Track) -> np.ndarray:
    """Root mean square change of a leg's actions from step to step (of the paper's smoothness cost); (feet,) in 0 to 2.

    Actions are shares of the full torque. The action before the first is 0, as in the reward.
    """
    return _rms_by_leg(track, np.diff(track.actions, axis=0, prepend=0.0))


def torque(track: Track) -> np.ndarray:
    """Root mean square torque of a leg's motors, N m; (feet,)."""
    return _rms_by_leg(track, track.torques)


def asymmetry(track: Track) -> np.ndarray:
    """Distance between a foot's mean path and the reflected one of its left-right counterpart, m; (feet,).

    Paths are relative to the torso, and averaged in 20 bins of the leg's cycle in the schedule. The distance is the
    root mean square over the cycle. It is 0 for a symmetrical gait in Hildebrand's sense ("Symmetrical gaits of
    horses", 1965): left and right feet move alike, half a cycle apart. NaN for a leg that has no counterpart.
    """
    offsets = track.foot_positions - track.positions[:, None]  # from the torso, in the world
    # The transposed matrices of rotation lead from the world into the torso's frame.
    positions = np.einsum("tij,tfi->tfj", rotations.matrix(track.quaternions), offsets)
    cycle_shares = track.leg_phases / TWO_PI % 1.0
    bins = (cycle_shares * _BINS).astype(int) % _BINS  # a share may be rounded to 1, which is the first bin again
    mean_paths = np.full((len(track.legs), _BINS, 3), np.nan)  # NaN for bins without a step, which do not count
    for leg in range(len(track.legs)):
        for occupied_bin in np.unique(bins[:, leg]):
            mean_paths[leg, occupied_bin] = positions[bins[:, leg] == occupied_bin, leg].mean(axis=0)
    # Legs without a counterpart, whose mirror is -1, get the last leg's path here, and NaN below.
    reflected_paths = mean_paths[track.mirrors] * (1.0, -1.0, 1.0)
    squared_distances = ((mean_paths - reflected_paths) ** 2).sum(axis=-1)  # (feet, bins)
    has_counterpart = (track.mirrors >= 0)[:, None]
    return np.sqrt(_mean_where(squared_distances, ~np.isnan(squared_distances) & has_counterpart))


def cost_of_transport(track: Track) -> float:
    """Positive work of the motors and heat of their windings, divided by weight and displacement, J/(N m).

    See Collins et al., "Efficient bipedal robots based on passive-dynamic walkers", 2005. Negative work does not count,
    as motors do not recover it. Torque is constant in a control step: its work is torque times the change of the angle.
    """
    work = (track.torques[1:] * np.diff(track.joint_angles, axis=0)).clip(0.0).sum()
    losses = np.array([joint.drive.winding_loss for joint in size_body(track.body).joints])  # W/(N m)^2
    work += (losses * track.torques[1:] ** 2).sum() * track.time_step
    return float(_per_meter(track, work / (track.mass * track.gravity)))


def forward_axes(track: Track) -> np.ndarray:
    """Return the torso's x axes in the world, (steps, 3), which point forward."""
    return rotations.matrix(track.quaternions)[:, :, 0]


def _duration(track) -> float:
    """Return the time from the first to the last step, s."""
    return track.time_step * (len(track.positions) - 1)


def _displacement(track) -> float:
    """Return the length of the straight line from start to end, m; 0 for a robot that gets nowhere."""
    displacement = float(np.hypot(*(track.positions[-1] - track.positions[0])[:2]))
    target_speed = 0.0 if np.isnan(track.target_velocity) else abs(track.target_velocity)
    min_displacement = _MIN_DISTANCE_SHARE * (target_speed * _duration(track))
    return displacement if displacement > min_displacement else 0.0


def _per_meter(track, amount):
    """Return an amount divided by the displacement; infinite for a robot that gets nowhere."""
    displacement = _displacement(track)
    return amount / displacement if displacement else np.full_like(amount, np.inf)


def _rms(values) -> float:
    return float(np.sqrt((values**2).mean()))


def _rms_by_leg(track, values) -> np.ndarray:
    """Return the root mean square over time and over the joints of each leg: (steps, joints) to (feet,)."""
    squares = (values**2).mean(axis=0)
    counts = np.bincount(track.joint_legs, minlength=len(track.legs))
    sums = np.bincount(track.joint_legs, weights=squares, minlength=len(track.legs))
    return np.sqrt(sums / counts)


def _mean_where(values, mask) -> np.ndarray:
    """Return the mean over the last axis where the mask is true, NaN where it is nowhere."""
    counts = mask.sum(axis=-1)
    sums = np.where(mask, values, 0.0).sum(axis=-1)
    return np.where(counts > 0, sums / counts.clip(1), np.nan)
