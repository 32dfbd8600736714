"""Where the front of a robot is: from the names of its legs, and from the hinges about which they swing."""

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite.importing import tree
from arc_suite.importing.facing import AXES, Facing
from arc_suite.importing.tree import Robot

# What words in names say of a leg: front (1) or rear (-1), left (1) or right (-1).
_WORDS = {"front": (1, 0), "rear": (-1, 0), "back": (-1, 0), "hind": (-1, 0), "left": (0, 1), "right": (0, -1)}
_LETTERS = {"f": (1, 0), "h": (-1, 0), "b": (-1, 0), "m": (0, 0), "l": (0, 1), "r": (0, -1)}
_PAIR = re.compile(r"[fhbm][lr]|[lr][fhbm]")  # front left, left front and so on
_REAR_PAIRS = {"rl": (-1, 1), "lr": (-1, 1), "rr": (-1, -1)}
_TOKEN = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")

# The axis ahead of a robot, by the axis on its left.
_AXIS_BESIDE_LEFT = {None: None, "x": "-y", "y": "x", "-x": "y", "-y": "-x"}

_MIN_COSINE = np.cos(np.radians(30.0))  # of the angle between a direction and the axis that it means
_MIN_DEPTH = 0.4  # of the deepest end of a chain; chains that end higher are arms and heads
_LEVEL = 0.5  # vertical part of a hinge's axis, a unit vector, that counts as level
_MIN_SHARE = 0.6  # of level hinges about one line


class _Limb(NamedTuple):
    """A chain of joints that may be a leg.

    Attributes:
        names: names of its joints and bodies in the file.
        mount: (3,) anchor of its first joint, in the torso's frame, m.
        axes: (joints, 3) unit vectors.
    """

    names: tuple[str, ...]
    mount: np.ndarray
    axes: np.ndarray


class Front(NamedTuple):
    """Where the front of a robot is.

    Attributes:
        forward: axis of the torso's frame that points ahead; "x" where nothing else is sure.
        doubted_axis: axis that names or hinges say where they are not sure; "x" for none.
        doubt: who says it.
    """

    forward: str
    doubted_axis: str = "x"
    doubt: str = ""

    def notes(self, facing: Facing) -> tuple[str, ...]:
        """Return a line for the user where names or hinges say that x is not the front.

        Args:
            facing: of the torso, turned by `forward`.
        """
        if self.forward != "x":
            return (
                f"turned: the file's {facing.forward} axis points ahead, as names of legs and their hinges say; "
                "the torso's frame has x there",
            )
        if self.doubted_axis != "x":
            axis = facing.turn(self.doubted_axis).forward
            return (
                f"front: the file's {facing.forward} axis, although {self.doubt} {axis}; --forward={axis} turns it",
            )
        return ()


def find_front(robot: Robot) -> Front:
    """Return where the front of a robot is.

    Names say it by words such as front and left, hinges by a line: legs swing across it. Another axis than x is the
    front where both agree, or where both words for front and words for left say it and hinges say nothing.
    """
    limbs = list(_find_limbs(robot))
    front_axis = _axis_by_words(limbs, index=0)
    axis_beside_left = _AXIS_BESIDE_LEFT[_axis_by_words(limbs, index=1)]
    hinge_line = _line_by_hinges(limbs)
    if front_axis and axis_beside_left and front_axis != axis_beside_left:
        return Front("x", front_axis, "some names of legs say")
    named_axis = front_axis or axis_beside_left
    if named_axis is None:
        return Front("x", hinge_line or "x", "legs swing along")
    is_sure = hinge_line == named_axis[-1] or (hinge_line is None and front_axis == axis_beside_left)
    return Front(named_axis) if is_sure else Front("x", named_axis, "names of legs say")


def _find_limbs(robot: Robot) -> Iterator[_Limb]:
    """Yield the chains of two or more joints that end low with all joints at zero."""
    model = robot.model
    data = robot.forward_kinematics(robot.clip_to_limits(0.0 * model.qpos0))
    ends = {chain: tree.lowest_point(robot, data, geoms)[0][2] for chain, geoms in robot.end_colliders().items()}
    deepest = min(ends.values())
    for chain, height in ends.items():
        if len(chain) > 1 and height < _MIN_DEPTH * deepest:
            bodies = [int(model.jnt_bodyid[joint]) for joint in chain]
            names = [*(robot.joint_name(joint) for joint in chain), *(model.body(body).name for body in bodies)]
            yield _Limb(tuple(names), data.xanchor[chain[0]].copy(), data.xaxis[list(chain)])


def _axis_by_words(limbs: Sequence[_Limb], index: int) -> str | None:
    """Return the axis from limbs that names call rear (or right) to those that they call front (or left).

    Args:
        limbs: chains that may be legs.
        index: 0 for front and rear, 1 for left and right.
    """
    sides = [int(np.sign(sum(_read_words(name)[index] for name in limb.names))) for limb in limbs]
    groups = [[limb.mount for limb, side in zip(limbs, sides, strict=True) if side == sign] for sign in (1, -1)]
    if not all(groups):
        return None
    first, second = (np.mean(group, axis=0) for group in groups)
    return _name_axis(first - second)


def _read_words(name: str) -> tuple[int, int]:
    """Return what a name says: front (1) or rear (-1), and left (1) or right (-1); 0 for nothing."""
    lower_name = name.lower()
    words = [value for word, value in _WORDS.items() if word in lower_name]
    if not words:
        for token in (token.lower() for token in _TOKEN.findall(name)):
            if token in _REAR_PAIRS:
                words.append(_REAR_PAIRS[token])
            elif _PAIR.fullmatch(token):
                words += [_LETTERS[letter] for letter in token]
    front, left = np.sum([(0, 0), *words], axis=0)
    return int(np.sign(front)), int(np.sign(left))


def _name_axis(direction: np.ndarray) -> str | None:
    """Return the level axis that a direction (3,) means; None if it lies between two."""
    length = np.linalg.norm(direction)
    for name in ("x", "-x", "y", "-y"):
        if direction @ AXES[name] > _MIN_COSINE * length:
            return name
    return None


def _line_by_hinges(limbs: Sequence[_Limb]) -> str | None:
    """Return "x" or "y", along which legs swing about most of their hinges; None if some hinges are upright."""
    axes = np.concatenate([limb.axes for limb in limbs]) if limbs else np.empty((0, 3))
    is_level = abs(axes[:, 2]) < _LEVEL
    if not len(axes) or not is_level.all():
        return None
    share_about_x, share_about_y, _ = np.square(axes).mean(axis=0)
    if share_about_y > _MIN_SHARE:
        return "x"
    return "y" if share_about_x > _MIN_SHARE else None
