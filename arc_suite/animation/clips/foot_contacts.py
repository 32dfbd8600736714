"""Foot contact events of a motion, from the heights of the feet, as the contacts of the simulation chatter."""

import itertools
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite.animation.clips.root_motion import ClipMotion
from arc_suite.models.standing import standing_qpos
from arc_suite.motions.runs import find_runs
from arc_suite.robots.spec import Body
from arc_suite.simulation.model import compile_model
from arc_suite.tasks import readings

TOUCH_DOWN = "touch_down"
LIFT_OFF = "lift_off"
MIN_RISE = 0.005  # standing heights: a foot that rises less never leaves the ground
MIN_RISE_IN_GESTURE = 0.05  # standing heights: a foot that rises less in a gesture does not step

# Heights between which a foot swings, as shares of the range of its height: it rises above the upper one, and the
# swing lasts while the foot is above the lower one.
_SWING_UPPER = 0.5
_SWING_LOWER = 0.2
_BOUNCE = 0.1  # gait cycles: a foot that touches for less in a swing bounces
_TOUCHING_HEIGHT = 0.005  # standing heights: a sole that is lower touches


class FootContact(NamedTuple):
    """A touchdown or liftoff of one foot.

    Attributes:
        foot: name of its body.
        event: `TOUCH_DOWN` or `LIFT_OFF`.
        sample: sample of the motion.
        time: s from its start.
    """

    foot: str
    event: str
    sample: int
    time: float


def sole_heights(body: Body, poses: np.ndarray) -> np.ndarray:
    """Return the heights (samples, feet), m, of the feet's lowest points over a level floor.

    Args:
        body: any body.
        poses: (samples, 7 + joints) in the world.
    """
    model = compile_model(body)
    data = mujoco.MjData(model)
    foot_ids = [model.body(name).id for name in body.foot_names]
    foot_radii = [leg.foot.radius for leg in body.legs]
    positions = readings.positions(poses, readings.layout(model, body), standing_qpos(model))
    center_heights = np.empty((len(poses), len(foot_ids)))
    for sample, qpos in enumerate(positions):
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        center_heights[sample] = data.xpos[foot_ids, 2]
    return center_heights - foot_radii


def find_swings(heights: np.ndarray, min_rise: float, bounce: float, loops: bool) -> np.ndarray:
    """Return when a foot swings, (samples,) booleans.

    Args:
        heights: (samples,) heights of its lowest point, m; of a loop without the last sample, which is the first one.
        min_rise: m; a foot that rises less does not swing.
        bounce: samples; a shorter contact does not end a swing.
        loops: whether the first sample follows the last.
    """
    lowest = heights.min()
    rise = np.ptp(heights)
    if rise < min_rise:
        return np.zeros(len(heights), bool)
    is_up = heights > lowest + _SWING_LOWER * rise
    is_high = heights > lowest + _SWING_UPPER * rise
    begin = 0
    if loops:
        begin = int(is_up.argmin())  # a sample in stance, so that no swing is cut in two
    is_up = np.roll(is_up, -begin)
    is_high = np.roll(is_high, -begin)

    for (_, end), (next_start, _) in itertools.pairwise(find_runs(is_up)):
        if next_start - end < bounce:
            is_up[end:next_start] = True
    for start, end in find_runs(is_up):
        is_up[start:end] = is_high[start:end].any()
    return np.roll(is_up, begin)


def find_touching(heights: np.ndarray, swings: np.ndarray, near: float, loops: bool) -> np.ndarray:
    """Return when a foot touches the ground, (samples,) booleans: while it is near, once in each stance.

    A foot that stays higher throughout a stance touches where it is near its lowest point. One that still sinks at the
    end of the samples, or already rises at the start, does not touch there.

    Args:
        heights: (samples,) heights of its lowest point, m; of a loop without the last sample, which is the first one.
        swings: (samples,) when it swings.
        near: m.
        loops: whether the first sample follows the last.
    """
    begin = 0
    if loops:
        begin = int(swings.argmax())  # a sample in swing, so that no stance is cut in two
    heights = np.roll(heights, -begin)
    swings = np.roll(swings, -begin)
    touches = np.zeros(len(swings), bool)
    for start, end in find_runs(~swings):
        lowest = start + int(heights[start:end].argmin())
        max_height = near
        if heights[lowest] > near:
            if not loops and lowest in (0, len(swings) - 1):
                continue
            max_height = heights[lowest] + near
        low_samples = start + np.flatnonzero(heights[start:end] <= max_height)
        touches[low_samples[0] : low_samples[-1] + 1] = True
    return np.roll(touches, begin)


def count_odd_feet(heights: np.ndarray, cycles: int, standing_height: float) -> int:
    """Return how many feet of a loop do not touch down once in each gait cycle.

    Args:
        heights: (samples, feet) heights of the soles, m, without the last sample, which is the first one.
        cycles: gait cycles in the loop.
        standing_height: m.
    """
    bounce = _BOUNCE * len(heights) / cycles  # samples
    odd_feet = 0
    for foot_heights in heights.T:
        swings = find_swings(foot_heights, MIN_RISE * standing_height, bounce, loops=True)
        touchdowns = ~swings & np.roll(swings, 1)
        odd_feet += touchdowns.sum() != cycles
    return odd_feet


def find_foot_contacts(
    motion: ClipMotion, body: Body, heights: np.ndarray, cycle: float, loops: bool, min_rise: float = MIN_RISE
) -> tuple[list[FootContact], np.ndarray]:
    """Return the foot contact events of a motion in the order of time, and the feet in stance, (samples, feet).

    Args:
        motion: motion of the body.
        body: its spec.
        heights: (samples, feet) heights of the soles, m.
        cycle: cycle of the gait, s.
        loops: whether the motion is a loop; its last sample is its first one then, and has no events.
        min_rise: standing heights; a foot that rises less stays on the ground.
    """
    standing_height = body.torso.standing_height
    sample_count = len(heights) - 1 if loops else len(heights)
    bounce = _BOUNCE * cycle / motion.time_step  # samples
    contacts = []
    swings = np.zeros(heights.shape, bool)

    for leg, foot in enumerate(body.foot_names):
        foot_heights = heights[:sample_count, leg]
        foot_swings = find_swings(foot_heights, min_rise * standing_height, bounce, loops)
        touches = find_touching(foot_heights, foot_swings, _TOUCHING_HEIGHT * standing_height, loops)
        touched_before = np.roll(touches, 1)
        if not loops:
            touched_before[0] = touches[0]
        lifts_off = ~touches & touched_before
        touches_down = touches & ~touched_before
        for event, is_event in ((LIFT_OFF, lifts_off), (TOUCH_DOWN, touches_down)):
            for sample in np.flatnonzero(is_event).tolist():
                contacts.append(FootContact(foot, event, sample, time=sample * motion.time_step))
        swings[:sample_count, leg] = foot_swings
    swings[sample_count:] = swings[:1]
    contacts.sort(key=lambda contact: (contact.sample, contact.foot, contact.event))
    return contacts, ~swings
