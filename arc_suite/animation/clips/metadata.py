"""Metadata of clips, JSON-able: speeds, foot contact events, and where clips stand in blend spaces."""

import collections
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from arc_suite.animation.clips.catalog import WalkLoop, clip_names, clip_of
from arc_suite.animation.clips.clips import Clip
from arc_suite.animation.clips.foot_contacts import LIFT_OFF, TOUCH_DOWN
from arc_suite.animation.parts import describe_body
from arc_suite.models import swinging
from arc_suite.models.swinging import Swing
from arc_suite.robots.spec import Body

# By the name that users choose: whether the root moves, for each animation of a clip.
ROOT_MOTIONS = {"both": (True, False), "moving": (True,), "in_place": (False,)}


class _BlendSpace(NamedTuple):
    """A plane of two speeds, in which engines blend clips.

    Attributes:
        axes: names of the speeds in the metadata of clips.
        side_component: index of the component of a clip's command along the first axis.
        zero_component: index of the component that is 0 in this plane.
    """

    axes: tuple[str, str]
    side_component: int
    zero_component: int


_BLEND_SPACES = {
    "turning": _BlendSpace(axes=("turn_rate", "forward_speed"), side_component=2, zero_component=1),
    "strafing": _BlendSpace(axes=("left_speed", "forward_speed"), side_component=1, zero_component=2),
}


def sidecar(
    body: Body,
    clips: Sequence[Clip],
    root_motion: str = "both",
    options: Mapping[str, Any] | None = None,
    left_out: Mapping[str, str] | None = None,
) -> dict[str, Any]:
    """Return the metadata of clips by name of the animation, their blend spaces, and their bones.

    Args:
        body: body of the clips.
        clips: clips of one file.
        root_motion: value for the file; see `creatures.glb`.
        options: options by which the clips were made.
        left_out: reasons why clips cannot be made, by name.
    """
    roots_move = ROOT_MOTIONS[root_motion]
    metadata_of_animation = {}
    for clip in clips:
        for animation, root_moves in name_animations(clip, roots_move).items():
            metadata_of_animation[animation] = clip_metadata(clip, root_moves)
    return {
        "body": body.name,
        "units": {"length": "m", "time": "s", "angle": "rad"},
        "axes": {"up": "y", "forward": "z", "left": "x"},
        "bones": _parent_of_bone(body),
        "swinging_bones": {bone.name: _spring_metadata(bone.swing) for bone in swinging.list_bones(body)},
        "clips": metadata_of_animation,
        "blend": _make_blend_spaces(clips, roots_move),
        "options": dict(options or {}),
        "left_out": dict(left_out or {}),
    }


def _parent_of_bone(body: Body) -> dict[str, str | None]:
    """Return the bone above each bone by name, from the root outwards; None for the root."""
    parts, _ = describe_body(body)
    parents: dict[str, str | None] = {"root": None}
    for part in parts:
        parents[part.name] = "root" if part.parent is None else parts[part.parent].name
    return parents


def _spring_metadata(swing: Swing) -> dict[str, float]:
    """Return the spring of a bone, for engines that simulate it: frequency, Hz, damping ratio, and limit, rad."""
    frequency = swing.frequency / (2.0 * math.pi)
    return {"frequency": round(frequency, 4), "damping": swing.damping, "limit": round(swing.limit, 4)}


def clip_metadata(clip: Clip, root_moves: bool) -> dict[str, Any]:
    """Return the metadata of an animation of a clip, whose root moves or stays.

    `frames` counts the first and the last frame, and `fps` is the rate between them.
    `duty_factor` is the share of a loop in which feet touch the ground.
    `missing_steps` has the feet of a loop that touch down less often than once a cycle, and how many times less.
    `extra_steps` has those that touch down more often, and how many times more.
    `slip` is the path of a foot in stance over the ground, m a meter of the root. `slide` is the largest diagonal of
    the way of a standing foot, m, in a clip in which feet are to stand still. `weight` is the share of the weight that
    legs allow. `additive_to` is the animation whose first frame is the reference of an additive clip. `additive_over`
    names the clips that it can be added to: no sole then sinks deeper than 0.03 standing heights.
    """
    forward_speed, left_speed, turn_rate = clip.motion.twist.tolist()  # m/s, m/s, rad/s
    contacts = []
    for contact in clip.foot_contacts:
        contacts.append({"foot": contact.foot, "event": contact.event, "time": round(contact.time, 6)})
    metadata: dict[str, Any] = {
        "seconds": clip.motion.seconds,
        "frames": len(clip.times),
        "fps": round(1.0 / clip.motion.time_step, 6),
        "loops": clip.loops,
        "cycles": clip.cycles,
        "root_moves": root_moves,
        "forward_speed": round(forward_speed, 6),
        "left_speed": round(left_speed, 6),
        "turn_rate": round(turn_rate, 6),
        "foot_contacts": contacts,
    }
    if clip.slip is not None:
        metadata["slip"] = round(clip.slip, 3)
    if clip.weight is not None:
        metadata["weight"] = clip.weight
    if clip.slide is not None:
        metadata["slide"] = round(clip.slide, 4)
    is_additive = clip.additive_over is not None
    if is_additive:
        metadata["additive_to"] = "idle_loop"
        metadata["additive_over"] = list(clip.additive_over)
    elif clip.loops:
        metadata["missing_steps"] = missing_steps(clip)
        metadata["extra_steps"] = extra_steps(clip)
        if clip.cycles:
            metadata["duty_factor"] = round(measure_duty_factor(clip), 3)
    return metadata


def missing_steps(clip: Clip) -> dict[str, int]:
    """Return the feet of a loop that touch down less often than once a cycle, and how many times less."""
    touchdowns = _count_touchdowns(clip)
    return {foot: clip.cycles - touchdowns[foot] for foot in clip.feet if touchdowns[foot] < clip.cycles}


def extra_steps(clip: Clip) -> dict[str, int]:
    """Return the feet of a loop that touch down more often than once a cycle, and how many times more."""
    if not clip.cycles:  # without a gait feet step as they are to
        return {}
    touchdowns = _count_touchdowns(clip)
    return {foot: touchdowns[foot] - clip.cycles for foot in clip.feet if touchdowns[foot] > clip.cycles}


def describe_odd_steps(clip: Clip) -> str:
    """Return which feet of a loop do not touch down once a cycle; "" if all do, or if a leg is to fail."""
    kind = clip_of(clip.name) if clip.name in clip_names() else None
    is_gait = clip.loops and clip.cycles and clip.additive_over is None
    if not is_gait or (isinstance(kind, WalkLoop) and kind.failing is not None):
        return ""
    touchdowns = _count_touchdowns(clip)
    odd_feet = [f"{foot} {touchdowns[foot]}" for foot in clip.feet if touchdowns[foot] != clip.cycles]
    if not odd_feet:
        return ""
    cycles = "1 gait cycle" if clip.cycles == 1 else f"{clip.cycles} gait cycles"
    return f"{clip.name}: touchdowns in {cycles}: {', '.join(odd_feet)}; docs/bodies.md: limits"


def _count_touchdowns(clip: Clip) -> Mapping[str, int]:
    """Return how often feet touch down in a clip, by name; 0 for a foot that does not."""
    return collections.Counter(contact.foot for contact in clip.foot_contacts if contact.event == TOUCH_DOWN)


def measure_duty_factor(clip: Clip) -> float:
    """Return the mean share of a loop in which its feet touch the ground."""
    shares = []
    for foot in clip.feet:
        lift_offs, touch_downs = (
            [contact.time for contact in clip.foot_contacts if contact.foot == foot and contact.event == event]
            for event in (LIFT_OFF, TOUCH_DOWN)
        )
        # A stance may go on over the seam: the sum is right up to the duration. A foot without events stays down.
        seconds_down = (sum(lift_offs) - sum(touch_downs)) % clip.motion.seconds
        shares.append(seconds_down / clip.motion.seconds if lift_offs else 1.0)
    return sum(shares) / len(shares)


def name_animations(clip: Clip, roots_move: Sequence[bool]) -> dict[str, bool]:
    """Return the names of a clip's animations, and whether the root moves in them.

    Args:
        clip: any.
        roots_move: value of `ROOT_MOTIONS`: whether the root moves, for each animation of a clip that moves.
    """
    suffix = "_loop" if clip.loops else ""
    if not clip.moves:
        return {f"{clip.name}{suffix}": False}
    animations = {}
    for root_moves in roots_move:
        in_place = "" if root_moves else "_in_place"
        animations[f"{clip.name}{in_place}{suffix}"] = root_moves
    return animations


def _make_blend_spaces(clips: Sequence[Clip], roots_move: Sequence[bool]) -> dict[str, Any]:
    """Return the points of blend spaces: an animation for each point in the plane of two speeds.

    A plane is left out if all clips in it go straight ahead: engines make triangles of the points, and these would lie
    on a line.
    """
    spaces = {}
    for name, space in _BLEND_SPACES.items():
        points = []
        commands_to_sides = []
        for clip in clips:
            command = _command_of_point(clip)
            if command is not None and command[space.zero_component] == 0.0:
                first_animation, root_moves = next(iter(name_animations(clip, roots_move).items()))
                metadata = clip_metadata(clip, root_moves)
                points.append({"animation": first_animation, "at": [metadata[axis] for axis in space.axes]})
                commands_to_sides.append(command[space.side_component])
        if any(commands_to_sides):
            spaces[name] = {"axes": list(space.axes), "points": points}
    return spaces


def _command_of_point(clip: Clip) -> tuple[float, float, float] | None:
    """Return the command of a walk of a sound body, and that of idle, 0; None for clips that are no points."""
    if clip.name == "idle":
        return 0.0, 0.0, 0.0
    if clip.name not in clip_names():  # of a file
        return None
    kind = clip_of(clip.name)
    return kind.command if isinstance(kind, WalkLoop) and kind.failing is None else None
