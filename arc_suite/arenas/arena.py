"""The contract of an arena: geometry for MuJoCo, height of the ground for tasks."""

import dataclasses
from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np
from dm_control import mjcf

_TORSO_MARGIN = 0.5  # distance from the center of the torso within which the ground is under it, standing heights
_SQUARE = np.array([(x, y) for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0)])


@dataclasses.dataclass(frozen=True)
class Arena(ABC):
    """The ground on which a body moves: a frozen value, the key of cached models and pictures.

    The start is at the origin, forward is x. Heights are functions of arrays with any leading axes.
    They use operators, methods and the array's own namespace, so that one text serves NumPy and JAX.

    Attributes:
        is_level: whether the ground is the plane z = 0, which pushes out a foot that starts below it.
    """

    is_level: ClassVar[bool] = False

    def __getstate__(self) -> dict[str, Any]:
        """Return the fields alone for pickles; cached heights can be computed again."""
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}

    @abstractmethod
    def add_to(self, root: mjcf.RootElement, **contact: Any) -> None:
        """Add the ground to a model that holds a body.

        Args:
            root: the model; every geom of the ground is named `floor` or `floor_<something>`.
            **contact: contact attributes of the ground's geoms.
        """

    @abstractmethod
    def height(self, x, y):
        """Return the height of the ground (...) under points x (...) and y (...), m."""

    def has_left(self, x, y):
        """Return whether (...) torsos over points x (...) and y (...), m, have left the ground or are near its edge.

        Tasks truncate an episode there. Grounds without an edge return False, as this one does.
        """
        return False

    def torso_clearance(self, positions):
        """Return the heights (...) of torsos at positions (..., 3) over the ground near them, m."""
        return positions[..., 2] - self.height(positions[..., 0], positions[..., 1])

    @property
    def lists_contacts(self) -> bool:
        """Return whether explicit pairs of all geoms are faster than a broad phase: true for few geoms.

        Planes and height fields are listed in any case.
        """
        return True

    @property
    def surface(self) -> Any:
        """The `mapped.Surface` that pages draw in place of the geoms of the ground; None where they draw these."""
        return None


def clearance_over_highest(arena: Arena, positions, unit: float):
    """Return the heights (...) of torsos over the highest ground near them, m.

    Args:
        arena: the ground.
        positions: (..., 3) of torsos, m.
        unit: the standing height of the body, m; ground within half of it counts.
    """
    offsets = positions.__array_namespace__().asarray(_TORSO_MARGIN * unit * _SQUARE)
    x = positions[..., None, 0] + offsets[:, 0]
    y = positions[..., None, 1] + offsets[:, 1]
    return positions[..., 2] - arena.height(x, y).max(axis=-1)
