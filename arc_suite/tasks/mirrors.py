"""Mirror maps of observations and actions, across the x-z plane. They are exact: they swap numbers and signs.

The maps of a task are composed of those of its blocks. The mirror image of a step is as likely as the step itself, so
a learner may learn from both.
"""

from collections.abc import Iterable
from typing import NamedTuple, Self

import numpy as np

from arc_suite.robots.mirror import Image


class Mirror(NamedTuple):
    """A map of vectors (..., n) to those of the mirrored body; it is its own inverse.

    Attributes:
        sources: (n,) index of the number that each number of the image is.
        signs: (n,) 1 or -1.
    """

    sources: np.ndarray
    signs: np.ndarray

    @classmethod
    def with_signs(cls, *signs: int) -> Self:
        """Return the map that only multiplies numbers by signs."""
        return cls(np.arange(len(signs)), np.array(signs, np.int8))

    @classmethod
    def permute(cls, sources: np.ndarray) -> Self:
        """Return the map that only permutes numbers."""
        return cls(sources, np.ones(len(sources), np.int8))

    def __call__(self, vectors):
        """Return the mirrored vectors (..., n) of NumPy or JAX, with the same dtype."""
        return vectors[..., self.sources] * self.signs


POLAR = Mirror.with_signs(1, -1, 1)  # positions, velocities, forces
AXIAL = Mirror.with_signs(-1, 1, -1)  # angular velocities, torques
QUATERNION = Mirror.with_signs(1, -1, 1, -1)  # w first


class Symmetry(NamedTuple):
    """The mirror maps of a task.

    Attributes:
        observation: mirror of observations (..., size).
        action: mirror of actions (..., joints), and of joint angles and velocities.
    """

    observation: Mirror
    action: Mirror


def join(mirrors: Iterable[Mirror]) -> Mirror:
    """Return the map of concatenated vectors."""
    sources = []
    signs = []
    size = 0
    for mirror in mirrors:
        sources.append(size + mirror.sources)
        signs.append(mirror.signs)
        size += len(mirror.signs)
    return Mirror(np.concatenate(sources), np.concatenate(signs))


def joints(image: Image) -> Mirror:
    """Return the map of numbers of the joints: angles, velocities, actions."""
    return Mirror(image.joints, image.signs.astype(np.int8))


def repeat(partners: np.ndarray, mirror: Mirror) -> Mirror:
    """Return the map of the concatenated vectors of several parts, such as legs.

    Args:
        partners: (parts,) index of the part on the other side, such as `Image.parts`.
        mirror: the map of the vector of one part.
    """
    size = len(mirror.signs)
    sources = size * partners[:, None] + mirror.sources
    return Mirror(sources.ravel(), np.tile(mirror.signs, len(partners)))
