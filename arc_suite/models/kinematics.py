"""Kinematics of legs: where soles are at given angles of joints, and which angles bring them to places."""

from typing import NamedTuple, Self

import numpy as np

from arc_suite.robots.spec import Body

_USED = 0.95  # share of a joint's range, about its middle, that targets may use
_SETTLING = 50  # steps of the search for a pose at ease
# Cross products with the unit vectors, as matrices.
_CROSS = np.array(
    [[[0, 0, 0], [0, 0, -1], [0, 1, 0]], [[0, 0, 1], [0, 0, 0], [-1, 0, 0]], [[0, -1, 0], [1, 0, 0], [0, 0, 0]]]
)


class Legs(NamedTuple):
    """Chains of links of all legs, in the torso's frame; shorter ones end in fixed links without length.

    Attributes:
        mounts: (legs, 3) where they begin, m.
        turns: (legs, 3, 3) orientations there.
        axes: (legs, links, 3) of the joint at the beginning of each link, unit vectors; 0 where it is fixed.
        ends: (legs, links, 3) of links from their beginnings, m.
        radii: (legs,) of the feet, m.
        joints: (legs, links) indices; 0 where a link is fixed.
        moves: (legs, links) whether a link has a joint.
        low: (legs, links) bounds of targets, rad.
        high: the same.
    """

    mounts: np.ndarray
    turns: np.ndarray
    axes: np.ndarray
    ends: np.ndarray
    radii: np.ndarray
    joints: np.ndarray
    moves: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, body: Body, used: float = _USED) -> Self:
        """Return the legs of a body.

        Args:
            body: any body.
            used: share of a joint's range, about its middle, that targets may use.
        """
        shape = (len(body.legs), max(len(leg.links) for leg in body.legs))
        axes, ends, joints = np.zeros((*shape, 3)), np.zeros((*shape, 3)), np.zeros(shape, int)
        moves, low, high, count = np.zeros(shape, bool), np.zeros(shape), np.zeros(shape), 0
        for i, leg in enumerate(body.legs):
            for j, link in enumerate(leg.links):
                ends[i, j] = link.end
                if link.joint:
                    axes[i, j] = np.array(link.joint.axis) / np.linalg.norm(link.joint.axis)
                    joints[i, j], moves[i, j] = count, True
                    first, last = np.radians(link.joint.range_deg)
                    spare = 0.5 * (1.0 - used) * (last - first)
                    low[i, j], high[i, j] = first + spare, last - spare
                    count += 1
        mounts, radii = np.array([leg.mount for leg in body.legs]), np.array([leg.foot.radius for leg in body.legs])
        turns = _rotations(np.tile((0.0, 0.0, 1.0), (len(mounts), 1)), np.radians([leg.yaw_deg for leg in body.legs]))
        return cls(mounts, turns, axes, ends, radii, joints, moves, low, high)

    def by_leg(self, values) -> np.ndarray:
        """Return values (..., joints) as (..., legs, links), 0 where a link is fixed."""
        return values.__array_namespace__().where(self.moves, values[..., self.joints], 0.0)

    def by_joint(self, values) -> np.ndarray:
        """Return values (..., legs, links) as (..., joints)."""
        return values[..., self.moves]

    def soles(self, angles) -> tuple[np.ndarray, np.ndarray]:
        """Return the places (..., legs, 3) of the soles, m, and their Jacobians (..., legs, 3, links).

        Args:
            angles: (..., legs, links) rad.
        """
        numpy, frame, place, joints = angles.__array_namespace__(), self.turns, self.mounts, []
        for link in range(angles.shape[-1]):
            joints.append(((frame @ self.axes[:, link, :, None])[..., 0], place))
            frame = frame @ _rotations(self.axes[:, link], angles[..., link])
            place = place + (frame @ self.ends[:, link, :, None])[..., 0]
        sole = place - self.radii[:, None] * (0.0, 0.0, 1.0)
        return sole, numpy.stack([numpy.cross(axis, sole - anchor) for axis, anchor in joints], axis=-1)

    def solve_joint_angles(self, angles, goals, weights, damping: float, steps: int) -> np.ndarray:
        """Return the angles (..., legs, links), by damped least squares from given ones, that bring soles near goals.

        Args:
            angles: (..., legs, links) to begin with, rad.
            goals: (..., legs, 3) places of the soles, m.
            weights: (..., legs, 3, 3) by which what is missing is turned and weighed.
            damping: m.
            steps: of the search.
        """
        numpy = goals.__array_namespace__()
        for _ in range(steps):
            place, jacobian = self.soles(angles)
            missing, weighed = weights @ (goals - place)[..., None], weights @ jacobian
            change = least_changes(weighed, missing, damping)
            # Joints at their bounds must not hold the others up.
            bound = (angles <= self.low) & (change < 0.0) | (angles >= self.high) & (change > 0.0)
            change = least_changes(numpy.where(bound[..., None, :], 0.0, weighed), missing, damping)
            angles = (angles + change).clip(self.low, self.high)
        return angles

    def relaxed_joint_angles(self, places, weights, damping: float) -> np.ndarray:
        """Return the angles (legs, links), rad, near the middle of the joints' ranges, that bring soles near places.

        Args:
            places: (legs, 3) m.
            weights: (3, 3) as for `solve_joint_angles`, of all legs.
            damping: m.
        """
        weights = np.tile(weights, (len(places), 1, 1))
        return self.solve_joint_angles(0.5 * (self.low + self.high), places, weights, damping, _SETTLING)


def least_changes(jacobian, missing, damping: float) -> np.ndarray:
    """Return the changes of joints, by damped least squares, that move a point: J^T (J J^T + d^2 I)^-1 e.

    Args:
        jacobian: (..., 3, n) of the point, m/rad.
        missing: (..., 3, 1) displacement of the point, m.
        damping: m.

    Returns:
        (..., n) rad.
    """
    xp = jacobian.__array_namespace__()
    transposed = jacobian.swapaxes(-1, -2)
    square = jacobian @ transposed + damping**2 * np.eye(3)
    return (transposed @ xp.linalg.solve(square, missing))[..., 0]


def damped_changes(jacobian, pull, damping):
    """Return the changes of joints by least squares in which each joint has a damping: (J^T J + D)^-1 J^T e.

    With the same damping of all joints they are those of `least_changes`, up to rounding.

    Args:
        jacobian: (..., m, n) m/rad.
        pull: J^T e, (..., n, 1); of one point (n,) alone.
        damping: D, (n, n) m^2, a diagonal matrix.

    Returns:
        As `pull`, rad.
    """
    xp = jacobian.__array_namespace__()
    return xp.linalg.solve(jacobian.swapaxes(-1, -2) @ jacobian + damping, pull)


def _rotations(axes, angles) -> np.ndarray:
    """Rotations (..., 3, 3) by angles (...) about unit axes (..., 3), after Rodrigues; none about an axis of 0."""
    cross = sum(axes[..., i, None, None] * _CROSS[i] for i in range(3))
    numpy = angles.__array_namespace__()
    sine, cosine = numpy.sin(angles)[..., None, None], numpy.cos(angles)[..., None, None]
    return np.eye(3) + sine * cross + (1.0 - cosine) * (cross @ cross)


def point_velocities(motion, places):
    """Return velocities (environments, places, 2) of places (..., places, 2 or 3) of a body in motion.

    Args:
        motion: (environments, 3) forward, left and turning, m/s and rad/s.
        places: m from the center of turning.
    """
    forward, left, turning = (motion[:, i : i + 1] for i in range(3))
    stack = motion.__array_namespace__().stack
    return stack([forward - turning * places[..., 1], left + turning * places[..., 0]], axis=-1)


def tilt_heights(vertical, places):
    """Return by how much the torso's tilt raises places of it, (environments, places), m.

    Args:
        vertical: (environments, 3) the world's, in the torso's frame.
        places: (places, 2 or 3) m from the center.
    """
    return vertical[:, :1] * places[:, 0] + vertical[:, 1:2] * places[:, 1]


def path_weights(paths, across: float, level: float = 1.0):
    """Return weights (..., 3, 3) of an error along paths (..., 2), across them, and in height.

    Args:
        paths: of feet, of any length.
        across: weight of the error across the path, against that along it.
        level: weight of the error in height.
    """
    numpy = paths.__array_namespace__()
    length = numpy.hypot(paths[..., 0], paths[..., 1])[..., None]
    along = numpy.where(length > 1e-9, paths / numpy.maximum(length, 1e-9), np.array((1.0, 0.0)))
    x, y = along[..., 0], along[..., 1]
    zero, height = numpy.zeros_like(x), numpy.full_like(x, level)
    rows = (x, y, zero), (-across * y, across * x, zero), (zero, zero, height)
    return numpy.stack([numpy.stack(row, axis=-1) for row in rows], axis=-2)
