"""Bones for animators: each lies in its limb, with its hinge as an axis, and stands in the pose that it is bound in."""

from collections.abc import Sequence

import mujoco
import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips.root_motion import Pose
from arc_suite.animation.parts import Part, part_frames

_MAX_CROSSING_COSINE = np.sqrt(0.5)  # between a link and its hinge: with a larger one, the link lies along the hinge
_SAME_POSITION = 1e-4  # of the longest link, by which positions of parts differ at least


def align_bones(parts: Sequence[Part]) -> list[Part]:
    """Return the same parts with other frames, in which a joint is one curve, and a bone points along its link.

    In glTF's axes, x is the hinge, and y points to the next part as far as it can across x. The bone of a link that
    lies along its hinge has the hinge as y. A foot has the direction of the link above, and a bone that swings points
    to its tip. The torso keeps its frame.

    Args:
        parts: parts of a body, those above first.
    """
    positions, orientations = part_frames(parts)
    axes_of_bones: list[np.ndarray] = []  # (3, 3) in the world, as columns
    for index, part in enumerate(parts):
        if part.parent is None:
            axes_of_bones.append(orientations[index])
            continue
        hinge = None
        if part.axis is not None:
            hinge = orientations[index] @ part.axis
        if part.swing is not None:
            link = orientations[index] @ part.swing.tip / np.linalg.norm(part.swing.tip)
        else:
            link = _link_direction(parts, positions, index)
        axes_of_bones.append(_bone_axes(hinge, link, parent_axes=axes_of_bones[part.parent]))

    bones = []
    for index, part in enumerate(parts):
        part = _turn_frame(part, axes_of_bones[index].T @ orientations[index])
        if part.parent is not None:
            to_parent = axes_of_bones[part.parent].T
            part = part._replace(
                place=to_parent @ (positions[index] - positions[part.parent]),
                quaternion=_to_quaternion(to_parent @ axes_of_bones[index]),
            )
        bones.append(part)
    return bones


def pose_parts(parts: Sequence[Part], pose: Pose) -> list[Part]:
    """Return the parts as they stand in a pose, or in several ones, whose arrays have leading axes."""
    posed_parts = []
    for part in parts:
        if part.parent is None:
            part = part._replace(place=pose.position, quaternion=pose.quaternion)
        elif part.joint is not None:
            part = part._replace(quaternion=hinge_orientations(part, pose.joints[..., part.joint]))
        posed_parts.append(part)
    return posed_parts


def hinge_orientations(part: Part, angles) -> np.ndarray:
    """Return the orientations (..., 4) of a part on the one above, at angles (...) of its joint, rad."""
    half_angles = 0.5 * np.asarray(angles)[..., None]
    turns = np.concatenate([np.cos(half_angles), np.sin(half_angles) * part.axis], axis=-1)
    return rotations.product(part.quaternion, turns)


def _link_direction(parts: Sequence[Part], positions, index: int) -> np.ndarray | None:
    """Return the direction (3,) from a part to the next one below it that is elsewhere; None without one."""
    longest_link = max(np.linalg.norm(part.place) for part in parts if part.parent is not None)
    for below in range(index + 1, len(parts)):
        if parts[below].parent != below - 1:  # another leg begins
            return None
        link = positions[below] - positions[index]
        length = np.linalg.norm(link)
        if length > _SAME_POSITION * longest_link:
            return link / length
    return None


def _bone_axes(hinge: np.ndarray | None, link: np.ndarray | None, parent_axes: np.ndarray) -> np.ndarray:
    """Return the axes of a bone as the columns (3, 3) of a rotation.

    Args:
        hinge: (3,) its direction; None for a part without a joint.
        link: (3,) direction to the next part; None for the last part of a leg.
        parent_axes: (3, 3) axes of the bone above.
    """
    if link is None and hinge is None:
        return parent_axes
    if link is None:
        link = parent_axes[:, 2]  # y of glTF, along the link above
    if hinge is None:
        return _axes_along(link, parent_axes)
    cosine = hinge @ link
    if abs(cosine) <= _MAX_CROSSING_COSINE:
        return _axes_of(x=hinge, y=_direction_across(link, hinge))
    return _axes_along(np.sign(cosine) * hinge, parent_axes)


def _axes_along(y: np.ndarray, parent_axes: np.ndarray) -> np.ndarray:
    """Return the axes of a bone along y of glTF, whose x is near x or y of the bone above, the one more across.

    With z of the bone above in place of x, Euler angles of FBX would be near gimbal lock.
    """
    _, parent_x, parent_y = parent_axes.T
    across_x = abs(y @ parent_x) <= abs(y @ parent_y)
    reference = parent_x if across_x else parent_y
    return _axes_of(x=_direction_across(reference, y), y=y)


def _axes_of(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the rotation whose axes are x and y of glTF, which are MuJoCo's y and z."""
    return np.stack([np.cross(x, y), x, y], axis=-1)


def _direction_across(vector: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return the direction of the component of a vector that is perpendicular to an axis."""
    component = vector - (vector @ axis) * axis
    return component / np.linalg.norm(component)


def _turn_frame(part: Part, rotation: np.ndarray) -> Part:
    """Return a part with its shapes, axis and tip in another frame, given the rotation (3, 3) into that frame."""
    quaternion = _to_quaternion(rotation)
    turned_shapes = []
    for shape in part.shapes:
        turned_shapes.append(
            shape._replace(place=rotation @ shape.place, quaternion=rotations.product(quaternion, shape.quaternion))
        )
    axis = None
    if part.axis is not None:
        axis = (rotation @ part.axis).round(12)
    swing = part.swing
    if swing is not None:
        swing = swing._replace(tip=rotation @ swing.tip, mass=rotation @ swing.mass)
    return part._replace(shapes=tuple(turned_shapes), axis=axis, swing=swing)


def _to_quaternion(rotation: np.ndarray) -> np.ndarray:
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(rotation).ravel())
    return quaternion
