"""Foot contact events of a motion, from the heights of the feet, as the contacts of the simulation chatter."""

from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite.animation.clips.root_motion import Motion
from arc_suite.models.standing import stood
from arc_suite.robots.spec import Body
from arc_suite.tasks import readings

TOUCH_DOWN, LIFT_OFF = "touch_down", "lift_off"

# Shares of the range of a foot's height: a swing rises above the upper one, and lasts while the foot is above the
# lower one.
_RISES, _LASTS = 0.5, 0.2
_BOUNCE = 0.1  # cycles: a foot that touches for less in a swing bounces
MIN_RISE = 0.005  # of the standing height: a foot that rises less never leaves the ground
_NEAR = 0.005  # of the standing height: a sole that is lower touches


class FootContact(NamedTuple):
    """A touchdown or liftoff of one foot.

    Attributes:
        foot: name of its body.
        event: `TOUCH_DOWN` or `LIFT_OFF`.
        sample: of the motion.
        time: s from its start.
    """

    foot: str
    event: str
    sample: int
    time: float


def sole_heights(model: mujoco.MjModel, body: Body, poses: np.ndarray) -> np.ndarray:
    """Return the heights (samples, feet), m, of the feet's lowest points over a level floor.

    Args:
        model: of the body.
        body: its spec.
        poses: (samples, 7 + joints)
    """
    data = mujoco.MjData(model)
    feet = [model.body(name).id for name in body.foot_names]
    layout = readings.layout(model, body)
    positions = readings.positions(poses, layout, stood(model))
    heights = np.empty((len(poses), len(feet)))
    for qpos, row in zip(positions, heights, strict=True):
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        row[:] = data.xpos[feet, 2]
    return heights - [leg.foot.radius for leg in body.legs]


def find_swings(heights: np.ndarray, least: float, bounce: float, loops: bool) -> np.ndarray:
    """Return when a foot swings, (samples,) booleans.

    Args:
        heights: (samples,) of its lowest point, m; of a loop without the last sample, which is the first one.
        least: m; a foot that rises less does not swing.
        bounce: samples; a shorter contact does not end a swing.
        loops: whether the first sample follows the last.
    """
    low, lift = heights.min(), np.ptp(heights)
    if lift < least:
        return np.zeros(len(heights), bool)
    up, high = (heights > low + share * lift for share in (_LASTS, _RISES))
    begin = int(up.argmin()) if loops else 0  # in stance, so that no swing is cut in two
    up, high = np.roll(up, -begin), np.roll(high, -begin)
    starts, ends = _runs(up)
    for end, start in zip(ends[:-1], starts[1:], strict=True):
        up[end:start] |= start - end < bounce
    for start, end in zip(*_runs(up), strict=True):
        up[start:end] = high[start:end].any()
    return np.roll(up, begin)


def find_touching(heights: np.ndarray, up: np.ndarray, near: float, loops: bool) -> np.ndarray:
    """Return when a foot touches the ground, (samples,) booleans: while it is near, once in each stance.

    Args:
        heights: (samples,) of its lowest point, m; of a loop without the last sample, which is the first one.
        up: (samples,) when it swings.
        near: m; a foot that stays higher throughout a stance touches where it is within this of its lowest point. One
            that still sinks at the end of the samples, or already rises at the start, does not touch there.
        loops: whether the first sample follows the last.
    """
    begin = int(up.argmax()) if loops else 0  # in swing, so that no stance is cut in two
    heights, up = np.roll(heights, -begin), np.roll(up, -begin)
    down = np.zeros(len(up), bool)
    for start, end in zip(*_runs(~up), strict=True):
        lowest = start + int(heights[start:end].argmin())
        if heights[lowest] > near and not loops and lowest in (0, len(up) - 1):
            continue
        bound = near if heights[lowest] <= near else heights[lowest] + near
        low = start + np.flatnonzero(heights[start:end] <= bound)
        down[low[0] : low[-1] + 1] = True
    return np.roll(down, begin)


def _runs(mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return where runs of true values start, and where they have ended."""
    edges = np.diff(mask.astype(int), prepend=0, append=0)
    return np.flatnonzero(edges > 0), np.flatnonzero(edges < 0)


def find_foot_contacts(
    motion: Motion, body: Body, heights: np.ndarray, cycle: float, loops: bool, least: float = MIN_RISE
) -> tuple[list[FootContact], np.ndarray]:
    """Return the foot contact events of a motion in the order of time, and the feet in stance, (samples, feet).

    Args:
        motion: of the body.
        body: its spec.
        heights: (samples, feet) of the soles, m.
        cycle: of the gait, s.
        loops: whether the motion is a loop; its last sample is its first one then, and has no events.
        least: standing heights; a foot that rises less stays on the ground.
    """
    height, end = body.torso.standing_height, len(heights) - 1 if loops else len(heights)
    found, swing = [], np.zeros(heights.shape, bool)

    for leg, foot in enumerate(body.foot_names):
        up = find_swings(heights[:end, leg], least * height, _BOUNCE * cycle / motion.time_step, loops)
        down = find_touching(heights[:end, leg], up, _NEAR * height, loops)
        before = np.roll(down, 1) if loops else np.concatenate([down[:1], down[:-1]])
        for event, at in ((LIFT_OFF, ~down & before), (TOUCH_DOWN, down & ~before)):
            samples = np.flatnonzero(at).tolist()
            found += [FootContact(foot, event, sample, sample * motion.time_step) for sample in samples]
        swing[:end, leg] = up
    swing[end:] = swing[:1]
    return sorted(found, key=lambda contact: (contact.sample, contact.foot, contact.event)), ~swing
