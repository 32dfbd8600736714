"""What a torso does before and after an action: it moves back and down before it, and swings past and settles after it.

An anticipation ends where the action begins, and a follow-through begins where it ends. Both are 0 at the ends of a
clip. Poses are offsets of the torso, see `posture`; lengths are in standing heights h.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from arc_suite.animation.clips import on_ground
from arc_suite.animation.clips.catalog import Passage
from arc_suite.animation.clips.draft import Draft
from arc_suite.animation.clips.foot_contacts import TOUCH_DOWN
from arc_suite.animation.clips.root_motion import fade_out
from arc_suite.models import posture
from arc_suite.models.standing import time_unit
from arc_suite.robots.spec import Body


class _Transient(NamedTuple):
    """Offsets of the torso: the largest before an action, and those of a swing after it that is not damped.

    Attributes:
        before: by numbers of the pose.
        after: by numbers of the pose.
    """

    before: dict[str, float]
    after: dict[str, float]


_JUMP = _Transient(before={}, after={"height": -0.08})  # the simulation crouches before it
_ATTACK = _Transient(
    before={"forward": -0.03, "height": -0.02, "pitch": -0.04}, after={"forward": 0.02, "height": -0.02, "pitch": 0.02}
)
_START = _Transient(before={"forward": -0.04, "height": -0.03, "pitch": -0.04}, after={})
_STOP = _Transient(before={}, after={"forward": 0.06, "height": -0.04, "pitch": 0.01})

_ANTICIPATION_CYCLES = 0.6  # gait cycles of a start, in which the body still hardly moves
_HALT_SHARE = 0.3  # of the largest speed: a slower body has stopped
_SETTLING_SHARE = 0.4  # of the time after an action, in which what is left of the swing fades


def make_action_offsets(body: Body, name: str, draft: Draft, frequency: float, damping: float) -> np.ndarray | None:
    """Return offsets (samples, 6) of the torso in an action; None for a clip without one.

    Args:
        body: the spec.
        name: name of the clip.
        draft: draft of the clip.
        frequency: frequency of the spring, rad / sqrt(h / g).
        damping: its damping ratio.
    """
    if name not in _ACTIONS:
        return None
    action = _ACTIONS[name]
    span = action.find(body, draft)
    if span is None:
        return None
    return _make_poses(body, draft, action.transient, *span, frequency, damping)


def make_passage_offsets(body: Body, clip: Passage, draft: Draft, frequency: float, damping: float) -> np.ndarray:
    """Return offsets (samples, 6) of the torso before a start or after a stop; see `make_action_offsets`."""
    samples = len(draft.motion.joints)
    if clip.starts:
        begin = round(_ANTICIPATION_CYCLES * draft.cycle_samples)
        return _make_poses(body, draft, _START, begin, samples - 1, frequency, damping)
    speeds = np.linalg.norm(np.diff(draft.motion.root[:, :2], axis=0), axis=-1)
    halt = int(np.flatnonzero(speeds > _HALT_SHARE * speeds.max()).max(initial=0))
    return _make_poses(body, draft, _STOP, 0, halt, frequency, damping)


def _make_poses(body, draft: Draft, transient: _Transient, begin: int, end: int, frequency, damping) -> np.ndarray:
    """Return offsets (samples, 6) around an action between two samples."""
    samples = len(draft.motion.joints)
    poses = np.zeros((samples, 6))
    anticipation = np.zeros(samples)
    anticipation[:begin] = np.sin(np.pi * np.arange(begin) / max(begin, 1)) ** 2
    times = np.arange(samples - end) * draft.motion.time_step / time_unit(body)
    swing = np.zeros(samples)
    swing[end:] = np.exp(-damping * frequency * times) * np.sin(np.sqrt(1.0 - damping**2) * frequency * times)
    swing[end:] *= 1.0 - fade_out(np.linspace(1.0, 0.0, samples - end) / _SETTLING_SHARE)
    for name, size in transient.before.items():
        poses[:, posture.POSE_NAMES.index(name)] += size * anticipation
    for name, size in transient.after.items():
        poses[:, posture.POSE_NAMES.index(name)] += size * swing
    return poses


def _find_flight(body: Body, draft: Draft) -> tuple[int, int] | None:
    """Return the first and the last sample of a flight; None without one."""
    in_air = on_ground.find_flight(body, draft.motion)
    return (int(in_air[0]), int(in_air[-1])) if len(in_air) else None


def _find_strike(body: Body, draft: Draft) -> tuple[int, int] | None:
    """Return the sample in the middle of a strike, and that of its first touchdown; None without one."""
    _, contacts = draft.stance_height_and_contacts(body)
    touchdowns = [contact.sample for contact in contacts if contact.event == TOUCH_DOWN]
    if not touchdowns:
        return None
    return touchdowns[0] * 3 // 4, touchdowns[0]


class _Action(NamedTuple):
    """A clip of an action.

    Attributes:
        transient: what the torso does around it.
        find: returns the samples between which it is; None for a draft without it.
    """

    transient: _Transient
    find: Callable[[Body, Draft], tuple[int, int] | None]


_ACTIONS = {
    "jump": _Action(_JUMP, _find_flight),
    "leap": _Action(_JUMP, _find_flight),
    "attack": _Action(_ATTACK, _find_strike),
}
