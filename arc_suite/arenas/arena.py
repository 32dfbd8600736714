"""The contract of an arena: what a place gives MuJoCo, and what it tells tasks of its ground."""

import dataclasses
from abc import ABC, abstractmethod
from typing import ClassVar

from dm_control import mjcf


@dataclasses.dataclass(frozen=True)
class Arena(ABC):
    """A place where a body moves: a frozen value, so that models and pictures can be cached by it.

    The start is at the origin, x the way to go. Heights are functions of arrays with any leading
    axes, of operators and methods alone or of the array's own namespace, so that one text serves
    NumPy and JAX.

    Attributes:
        is_level: whether the ground is the plane z = 0, which pushes out a foot that starts below it.
    """

    is_level: ClassVar[bool] = False

    @abstractmethod
    def add_to(self, root: mjcf.RootElement, **contact) -> None:
        """Add the ground to a model that holds a body.

        Args:
            root: the model; every geom of the ground is called `floor` or `floor_<something>`.
            **contact: attributes of the ground's geoms: how it touches a body.
        """

    @abstractmethod
    def height(self, x, y):
        """Return the height of the ground (...) under points x (...) and y (...), m."""

    def torso_clearance(self, positions):
        """Return the heights (...) of torsos at positions (..., 3) over the ground that counts for them, m."""
        return positions[..., 2] - self.height(positions[..., 0], positions[..., 1])

    @property
    def lists_contacts(self) -> bool:
        """Return whether a list of all pairs of geoms that may touch is faster than a search: where geoms are few.

        Planes and height fields are listed in any case.
        """
        return True
