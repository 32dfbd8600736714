"""The inertia of a rigid part to which mass is added, in the fields of a MuJoCo model."""

from typing import NamedTuple

import numpy as np

from arc_suite import rotations


class Inertia(NamedTuple):
    """Inertia of a part.

    Attributes:
        mass: kg.
        center: (3,) center of mass in the part's frame, m.
        principal: (3,) moments of inertia about the principal axes, kg m^2.
        quaternion: (4,) quaternion of the principal axes in the part's frame, w first.
    """

    mass: float
    center: np.ndarray
    principal: np.ndarray
    quaternion: np.ndarray

    def with_point(self, mass: float, point: np.ndarray) -> "Inertia":
        """Return the inertia with a point mass added, by the parallel-axis theorem.

        Args:
            mass: mass of the point, kg.
            point: (3,) position in the part's frame, m.
        """
        total_mass = self.mass + mass
        offset = point - self.center
        axes = rotations.matrix(self.quaternion)
        reduced_mass = self.mass * mass / total_mass
        tensor_of_part = axes * self.principal @ axes.T
        tensor = tensor_of_part + reduced_mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
        principal, new_axes = np.linalg.eigh(tensor)
        new_axes[:, 0] *= np.sign(np.linalg.det(new_axes))  # right-handed
        center = self.center + mass / total_mass * offset
        return Inertia(total_mass, center, principal, _quaternion(new_axes))


def _quaternion(matrix: np.ndarray) -> np.ndarray:
    """Return the quaternion (4,) of a rotation matrix (3, 3).

    It is an eigenvector of a symmetric matrix, which no rotation makes ill-conditioned (Bar-Itzhack, "New method for
    extracting the quaternion from a rotation matrix", 2000).
    """
    trace = np.trace(matrix)
    antisymmetric = matrix - matrix.T
    axial = (antisymmetric[2, 1], antisymmetric[0, 2], antisymmetric[1, 0])
    profile = np.empty((4, 4))
    profile[0, 0] = trace
    profile[0, 1:] = axial
    profile[1:, 0] = axial
    profile[1:, 1:] = matrix + matrix.T - trace * np.eye(3)
    _, eigenvectors = np.linalg.eigh(profile)
    return eigenvectors[:, -1]  # that of the largest eigenvalue
