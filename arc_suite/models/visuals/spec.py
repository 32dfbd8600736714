"""The parts of visuals: colors and ornaments."""

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
    """

    name: str
    material: str
    shape: str
    size: tuple[float, ...]
    position: Vector
    euler_deg: Vector = (0.0, 0.0, 0.0)
    paired: bool = False

    def mirrored(self) -> "Ornament":
        """Return the twin: a reflection at y -> -y keeps turns about y and reverses those about x and z."""
        x, y, z = self.position
        x_angle, y_angle, z_angle = self.euler_deg
        return self._replace(
            name=f"{self.name}_right",
            position=(x, -y, z),
            euler_deg=(-x_angle, y_angle, -z_angle),
            paired=False,
        )


class Visuals(NamedTuple):
    """Colors and ornaments of one creature.

    Attributes:
        colors: colors of the materials; "shell", "trim", "frame", "limb" and "glow" are those of any body.
        solids: materials of the torso's solids and ballast by name; those without an entry are "shell".
        ornaments: on the torso.
        glowing: names of the joints that glow; None for all of them.
    """

    colors: Mapping[str, Color]
    solids: Mapping[str, str] = {}
    ornaments: tuple[Ornament, ...] = ()
    glowing: tuple[str, ...] | None = None
