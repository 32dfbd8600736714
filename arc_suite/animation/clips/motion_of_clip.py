"""Clips as motions of the core, which files hold and tasks follow, and motions as clips."""

import numpy as np

from arc_suite import motions
from arc_suite.animation.clips import secondary
from arc_suite.animation.clips.clips import Clip
from arc_suite.animation.clips.foot_contacts import MIN_RISE, MIN_RISE_IN_GESTURE, FootContact, find_foot_contacts
from arc_suite.animation.clips.planting import slip
from arc_suite.animation.clips.root_motion import ClipMotion, put_on_root
from arc_suite.motions import gait_transfer
from arc_suite.motions.ground_poses import fit_twist, ground_poses, integrate_twist, relative_pose
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
    _, planted = _find_contacts(body, clip.motion, motion, clip.cycles)
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
    drift = np.zeros(3)
    if motion.loops:
        twist, drift = fit_twist(torso)
        twist = twist / motion.seconds
    root = integrate_twist(twist, np.arange(motion.frames) / motion.frame_rate)
    root = root + np.linspace(0.0, 1.0, motion.frames)[:, None] * drift
    clip_motion = put_on_root(1.0 / motion.frame_rate, poses, root, torso_on_root=relative_pose(root, torso))
    clip_motion = clip_motion._replace(twist=twist)
    cycles = gait_transfer.count_cycles(motion)
    contacts, _ = _find_contacts(body, clip_motion, motion, cycles)
    return Clip(
        name=motion.name,
        motion=clip_motion,
        loops=motion.loops,
        cycles=cycles,
        foot_contacts=tuple(contacts),
        feet=body.foot_names,
        slip=slip(body, clip_motion) if motion.loops else None,
        swings=secondary.swing_bones(body, clip_motion, motion.loops),
    )


def _find_contacts(
    body: Body, clip_motion: ClipMotion, motion: motions.Motion, cycles: int
) -> tuple[list[FootContact], np.ndarray]:
    """Return the foot contact events of a motion in the order of time, and the feet in stance, (samples, feet).

    Args:
        body: the spec.
        clip_motion: the motion of a clip.
        motion: the same as a motion of the core.
        cycles: cycles of the gait; 0 for a gesture.
    """
    heights = motion.soles[..., 2] * motion.standing_height  # m
    cycle = clip_motion.seconds / (cycles or 1)
    min_rise = MIN_RISE if cycles else MIN_RISE_IN_GESTURE
    return find_foot_contacts(clip_motion, body, heights, cycle, motion.loops, min_rise)
