"""Mass added to a rigid part: its mass, center of mass and principal inertia, as a model has them."""

from typing import NamedTuple

import numpy as np

from arc_suite import rotations


class Inertia(NamedTuple):
    """How a part's mass is distributed.

    Attributes:
        mass: kg.
        center: (3,) of mass in the part's frame, m.
        principal: (3,) moments of inertia about the principal axes, kg m^2.
        quaternion: (4,) of the principal axes in the part's frame, w first.
    """

    mass: float
    center: np.ndarray
    principal: np.ndarray
    quaternion: np.ndarray

    def with_point(self, mass: float, place: np.ndarray) -> "Inertia":
        """Return the inertia together with a point mass, by the parallel-axis theorem.

        Args:
            mass: of the point, kg.
            place: (3,) of the point in the part's frame, m.
        """
        total, apart = self.mass + mass, place - self.center
        axes = rotations.matrix(self.quaternion)
        reduced = self.mass * mass / total
        tensor = axes * self.principal @ axes.T + reduced * (apart @ apart * np.eye(3) - np.outer(apart, apart))
        principal, axes = np.linalg.eigh(tensor)
        axes[:, 0] *= np.sign(np.linalg.det(axes))  # right-handed
        return Inertia(total, self.center + mass / total * apart, principal, _quaternion(axes))


def _quaternion(matrix: np.ndarray) -> np.ndarray:
    """Return the quaternion (4,) of a rotation matrix (3, 3).

    It is an eigenvector of a symmetric matrix, which no rotation makes ill-conditioned (Bar-Itzhack, "New method for
    extracting the quaternion from a rotation matrix", 2000).
    """
    trace, odd = np.trace(matrix), matrix - matrix.T
    profile = np.empty((4, 4))
    profile[0, 0], profile[0, 1:] = trace, (odd[2, 1], odd[0, 2], odd[1, 0])
    profile[1:, 0], profile[1:, 1:] = profile[0, 1:], matrix + matrix.T - trace * np.eye(3)
    return np.linalg.eigh(profile)[1][:, -1]
