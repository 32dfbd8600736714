"""Motions as values: frames of a torso, joints and feet, which a task follows and which files of others become."""

from arc_suite.motions.motion import Motion, check_body, find_rest, fits, make, mirror
from arc_suite.motions.motion_files import digest, load, save
from arc_suite.motions.retargeting import retarget
from arc_suite.motions.sampling import Velocities, repeat, resample, velocities

__all__ = [
    "Motion",
    "Velocities",
    "check_body",
    "digest",
    "find_rest",
    "fits",
    "load",
    "make",
    "mirror",
    "repeat",
    "resample",
    "retarget",
    "save",
    "velocities",
]
