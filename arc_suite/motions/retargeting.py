"""Motions of one body for another, by the paths of feet in standing heights.

Time is scaled as a pendulum of the standing height swings, so that speeds keep their Froude number. Joints follow the
torso and the feet by inverse kinematics.
"""

import math
from collections.abc import Callable
from typing import NamedTuple, Self

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from arc_suite import rotations
from arc_suite.models.foot_paths import RELAXING_SHARE
from arc_suite.models.kinematics import Legs
from arc_suite.models.posture import find_rest_pose
from arc_suite.models.standing import measure_standing, stability_margin, time_unit
from arc_suite.motions import gait_transfer
from arc_suite.motions.ground_poses import find_headings, place_points, relative_points
from arc_suite.motions.motion import MAX_SEAM, Motion, find_rest, make
from arc_suite.motions.paths import Paths, Size, match_feet, scale_heights, shrink_turns, time_scale
from arc_suite.motions.runs import find_runs
from arc_suite.robots.spec import Body

MAX_MISS = 0.05  # standing heights, of a foot from its path
MAX_SLIDE = 0.15  # the same of a leg with fewer than three joints, which cannot bring its foot to every place

_MIN_TRAVEL = 0.3  # standing heights over the ground, over which a foot cannot stay planted
_MIN_TURN = math.radians(20.0)  # of the torso, over which a foot cannot stay planted
_MIN_UPRIGHT = 0.5  # cosine of the torso's tilt, down to which it has a heading
_MIN_MARGIN = 0.05  # standing heights, of the center of mass from the edge of the feet that carry
_SHIFT_TIME = 1.5  # sqrt(h / g), in which the torso shifts before a foot lifts
_BISECTIONS = 12

# Changes that are tried in this order until legs reach: of the torso's height, and of the size of paths.
_RISES = (0.0, -0.05, 0.05, -0.1, 0.1, -0.2, -0.3)  # standing heights, of the torso
_SIZES = (
    *(Size(share) for share in (1.0, 0.85, 0.7)),
    *(Size(share, side=0.0) for share in (1.0, 0.85, 0.7, 0.55, 0.4)),  # for legs whose hinges are parallel
    *(Size(share) for share in (0.55, 0.4)),
)

# Inverse kinematics.
_FOOT_WEIGHTS = np.diag((1.0, 1.0, 2.0))
_SLIDING_FOOT_WEIGHTS = np.diag((1.0, 1.0, 8.0))  # of legs with fewer than three joints: they slide rather than sink
_DAMPING = 0.02  # standing heights
_ITERATIONS = 40  # from the pose at rest
_ITERATIONS_OF_NEXT_FRAME = 6  # from the frame before
_SEARCH_FRAMES = 24  # of a motion, for which changes are tried first
_VERTICAL = np.array((0.0, 0.0, 1.0))


class _Fit(NamedTuple):
    """Joint angles (frames, joints), rad, and how far feet miss their paths, (frames, legs), standing heights."""

    angles: np.ndarray
    misses: np.ndarray


def retarget(motion: Motion, body: Body) -> tuple[Motion, list[str]]:
    """Return a motion of another body as one of this body, and a line for each thing that was changed.

    In a loop of steps each foot follows the path of its partner by its own phase, in the gait of this body. In another
    motion feet follow those that stand in the same place at rest; feet without a partner stay planted, and the torso
    stays over the feet that carry.

    Args:
        motion: motion of any body.
        body: the body that is to move.

    Raises:
        ValueError: legs do not reach the paths of their feet within `MAX_MISS`, or `MAX_SLIDE`, or a loop does not
            close.
    """
    transfer = gait_transfer.transfer if gait_transfer.count_cycles(motion) else _transfer_gesture
    paths, fit, notes = _fit_legs(body, motion, transfer)
    height = body.torso.standing_height
    retargeted = make(
        body,
        name=motion.name,
        frame_rate=(len(paths.positions) - 1) / paths.seconds,
        loops=motion.loops,
        positions=paths.positions * height,
        quaternions=paths.quaternions,
        angles=fit.angles,
    )
    notes.append(f"feet miss their paths by up to {fit.misses.max():.3f} standing heights")
    return retargeted._replace(planted=paths.planted), notes


# Gestures.


def _transfer_gesture(motion: Motion, body: Body, size: Size) -> tuple[Paths, list[str]]:
    """Return the paths of a body's torso and feet in a motion without a gait; see `gait_transfer.transfer`."""
    height = body.torso.standing_height
    rest_soles, rest_height = find_rest(body)  # m
    rest_soles = rest_soles / height
    headings = _find_headings(motion)
    partners, notes = _choose_partners(motion, body, rest_soles, turns=bool(headings.any()))
    soles, planted = _plan_soles(motion, rest_soles, partners, size, headings)
    tilts = shrink_turns(rotations.turn_about_z(motion.quaternions, -headings), size.all * size.side)
    paths = Paths(
        seconds=motion.seconds * time_scale(motion.standing_height, height),
        positions=_plan_torso(motion, rest_height / height, size, headings),
        quaternions=rotations.turn_about_z(tilts, headings),
        soles=soles,
        planted=planted,
    )
    carried_paths, notes_of_torso = _carry_torso(body, paths)
    return carried_paths, notes + notes_of_torso


def _find_headings(motion: Motion) -> np.ndarray:
    """Return the headings (frames,) of a torso that turns and stays upright, rad; 0 for a motion without a turn."""
    is_upright = rotations.upright(motion.quaternions).min() > _MIN_UPRIGHT
    if not is_upright or abs(motion.displacement[2]) < _MIN_TURN:
        return np.zeros(motion.frames)
    return find_headings(motion.quaternions)


def _choose_partners(
    motion: Motion, body: Body, rest_soles: np.ndarray, turns: bool
) -> tuple[list[int | None], list[str]]:
    """Return for each foot of a body the foot of a motion that it follows, None for one that stays planted, and notes.

    Args:
        motion: motion of any body.
        body: the body that is to move.
        rest_soles: (legs, 3) its soles at rest, standing heights.
        turns: whether the motion turns.
    """
    partners = match_feet(motion.rest_soles, rest_soles)
    travel = np.linalg.norm(motion.displacement[:2]) / motion.standing_height
    flies = not motion.planted.any(axis=-1).all()
    if travel > _MIN_TRAVEL or flies or turns:  # feet cannot stay where they are
        nearest = np.linalg.norm(motion.rest_soles[None] - rest_soles[:, None], axis=-1).argmin(axis=-1)
        partners = [nearest[index] if partner is None else partner for index, partner in enumerate(partners)]
    notes = []
    alone = [leg.name for leg, partner in zip(body.legs, partners, strict=True) if partner is None]
    if alone:
        notes.append(f"without a partner, planted: {', '.join(alone)}")
    left_out = [
        name
        for index, name in enumerate(motion.leg_names)
        if index not in partners and not motion.planted[:, index].all()
    ]
    if left_out:
        notes.append(f"without a partner, left out: {', '.join(left_out)}")
    return partners, notes


def _plan_soles(
    motion: Motion, rest_soles: np.ndarray, partners: list[int | None], size: Size, headings: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the paths (frames, legs, 3) of soles that follow their partners, and whether they stand (frames, legs).

    Args:
        motion: motion of any body.
        rest_soles: (legs, 3) soles of the body that is to move, standing heights.
        partners: see `_choose_partners`.
        size: size of the paths.
        headings: (frames,) of the torso, rad.
    """
    soles = np.tile(rest_soles, (motion.frames, 1, 1))
    planted = np.ones(soles.shape[:2], bool)
    first_offsets = size.ahead_left_up * (motion.soles[0] - motion.rest_soles)
    # Feet without a partner go with those that stand in the first frame, so that the torso is over all of them.
    first_shift = first_offsets[motion.planted[0], :2].mean(axis=0) if motion.planted[0].any() else np.zeros(2)
    for index, partner in enumerate(partners):
        if partner is None:
            soles[:, index, :2] += first_shift
            continue
        planted[:, index] = motion.planted[:, partner]
        turned_frame = np.zeros((motion.frames, 3))
        turned_frame[:, 2] = _find_foot_headings(headings, motion.planted[:, partner])
        offsets = relative_points(turned_frame, motion.soles[:, partner]) - motion.rest_soles[partner]
        soles[:, index] = place_points(turned_frame, rest_soles[index] + size.ahead_left_up * offsets)
    soles[..., 2] = np.where(planted, 0.0, soles[..., 2])
    return soles, planted


def _find_foot_headings(headings: np.ndarray, planted: np.ndarray) -> np.ndarray:
    """Return the heading (frames,) of a foot, rad: that of the torso, but one alone in each stance.

    Args:
        headings: (frames,) of the torso, rad.
        planted: (frames,) when the foot stands.
    """
    if not planted.any():
        return headings
    foot_headings = headings.copy()
    for start, end in find_runs(planted).tolist():
        if start == 0:
            foot_headings[start:end] = headings[0]
        elif end == len(headings):
            foot_headings[start:end] = headings[-1]
        else:
            foot_headings[start:end] = headings[start:end].mean()
    return np.interp(np.arange(len(headings)), np.flatnonzero(planted), foot_headings[planted])


def _plan_torso(motion: Motion, rest_height: float, size: Size, headings: np.ndarray) -> np.ndarray:
    """Return positions (frames, 3) of the torso of a body with a height at rest, standing heights."""
    turned_frame = np.zeros((motion.frames, 3))
    turned_frame[:, 2] = headings
    ahead_left_up = size.ahead_left_up * relative_points(turned_frame, motion.positions)
    positions = place_points(turned_frame, ahead_left_up / motion.standing_height)
    heights = scale_heights(motion.positions[:, 2] / motion.standing_height, motion.rest_height, rest_height)
    positions[:, 2] = rest_height + size.all * (heights - rest_height)
    return positions


def _carry_torso(body: Body, paths: Paths) -> tuple[Paths, list[str]]:
    """Return the paths with the torso shifted so that its center of mass is over the feet that carry, and notes."""
    height = body.torso.standing_height
    center_in_torso = measure_standing(body).center / height
    centers = paths.positions + (rotations.matrix(paths.quaternions) @ center_in_torso[:, None])[..., 0]
    shifts = np.zeros((len(centers), 2))
    for frame, (center, soles, planted) in enumerate(zip(centers, paths.soles, paths.planted, strict=True)):
        if planted.all() or planted.sum() < 3:  # it stands, or moves too fast to stand
            continue
        shifts[frame] = _find_shift(center[:2], soles[planted, :2])
    if not shifts.any():
        return paths, []
    smooth_shifts = _spread(body, shifts, paths)
    shifted_paths = paths._replace(positions=paths.positions + np.pad(smooth_shifts, ((0, 0), (0, 1))))
    margins = [
        stability_margin(center[:2] + shift, soles[planted])
        for center, shift, soles, planted in zip(centers, smooth_shifts, paths.soles, paths.planted, strict=True)
        if planted.sum() >= 3
    ]
    largest_shift = np.linalg.norm(smooth_shifts, axis=-1).max()
    notes = [f"the torso shifts by up to {largest_shift:.2f} standing heights over the feet that carry"]
    if min(margins) < 0.0:
        notes.append(f"the center of mass is {-min(margins):.2f} standing heights beyond the feet that carry")
    return shifted_paths, notes


def _find_shift(center: np.ndarray, soles: np.ndarray) -> np.ndarray:
    """Return the least shift (2,) of a center towards the middle of the soles (n, 2) that gives it a margin."""
    if stability_margin(center, soles) >= _MIN_MARGIN:
        return np.zeros(2)
    to_middle = soles.mean(axis=0) - center
    low = 0.0
    high = 1.0
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        if stability_margin(center + middle * to_middle, soles) >= _MIN_MARGIN:
            high = middle
        else:
            low = middle
    return high * to_middle


def _spread(body: Body, shifts: np.ndarray, paths: Paths) -> np.ndarray:
    """Return shifts (frames, 2) that begin before they are needed and end after it, smoothly.

    The largest shift of the frames around each one is taken. The mean of these over as many frames is smooth.
    """
    frame_time = paths.seconds / (len(shifts) - 1)
    width = max(1, round(_SHIFT_TIME * time_unit(body) / frame_time))  # frames to either side
    padded_shifts = np.pad(shifts, ((2 * width, 2 * width), (0, 0)), mode="edge")
    windows = sliding_window_view(padded_shifts, 2 * width + 1, axis=0)  # (n, 2, frames of a window)
    largest_of_window = np.linalg.norm(windows, axis=1).argmax(axis=-1)
    largest_shifts = np.take_along_axis(windows, largest_of_window[:, None, None], axis=-1)[..., 0]
    return sliding_window_view(largest_shifts, 2 * width + 1, axis=0).mean(axis=-1)


# Legs.


def _fit_legs(body: Body, motion: Motion, transfer: Callable) -> tuple[Paths, _Fit, list[str]]:
    """Return paths that legs reach, joint angles, and notes; the torso's height and the size of steps change if needed.

    Args:
        body: the body that is to move.
        motion: motion of any body.
        transfer: makes the paths, of a size; see `gait_transfer.transfer`.

    Raises:
        ValueError: legs do not reach the paths, or do not close the loop.
    """
    least_excess = math.inf
    worst_miss = ""
    max_misses = np.where(_has_few_joints(body), MAX_SLIDE, MAX_MISS)
    for size in _SIZES:
        paths, notes = transfer(motion, body, size)
        few_frames = np.unique(np.linspace(0, len(paths.positions) - 1, _SEARCH_FRAMES).astype(int))
        for rise in _RISES:
            shifted_paths = paths._replace(positions=paths.positions + (0.0, 0.0, rise))
            fit = _Search.along(body, shifted_paths.select(few_frames)).solve_frames()
            if (fit.misses <= max_misses).all():
                fit = _Search.along(body, shifted_paths).follow_frames(motion.loops)
            excesses = (fit.misses - max_misses).max(axis=0)
            is_open = motion.loops and abs(fit.angles[-1] - fit.angles[0]).max() > MAX_SEAM
            if (excesses <= 0.0).all() and not is_open:
                return shifted_paths, fit, notes + _describe_changes(size, rise)
            if excesses.max() < least_excess:
                least_excess = excesses.max()
                leg = int(excesses.argmax())
                worst_miss = f"{body.legs[leg].name} misses its path by {fit.misses[:, leg].max():.2f} standing heights"
                if least_excess <= 0.0:
                    worst_miss = "its joints do not come back at the end of the loop"
    raise ValueError(f"motion {motion.name!r} of {motion.body}: {body.name} cannot follow it, {worst_miss}")


def _describe_changes(size: Size, rise: float) -> list[str]:
    """Return a line for each thing that is changed so that legs reach; see `_SIZES` and `_RISES`."""
    lines = []
    if rise:
        direction = "higher" if rise > 0.0 else "lower"
        lines.append(f"the torso is {direction} by {abs(rise):g} standing heights, so that legs reach")
    if size.all < 1.0:
        lines.append(f"steps and gestures are {size.all:g} of their size, so that legs reach")
    if size.side < 1.0:
        lines.append("legs do not move sideways, and the torso does not tilt, so that legs reach")
    return lines


def _has_few_joints(body: Body) -> np.ndarray:
    """Return for each leg (legs,) whether it has fewer than three joints."""
    return np.array([len(leg.joints) for leg in body.legs]) < 3


class _Search(NamedTuple):
    """A search for the joint angles that bring feet nearest to their paths.

    Attributes:
        legs: legs of the body, to the centers of feet.
        goals: (frames, legs, 3) goals of these in the torso's frame, m.
        rest_angles: (legs, links) rad.
        weights: (legs, 3, 3) matrices that multiply the errors of feet.
        standing_height: m.
    """

    legs: Legs
    goals: np.ndarray
    rest_angles: np.ndarray
    weights: np.ndarray
    standing_height: float

    @classmethod
    def along(cls, body: Body, paths: Paths) -> Self:
        """Return the search for the legs of a body along paths."""
        height = body.torso.standing_height
        legs = Legs.of(body, used=1.0)
        goals = paths.soles * height + legs.radii[:, None] * _VERTICAL - paths.positions[:, None] * height
        to_torso = rotations.matrix(paths.quaternions).swapaxes(-1, -2)[:, None]
        return cls(
            legs=legs.to_foot_centers(),
            goals=(to_torso @ goals[..., None])[..., 0],
            rest_angles=find_rest_pose(body).joint_angles,
            weights=np.where(_has_few_joints(body)[:, None, None], _SLIDING_FOOT_WEIGHTS, _FOOT_WEIGHTS),
            standing_height=height,
        )

    def solve_frames(self) -> _Fit:
        """Return the fit of frames that do not follow each other: the search in a frame starts from the rest pose."""
        start_angles = np.broadcast_to(self.rest_angles, (len(self.goals), *self.rest_angles.shape))
        return self._measure_fit(self._solve(start_angles, self.goals, _ITERATIONS))

    def follow_frames(self, loops: bool) -> _Fit:
        """Return the fit of all frames: the search in a frame starts from the frame before, so that legs do not jump.

        Args:
            loops: whether the last frame is the first one.
        """
        angles = np.empty((len(self.goals), *self.rest_angles.shape))
        frame_angles = self._solve(self.rest_angles, self.goals[0], _ITERATIONS)
        for _ in range(2 if loops else 1):  # of a loop, the second round begins as the first one ends
            for frame, frame_goals in enumerate(self.goals):
                frame_angles = self._solve(frame_angles, frame_goals, _ITERATIONS_OF_NEXT_FRAME)
                frame_angles = self.legs.relax_redundant_joints(
                    frame_angles, self.rest_angles, RELAXING_SHARE, self._damping
                )
                angles[frame] = frame_angles
        return self._measure_fit(angles)

    @property
    def _damping(self) -> float:
        """Damping of inverse kinematics, m."""
        return _DAMPING * self.standing_height

    def _solve(self, angles: np.ndarray, goals: np.ndarray, iterations: int) -> np.ndarray:
        """Return the angles (..., legs, links), rad, that bring feet near goals (..., legs, 3) from others."""
        return self.legs.solve_joint_angles(angles, goals, self.weights, self._damping, iterations)

    def _measure_fit(self, angles: np.ndarray) -> _Fit:
        """Return angles (frames, legs, links), rad, by joint, with how far feet miss their goals."""
        feet = self.legs.foot_centers(angles)
        return _Fit(self.legs.by_joint(angles), np.linalg.norm(feet - self.goals, axis=-1) / self.standing_height)
