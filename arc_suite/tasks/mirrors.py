"""Mirror maps of observations and actions, across the x-z plane: exact, as they only swap numbers and their signs.

A task declares how its blocks are mirrored, put together of the maps here. What a policy sees and
does in a mirror is as likely to happen as what it sees and does, so that every step that is learned
from is worth two.
"""

from collections.abc import Iterable
from typing import NamedTuple, Self

import numpy as np

from arc_suite.robots.mirror import Image


class Mirror(NamedTuple):
    """A map of vectors (..., n) to those that are read of the mirrored body; twice is once.

    Attributes:
        sources: (n,) index of the number that takes the place of each.
        signs: (n,) 1 or -1.
    """

    sources: np.ndarray
    signs: np.ndarray

    @classmethod
    def with_signs(cls, *signs: int) -> Self:
        """Return the map that leaves numbers in place, some with the other sign."""
        return cls(np.arange(len(signs)), np.array(signs, np.int8))

    @classmethod
    def permute(cls, sources: np.ndarray) -> Self:
        """Return the map that takes numbers from other places, with their signs."""
        return cls(sources, np.ones(len(sources), np.int8))

    def __call__(self, vectors):
        """Return the mirrored vectors (..., n), in their own precision; of NumPy or JAX."""
        return vectors[..., self.sources] * self.signs


POLAR = Mirror.with_signs(1, -1, 1)  # positions, velocities, forces
AXIAL = Mirror.with_signs(-1, 1, -1)  # angular velocities, torques
QUATERNION = Mirror.with_signs(1, -1, 1, -1)  # w first


class Symmetry(NamedTuple):
    """The mirror maps of a task.

    Attributes:
        observation: of vectors (..., size).
        action: of actions (..., joints), and of joint angles and velocities.
    """

    observation: Mirror
    action: Mirror


def join(mirrors: Iterable[Mirror]) -> Mirror:
    """Return the map of vectors that are joined of the vectors of several maps."""
    sources, signs, size = [], [], 0
    for mirror in mirrors:
        sources.append(size + mirror.sources)
        signs.append(mirror.signs)
        size += len(mirror.signs)
    return Mirror(np.concatenate(sources), np.concatenate(signs))


def joints(image: Image) -> Mirror:
    """Return the map of numbers of the joints: angles, velocities, actions."""
    return Mirror(image.joints, image.signs.astype(np.int8))


def repeat(places: np.ndarray, mirror: Mirror) -> Mirror:
    """Return the map of the vectors of several parts, one behind the other.

    Args:
        places: (parts,) index of the part across, such as `Image.parts`.
        mirror: of the vector of one part.
    """
    size = len(mirror.signs)
    return Mirror((size * places[:, None] + mirror.sources).ravel(), np.tile(mirror.signs, len(places)))
