"""Clips as motions of the core, which files hold and tasks follow, and motions as clips."""

import numpy as np

from arc_suite import motions
from arc_suite.animation.clips import secondary
from arc_suite.animation.clips.clips import Clip
from arc_suite.animation.clips.foot_contacts import (
    LIFT_OFF,
    MIN_RISE,
    MIN_RISE_IN_GESTURE,
    TOUCH_DOWN,
    FootContact,
    find_foot_contacts,
)
from arc_suite.animation.clips.planting import slip
from arc_suite.animation.clips.root_motion import put_on_root
from arc_suite.motions import gait_transfer
from arc_suite.motions.ground_poses import ground_poses, integrate_twist, relative_pose, twist_to
from arc_suite.robots.spec import Body


def motion_of_clip(body: Body, clip: Clip) -> motions.Motion:
    """Return a clip that is not additive as a motion, whose feet are planted in the stances of the clip."""
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


def clip_of_motion(body: Body, motion: motions.Motion, fps: float) -> Clip:
    """Return a motion of a body as a clip. The root of a loop goes evenly; that of another motion stays.

    Raises:
        ValueError: the motion is of another body.
    """
    motions.check_body(motion, body)
    motion = motions.resample(motion, fps)
    poses = np.concatenate([motion.positions, motion.quaternions, motion.angles], axis=-1)
    torso = ground_poses(poses)
    twist = np.zeros(3)
    if motion.loops:
        twist = twist_to(relative_pose(torso[0], torso[-1])) / motion.seconds
    root = integrate_twist(twist, np.arange(motion.frames) / motion.frame_rate)
    clip_motion = put_on_root(1.0 / motion.frame_rate, poses, root, torso_on_root=relative_pose(root, torso))
    clip_motion = clip_motion._replace(twist=twist)
    return Clip(
        name=motion.name,
        motion=clip_motion,
        loops=motion.loops,
        cycles=gait_transfer.count_cycles(motion),
        foot_contacts=tuple(_find_contacts(body, motion)),
        feet=body.foot_names,
        slip=slip(body, clip_motion) if motion.loops else None,
        swings=secondary.swing_bones(body, clip_motion, motion.loops),
    )


def _find_contacts(body: Body, motion: motions.Motion) -> list[FootContact]:
    """Return the foot contact events of a motion in the order of time."""
    changes = np.diff(motion.planted.astype(int), axis=0)
    contacts = []
    for frame, leg in np.argwhere(changes).tolist():
        event = TOUCH_DOWN if changes[frame, leg] > 0 else LIFT_OFF
        contacts.append(FootContact(body.foot_names[leg], event, frame + 1, time=(frame + 1) / motion.frame_rate))
    return contacts
