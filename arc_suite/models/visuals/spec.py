"""The parts of visuals: colors and ornaments."""

import math
from collections.abc import Mapping
from typing import NamedTuple

Color = tuple[float, float, float]
Vector = tuple[float, float, float]


class Ornament(NamedTuple):
    """A shape on the torso without mass or contacts.

    Attributes:
        name: unique in the visuals; the geom is called `visual-<name>`.
        material: a key of the visuals' colors.
        shape: a MuJoCo geom type.
        size: half-extents as MuJoCo takes them for the shape, m.
        position: center in the torso's frame, m.
        euler_deg: turns about the x, y and z axes of the turning frame, in that order, degrees.
        paired: whether it has a twin across the x-z plane, `visual-<name>_right`.
        bone: name of the bone that it swings with; "" for one that is fixed to the torso.
    """

    name: str
    material: str
    shape: str
    size: tuple[float, ...]
    position: Vector
    euler_deg: Vector = (0.0, 0.0, 0.0)
    paired: bool = False
    bone: str = ""

    def mirrored(self) -> "Ornament":
        """Return the twin: a reflection at y -> -y keeps turns about y and reverses those about x and z."""
        x, y, z = self.position
        x_angle, y_angle, z_angle = self.euler_deg
        return self._replace(
            name=f"{self.name}_right",
            position=(x, -y, z),
            euler_deg=(-x_angle, y_angle, -z_angle),
            paired=False,
            bone=f"{self.bone}_right" if self.bone else "",
        )


class Bone(NamedTuple):
    """A bone of the torso, whose ornaments swing about its pivot in pictures; it has no joint.

    Attributes:
        name: unique in the visuals.
        spring: a key of `springs.SPRINGS`.
        pivot, tip: its ends in the torso's frame, m.
        pivot_radius, tip_radius: radii of balls at its ends, whose convex hull holds its ornaments, m.
        paired: whether it has a twin across the x-z plane, `<name>_right`.
    """

    name: str
    spring: str
    pivot: Vector
    tip: Vector
    pivot_radius: float
    tip_radius: float
    paired: bool = False

    def mirrored(self) -> "Bone":
        """Return the twin."""
        pivot_x, pivot_y, pivot_z = self.pivot
        tip_x, tip_y, tip_z = self.tip
        return self._replace(
            name=f"{self.name}_right", pivot=(pivot_x, -pivot_y, pivot_z), tip=(tip_x, -tip_y, tip_z), paired=False
        )


def whip(bone: Bone, stalk: str, ball: str, shape: str = "capsule") -> tuple[Ornament, Ornament]:
    """Return a stalk along a bone, and a ball at its tip.

    Args:
        bone: bone that they swing with.
        stalk: material of the stalk.
        ball: material of the ball.
        shape: capsule, or ellipsoid for a stalk that tapers.
    """
    length = math.dist(bone.pivot, bone.tip)
    x, y, z = ((tip - pivot) / length for pivot, tip in zip(bone.pivot, bone.tip, strict=True))
    center_x, center_y, center_z = (0.5 * (pivot + tip) for pivot, tip in zip(bone.pivot, bone.tip, strict=True))
    along_bone = (math.degrees(math.atan2(-y, z)), math.degrees(math.asin(x)), 0.0)
    radius = 0.5 * bone.pivot_radius
    size = (radius, 0.5 * length) if shape == "capsule" else (radius, radius, 0.5 * length)
    center = (center_x, center_y, center_z)
    return (
        Ornament(bone.name, stalk, shape, size, center, along_bone, bone.paired, bone.name),
        Ornament(f"{bone.name}_ball", ball, "sphere", (bone.tip_radius,), bone.tip, paired=bone.paired, bone=bone.name),
    )


class Visuals(NamedTuple):
    """Colors and ornaments of one creature.

    Attributes:
        colors: colors of the materials; "shell", "trim", "frame", "limb" and "glow" are those of any body.
        solids: materials of the torso's solids and ballast by name; those without an entry are "shell".
        ornaments: on the torso.
        bones: bones of the ornaments that swing.
        glowing: names of the joints that glow; None for all of them.
    """

    colors: Mapping[str, Color]
    solids: Mapping[str, str] = {}
    ornaments: tuple[Ornament, ...] = ()
    bones: tuple[Bone, ...] = ()
    glowing: tuple[str, ...] | None = None
