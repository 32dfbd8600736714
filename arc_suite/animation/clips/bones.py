"""Bones for animators: each lies in its limb, with its hinge as an axis, and stands in the pose that it is bound in."""

from collections.abc import Sequence

import mujoco
import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips.root_motion import Pose
from arc_suite.animation.parts import Part, part_frames

_ALONG = np.sqrt(0.5)  # cosine: a link that is nearer to its hinge than to the plane across lies along it
_SAME = 1e-4  # of the longest link, by which places differ


def align_bones(parts: Sequence[Part]) -> list[Part]:
    """Return the same parts with other frames, in which a joint is one curve, and a bone points along its link.

    In glTF's axes, x is the hinge, and y points to the next part as far as it can across x. The bone of a link that
    lies along its hinge has the hinge as y. A foot goes on as the link above. The torso keeps its frame.

    Args:
        parts: of a body, those above first.
    """
    places, turns = part_frames(parts)
    axes: list[np.ndarray] = []
    for index, part in enumerate(parts):
        if part.parent is None:
            axes.append(turns[index])
        else:
            hinge = None if part.axis is None else turns[index] @ part.axis
            axes.append(_bone(hinge, _link(parts, places, index), axes[part.parent]))
    return [_reframed(part, index, places, turns, axes) for index, part in enumerate(parts)]


def pose_parts(parts: Sequence[Part], pose: Pose) -> list[Part]:
    """Return the parts as they stand in a pose."""
    found = []
    for part in parts:
        if part.parent is None:
            part = part._replace(place=pose.position, quaternion=pose.quaternion)
        elif part.joint is not None:
            part = part._replace(quaternion=hinge_orientations(part, pose.joints[part.joint]))
        found.append(part)
    return found


def hinge_orientations(part: Part, angles) -> np.ndarray:
    """Return the orientations (..., 4) of a part on the one above, at angles (...) of its joint, rad."""
    half = 0.5 * np.asarray(angles)[..., None]
    return rotations.product(part.quaternion, np.concatenate([np.cos(half), np.sin(half) * part.axis], axis=-1))


def _link(parts: Sequence[Part], places, index: int) -> np.ndarray | None:
    """Return the direction (3,) from a part to the next one that is elsewhere; None without one."""
    longest = max(np.linalg.norm(part.place) for part in parts if part.parent is not None)
    for below, part in enumerate(parts[index + 1 :], start=index + 1):
        if part.parent != below - 1:  # another leg
            break
        way = places[below] - places[index]
        if (length := np.linalg.norm(way)) > _SAME * longest:
            return way / length
    return None


def _bone(hinge: np.ndarray | None, link: np.ndarray | None, above: np.ndarray) -> np.ndarray:
    """Return the axes of a bone as the columns (3, 3) of a rotation, given those of the bone above."""
    if link is None and hinge is None:
        return above
    if link is None:
        link = above[:, 2]
    if hinge is not None and abs(cosine := hinge @ link) <= _ALONG:
        return _frame(hinge, _across(link, hinge))
    y = link if hinge is None else np.sign(cosine) * hinge
    # x of glTF is, across, that of the bone above, or its y; with its z Euler angles of FBX would be near gimbal lock.
    _, *others = above.T
    return _frame(_across(min(others, key=lambda other: abs(y @ other)), y), y)


def _frame(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the rotation whose axes are x and y of glTF, which are our y and z."""
    return np.stack([np.cross(x, y), x, y], axis=-1)


def _across(vector: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Return the direction of what a vector has across an axis."""
    across = vector - (vector @ axis) * axis
    return across / np.linalg.norm(across)


def _reframed(part: Part, index: int, places, turns, axes) -> Part:
    """Return a part in the frame that `axes` has for it."""
    own, above = axes[index].T @ turns[index], None if part.parent is None else axes[part.parent].T
    turn = _quaternion(own)
    moved = (
        shape._replace(place=own @ shape.place, quaternion=rotations.product(turn, shape.quaternion))
        for shape in part.shapes
    )
    part = part._replace(shapes=tuple(moved), axis=None if part.axis is None else (own @ part.axis).round(12))
    if above is None:
        return part
    return part._replace(
        place=above @ (places[index] - places[part.parent]), quaternion=_quaternion(above @ axes[index])
    )


def _quaternion(matrix: np.ndarray) -> np.ndarray:
    found = np.empty(4)
    mujoco.mju_mat2Quat(found, np.ascontiguousarray(matrix).ravel())
    return found
