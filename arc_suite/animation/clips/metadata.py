"""Metadata of clips, JSON-able: speeds, foot contact events, and where clips stand in blend spaces."""

import collections
from collections.abc import Sequence
from typing import Any

from arc_suite.animation.clips.catalog import WalkLoop, clip_of
from arc_suite.animation.clips.clips import Clip
from arc_suite.animation.clips.foot_contacts import TOUCH_DOWN
from arc_suite.robots.spec import Body

ROOT_MOTIONS = {"both": (True, False), "moving": (True,), "in_place": (False,)}

# Blend spaces by name: the metadata along both axes, and which component of their clips' commands is 0.
_SPACES = {"turning": (("turn_rate", "forward_speed"), 1), "strafing": (("left_speed", "forward_speed"), 2)}


def sidecar(body: Body, clips: Sequence[Clip], root_motion: str = "both") -> dict[str, Any]:
    """Return the metadata of clips by name of the animation, and their blend spaces.

    Args:
        body: of the clips.
        clips: of one file.
        root_motion: that of the file; see `creatures.glb`.
    """
    moving = ROOT_MOTIONS[root_motion]
    return {
        "body": body.name,
        "units": {"length": "m", "time": "s", "angle": "rad"},
        "axes": {"up": "y", "forward": "z", "left": "x"},
        "clips": {name: clip_metadata(clip) for clip in clips for name in name_animations(clip, moving)},
        "blend": _spaces(clips, moving),
    }


def clip_metadata(clip: Clip) -> dict[str, Any]:
    """Return the metadata of a clip.

    `missing_steps` has the feet of a loop that touch down less often than once a cycle, and how many times less.
    `slip` is the path of a sole near the ground, m a meter of the root. `additive_to` is the animation whose first
    frame is the reference of an additive clip, and `additive_over` names the clips that it can be added to: no sole
    then sinks deeper than 0.03 standing heights.
    """
    found: dict[str, Any] = {"seconds": clip.motion.seconds, "frames": len(clip.times)}
    found |= {"loops": clip.loops, "cycles": clip.cycles}
    speeds = zip(("forward_speed", "left_speed", "turn_rate"), clip.motion.twist.tolist(), strict=True)
    found |= {name: round(speed, 6) for name, speed in speeds}
    contacts = ({"foot": each.foot, "event": each.event, "time": round(each.time, 6)} for each in clip.foot_contacts)
    found["foot_contacts"] = list(contacts)
    if clip.slip is not None:
        found["slip"] = round(clip.slip, 3)
    if clip.additive_over is not None:
        return found | {"additive_to": "idle_loop", "additive_over": list(clip.additive_over)}
    return found | ({"missing_steps": missing_steps(clip)} if clip.loops else {})


def missing_steps(clip: Clip) -> dict[str, int]:
    """Return the feet of a loop that touch down less often than once a cycle, and how many times less."""
    downs = collections.Counter(contact.foot for contact in clip.foot_contacts if contact.event == TOUCH_DOWN)
    return {foot: clip.cycles - downs[foot] for foot in clip.feet if downs[foot] < clip.cycles}


def name_animations(clip: Clip, moving: Sequence[bool]) -> dict[str, bool]:
    """Return the names of a clip's animations, and whether the root moves in them."""
    end = "_loop" if clip.loops else ""
    if not clip.moves:
        return {f"{clip.name}{end}": False}
    return {f"{clip.name}{'' if moves else '_in_place'}{end}": moves for moves in moving}


def _spaces(clips: Sequence[Clip], moving: Sequence[bool]) -> dict[str, Any]:
    """Return the points of blend spaces: an animation for each place in the plane of two speeds."""
    found = {}
    for name, (axes, zero) in _SPACES.items():
        points = []
        for clip in clips:
            spec = clip_of(clip.name)
            walks = isinstance(spec, WalkLoop) and spec.failing is None and spec.command[zero] == 0.0
            if walks or clip.name == "idle":
                figures = clip_metadata(clip)
                animation = next(iter(name_animations(clip, moving)))
                points.append({"animation": animation, "at": [figures[axis] for axis in axes]})
        found[name] = {"axes": list(axes), "points": points}
    return found
