"""A standing pose that the user gives by the angles of joints."""

import fnmatch
import math

import numpy as np

from arc_suite import checks
from arc_suite.importing import candidates, tree
from arc_suite.importing.tree import Robot
from arc_suite.robots.spec import SpecError

_LARGEST_RANGE = 2.0 * math.pi  # rad; a larger angle is probably in degrees


def is_angles(home: str) -> bool:
    """Return whether a text gives angles of joints, such as "*_calf=-1.5", and not the name of a keyframe."""
    return "=" in home


def pose_of_angles(robot: Robot, home: str) -> np.ndarray:
    """Return the pose (nq,) of angles by joint; other joints are at zero, or at the nearest angle of their range.

    Args:
        robot: robot of the file.
        home: "joint=angle" with commas between them, rad, as in a keyframe. Names may have wildcards (* and ?); the
            last one that matches a joint counts.

    Raises:
        SpecError: a joint is unknown, or an angle is no number or outside of the joint's range.
    """
    qpos = candidates.zero_pose(robot)
    joint_by_name = {robot.joint_name(joint): joint for joint in robot.joints}
    for entry in home.split(","):
        pattern, _, text = map(str.strip, entry.partition("="))
        try:
            angle = float(text)
        except ValueError:
            raise SpecError(f"home: expected joint=angle in rad, got {checks.preview(entry)}") from None
        for name in _match_names(pattern, list(joint_by_name)):
            _check_angle(robot, joint_by_name[name], angle)
            qpos[robot.qpos_index(joint_by_name[name])] = angle
    return qpos


def _match_names(pattern: str, joint_names: list[str]) -> list[str]:
    """Return the joint of this name, or those that match its wildcards."""
    names = [name for name in joint_names if fnmatch.fnmatchcase(name, pattern)]
    if pattern in joint_names or not names:
        try:
            return [checks.name(pattern, joint_names, "joint")]
        except ValueError as error:
            raise SpecError(f"home: {error}") from None
    return names


def _check_angle(robot: Robot, joint: int, angle: float) -> None:
    """Refuse an angle outside of the range of a joint."""
    low, high = robot.limits(joint)
    if math.isfinite(angle) and low <= angle <= high:
        return
    is_hinge = robot.model.jnt_type[joint] == tree.HINGE
    unit = "rad" if is_hinge else "m"
    degrees_hint = "; angles are in rad, not in degrees" if is_hinge and abs(angle) > _LARGEST_RANGE else ""
    name = robot.joint_name(joint)
    raise SpecError(f"home: joint {name!r}: expected {low:.4g} to {high:.4g} {unit}, got {angle:g}{degrees_hint}")
