"""Clips as motions of the core, which files hold and tasks follow."""

from arc_suite import motions
from arc_suite.animation.clips.clips import Clip
from arc_suite.animation.clips.foot_contacts import MIN_RISE, MIN_RISE_IN_GESTURE, find_foot_contacts
from arc_suite.robots.spec import Body


def motion_of_clip(body: Body, clip: Clip) -> motions.Motion:
    """Return a clip as a motion, whose feet are planted in the stances of the clip.

    Raises:
        ValueError: an additive clip, which is a difference of motions.
    """
    if clip.additive_over is not None:
        raise ValueError(f"clips: {clip.name} is added to another clip, and is no motion by itself")
    poses = clip.motion.poses()
    motion = motions.make(
        body,
        name=clip.name,
        frame_rate=1.0 / clip.motion.time_step,
        loops=clip.loops,
        positions=poses[:, :3],
        quaternions=poses[:, 3:7],
        angles=poses[:, 7:],
    )
    cycle = clip.motion.seconds
    min_rise = MIN_RISE_IN_GESTURE
    if clip.cycles:
        cycle = clip.motion.seconds / clip.cycles
        min_rise = MIN_RISE
    heights = motion.soles[..., 2] * motion.standing_height
    _, planted = find_foot_contacts(clip.motion, body, heights, cycle, clip.loops, min_rise)
    return motion._replace(planted=planted)
