"""Bounds that every clip keeps to, in a table. A clip that breaks one is left out, with the line that says which."""

from typing import NamedTuple

import numpy as np

from arc_suite.animation.clips.catalog import Acted, BlowClip, Difference, Kind, Turn
from arc_suite.animation.clips.on_ground import MAX_SLIDE, measure_ground, measure_slide
from arc_suite.animation.clips.root_motion import ClipMotion
from arc_suite.animation.clips.standing_legs import has_free_feet
from arc_suite.robots.spec import Body

_CHECKED_TIME_STEP = 1.0 / 240.0  # s between the samples that are checked

# A body of which torso and joints are slower stands still.
_STILL_SPEED = 0.02  # standing heights a second
_STILL_TURNING_SPEED = 5.0  # degrees/s, of torso and joints


class Measures(NamedTuple):
    """What a motion does over all its samples; lengths in standing heights.

    Attributes:
        part_depth: how deep torso or links are in the ground, as they are drawn; negative above it.
        sole_depth: how deep feet are in the ground.
        slide: largest diagonal of the way of a foot in one stance.
        last_speed: speed of the fastest joint at the end, degrees/s.
        seconds: duration, s.
        still_seconds: longest time in which the body stands still, s.
    """

    part_depth: float
    sole_depth: float
    slide: float
    last_speed: float
    seconds: float
    still_seconds: float


class Bound(NamedTuple):
    """A bound of a measure.

    Attributes:
        measure: name of `Measures`.
        limit: largest value.
        excess: what is wrong with a clip beyond it, with the value and the limit.
    """

    measure: str
    limit: float
    excess: str


PART_DEPTH = Bound(
    "part_depth", 0.01, "torso or legs are {value:.3f} standing heights in the ground, more than {limit}"
)
SOLE_DEPTH = Bound("sole_depth", 0.03, "a sole is {value:.3f} standing heights in the ground, more than {limit}")
SLIDE = Bound("slide", MAX_SLIDE, "a standing foot slides by {value:.3f} standing heights, more than {limit}")
LAST_SPEED = Bound("last_speed", 2.0, "a joint turns at {value:.1f} degrees/s in the end, more than {limit}")
SECONDS_OF_TURN = Bound("seconds", 2.0, "it lasts {value:.1f} s, more than {limit}")
STILL_SECONDS = Bound("still_seconds", 0.9, "nothing moves for {value:.2f} s, more than {limit}")


def bounds_of(body: Body, clip: Kind) -> tuple[Bound, ...]:
    """Return the bounds of a clip of a body."""
    if isinstance(clip, Difference):
        return ()  # is no motion of its own; the metadata say over which clips it keeps to the bounds
    bounds = [PART_DEPTH, SOLE_DEPTH]
    if feet_stand(clip) and has_free_feet(body):
        bounds.append(SLIDE)
    if isinstance(clip, Acted) and not clip.loops and -1 not in clip.ends:
        bounds.append(LAST_SPEED)
    if isinstance(clip, Turn):
        bounds.append(SECONDS_OF_TURN)
    if is_simulated(clip):
        bounds.append(STILL_SECONDS)
    return tuple(bounds)


def feet_stand(clip: Kind) -> bool:
    """Return whether standing feet are to stay in place in a clip, between their steps if it has any."""
    match clip:
        case Acted():
            return clip.planted or clip.steps
        case BlowClip():
            return clip.cycles == 0
        case _:
            return isinstance(clip, Turn)


def is_simulated(clip: Kind) -> bool:
    """Return whether a clip is a recording of an action, which ends when the body has come to rest."""
    match clip:
        case Acted():
            return not clip.planted
        case _:
            return isinstance(clip, BlowClip)


def find_excess(body: Body, clip: Kind, motion: ClipMotion) -> str:
    """Return what is wrong with a motion of a clip by the first bound that it breaks; "" if it keeps to all of them."""
    measures = measure(body, motion)
    for bound in bounds_of(body, clip):
        value = getattr(measures, bound.measure)
        if value > bound.limit:
            return bound.excess.format(value=value, limit=bound.limit)
    return ""


def measure(body: Body, motion: ClipMotion) -> Measures:
    """Return the measures of a motion."""
    last_changes = motion.joints[-1] - motion.joints[-2]
    seconds = motion.seconds
    last_speed = abs(np.degrees(last_changes)).max() / motion.time_step
    motion = _thin_out(motion)
    height = body.torso.standing_height
    ground = measure_ground(body, motion)
    return Measures(
        part_depth=float(-ground.lowest_part.min() / height),
        sole_depth=float(-ground.soles.min() / height),
        slide=float(measure_slide(body, ground) / height),
        last_speed=float(last_speed),
        seconds=seconds,
        still_seconds=_measure_stillness(motion, height),
    )


def _measure_stillness(motion: ClipMotion, standing_height: float) -> float:
    """Return the longest time, s, in which neither torso nor joints move."""
    poses = motion.poses()
    changes = abs(np.diff(poses, axis=0)) / motion.time_step
    changes[:, :3] /= _STILL_SPEED * standing_height
    changes[:, 3:7] *= 2.0  # of a quaternion, to angles
    changes[:, 3:] /= np.radians(_STILL_TURNING_SPEED)
    moving = np.flatnonzero(changes.max(axis=-1) > 1.0)
    gaps = np.diff([-1, *moving, len(changes)]) - 1
    return float(gaps.max() * motion.time_step)


def _thin_out(motion: ClipMotion) -> ClipMotion:
    """Return the motion with fewer samples, both ends among them."""
    intervals = max(1, round(motion.seconds / max(_CHECKED_TIME_STEP, motion.time_step)))
    return motion.sample_at(np.linspace(0.0, motion.seconds, intervals + 1))
