"""Kinematics of legs: where soles are at given angles of joints, and which angles bring soles to goals."""

from typing import NamedTuple, Self

import numpy as np

from arc_suite.robots.spec import Body

_JOINT_RANGE_SHARE = 0.95  # of a joint's range, about its middle, that targets may use
_RELAXING_ITERATIONS = 50
_DIMENSIONS = 3  # of the place of a foot
_MIN_PATH_LENGTH = 1e-9  # of the path of a foot that moves
# (3, 9) of which each row has the matrix of the cross product with a unit vector.
_CROSS = np.array([[0, 0, 0, 0, 0, -1, 0, 1, 0], [0, 0, 1, 0, 0, 0, -1, 0, 0], [0, -1, 0, 1, 0, 0, 0, 0, 0]], float)
_IDENTITY = np.eye(3)
_VERTICAL = (0.0, 0.0, 1.0)


class Legs(NamedTuple):
    """Chains of links of all legs, in the torso's frame; shorter ones end in fixed links without length.

    Attributes:
        mounts: (legs, 3) where they begin, m.
        mount_rotations: (legs, 3, 3) orientations there.
        axes: (legs, links, 3) axes of the joint at the beginning of each link, unit vectors; 0 where it is fixed.
        ends: (legs, links, 3) ends of links from their beginnings, m.
        radii: (legs,) radii of the feet, m.
        joint_indices: (legs, links) indices of joints in the body; 0 where a link is fixed.
        has_joint: (legs, links) whether a link has a joint.
        low: (legs, links) lower bounds of targets, rad.
        high: (legs, links) upper bounds of targets, rad.
    """

    mounts: np.ndarray
    mount_rotations: np.ndarray
    axes: np.ndarray
    ends: np.ndarray
    radii: np.ndarray
    joint_indices: np.ndarray
    has_joint: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, body: Body, used: float = _JOINT_RANGE_SHARE) -> Self:
        """Return the legs of a body.

        Args:
            body: any body.
            used: share of a joint's range, about its middle, that targets may use.
        """
        shape = (len(body.legs), max(len(leg.links) for leg in body.legs))
        axes = np.zeros((*shape, 3))
        ends = np.zeros((*shape, 3))
        joint_indices = np.zeros(shape, int)
        has_joint = np.zeros(shape, bool)
        low = np.zeros(shape)
        high = np.zeros(shape)
        joint_count = 0
        for leg_index, leg in enumerate(body.legs):
            for link_index, link in enumerate(leg.links):
                index = (leg_index, link_index)
                ends[index] = link.end
                if not link.joint:
                    continue
                axes[index] = np.array(link.joint.axis) / np.linalg.norm(link.joint.axis)
                joint_indices[index] = joint_count
                has_joint[index] = True
                low_limit, high_limit = np.radians(link.joint.range_deg)
                unused_range = 0.5 * (1.0 - used) * (high_limit - low_limit)  # at either limit
                low[index] = low_limit + unused_range
                high[index] = high_limit - unused_range
                joint_count += 1
        mounts = np.array([leg.mount for leg in body.legs])
        radii = np.array([leg.foot.radius for leg in body.legs])
        yaws = np.radians([leg.yaw_deg for leg in body.legs])
        mount_rotations = _rotations(np.tile(_VERTICAL, (len(mounts), 1)), yaws)
        return cls(mounts, mount_rotations, axes, ends, radii, joint_indices, has_joint, low, high)

    def to_foot_centers(self) -> Self:
        """Return the legs with the centers of feet for soles."""
        return self._replace(radii=np.zeros_like(self.radii))

    def choose(self, indices: np.ndarray) -> Self:
        """Return the legs with these indices (legs,)."""
        return type(self)(*(values[indices] for values in self))

    def widen_ranges(self, angles: np.ndarray) -> Self:
        """Return the legs with joint ranges that hold angles (samples, legs, links); limits in the physics are soft."""
        low = np.minimum(self.low, angles.min(axis=0))
        high = np.maximum(self.high, angles.max(axis=0))
        return self._replace(low=low, high=high)

    def by_leg(self, values) -> np.ndarray:
        """Return values (..., joints) as (..., legs, links), 0 where a link is fixed."""
        xp = values.__array_namespace__()
        return xp.where(self.has_joint, values[..., self.joint_indices], 0.0)

    def by_joint(self, values) -> np.ndarray:
        """Return values (..., legs, links) as (..., joints)."""
        return values[..., self.has_joint]

    def sole_positions(self, angles) -> np.ndarray:
        """Return the positions (..., legs, 3) of soles in the torso's frame, m, at angles (..., legs, links), rad."""
        return self.foot_centers(angles) - self.radii[:, None] * _VERTICAL

    def foot_centers(self, angles) -> np.ndarray:
        """Return the positions (..., legs, 3) of the centers of feet in the torso's frame, m; see `sole_positions`."""
        _, _, ends = self._follow_links(angles)
        return ends

    def soles(self, angles) -> tuple[np.ndarray, np.ndarray]:
        """Return the positions (..., legs, 3) of the soles, m, and their Jacobians (..., legs, 3, links).

        Args:
            angles: (..., legs, links) rad.
        """
        axes, anchors, end = self._follow_links(angles)
        sole = end - self.radii[:, None] * _VERTICAL
        return sole, _cross(axes, sole[..., None, :] - anchors)

    def places(self, angles) -> tuple[np.ndarray, np.ndarray]:
        """Return where links begin and feet are, (..., legs, links + 1, 3), m, and the axes of joints there.

        An axis is 0 where a link is fixed, and of a foot. A foot is also where links begin that a leg does not have.

        Args:
            angles: (..., legs, links) rad.
        """
        xp = angles.__array_namespace__()
        axes, anchors, end = self._follow_links(angles)
        foot = end[..., None, :]
        return xp.concatenate([anchors, foot], axis=-2), xp.concatenate([axes, xp.zeros_like(foot)], axis=-2)

    def _follow_links(self, angles) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return axes and beginnings (..., legs, links, 3) of links, and the ends (..., legs, 3) of legs."""
        xp = angles.__array_namespace__()
        link_rotations = _rotations(self.axes, angles)
        orientation = xp.broadcast_to(self.mount_rotations, (*angles.shape[:-1], 3, 3))
        position = xp.broadcast_to(self.mounts, (*angles.shape[:-1], 3))
        axes = []
        anchors = []
        for link in range(angles.shape[-1]):
            axes.append((orientation @ self.axes[:, link, :, None])[..., 0])
            anchors.append(position)
            orientation = orientation @ link_rotations[..., link, :, :]
            position = position + (orientation @ self.ends[:, link, :, None])[..., 0]
        return xp.stack(axes, axis=-2), xp.stack(anchors, axis=-2), position

    def solve_joint_angles(self, angles, goals, weights, damping: float, steps: int) -> np.ndarray:
        """Return the angles (..., legs, links) that bring soles near goals, by damped least squares.

        Args:
            angles: (..., legs, links) angles to begin with, rad.
            goals: (..., legs, 3) goals of the soles, m.
            weights: (..., legs, 3, 3) matrices that multiply the errors of the soles.
            damping: m.
            steps: control steps of the search.
        """
        xp = goals.__array_namespace__()
        for _ in range(steps):
            soles, jacobian = self.soles(angles)
            error = weights @ (goals - soles)[..., None]
            weighted_jacobian = weights @ jacobian
            change = least_changes(weighted_jacobian, error, damping)
            # Joints at their bounds must not keep the other joints from moving.
            is_stuck = (angles <= self.low) & (change < 0.0) | (angles >= self.high) & (change > 0.0)
            free_jacobian = xp.where(is_stuck[..., None, :], 0.0, weighted_jacobian)
            change = least_changes(free_jacobian, error, damping)
            angles = xp.minimum(xp.maximum(angles + change, self.low), self.high)
        return angles

    def relax_redundant_joints(self, angles, rest_angles, share: float, damping: float) -> np.ndarray:
        """Return angles (..., legs, links) nearer to those at rest, of legs with more than three joints; soles stay.

        The place of a foot leaves such a leg free. Without this, damped least squares let its pose drift, as those of
        a foot on a closed path do not return (Klein and Huang, "Review of pseudoinverse control for use with
        kinematically redundant manipulators", 1983).

        Args:
            angles: (..., legs, links) rad.
            rest_angles: (legs, links) rad.
            share: of the way to the angles at rest.
            damping: m.
        """
        is_redundant = self.has_joint.sum(axis=-1) > _DIMENSIONS
        if not is_redundant.any():
            return angles
        xp = angles.__array_namespace__()
        _, jacobian = self.soles(angles)
        approach = share * is_redundant[:, None] * (rest_angles - angles)
        change = approach - least_changes(jacobian, jacobian @ approach[..., None], damping)
        return xp.minimum(xp.maximum(angles + change, self.low), self.high)

    def relaxed_joint_angles(self, goals, weights, damping: float) -> np.ndarray:
        """Return the angles (legs, links), rad, near the middle of the joints' ranges, that bring soles near goals.

        Args:
            goals: (legs, 3) goals of the soles, m.
            weights: (3, 3) as for `solve_joint_angles`, the same for all legs.
            damping: m.
        """
        middle = 0.5 * (self.low + self.high)
        weights_of_legs = np.tile(weights, (len(goals), 1, 1))
        return self.solve_joint_angles(middle, goals, weights_of_legs, damping, _RELAXING_ITERATIONS)


def least_changes(jacobian, missing, damping: float) -> np.ndarray:
    """Return the changes of joints, by damped least squares, that move a point: J^T (J J^T + d^2 I)^-1 e.

    Args:
        jacobian: J, (..., 3, n) of the point, m/rad.
        missing: e, (..., 3, 1) displacement of the point, m.
        damping: d, m.

    Returns:
        (..., n) rad.
    """
    xp = jacobian.__array_namespace__()
    transposed = jacobian.swapaxes(-1, -2)
    damped_square = jacobian @ transposed + damping**2 * _IDENTITY
    return (transposed @ xp.linalg.solve(damped_square, missing))[..., 0]


def damped_changes(jacobian, pull, damping):
    """Return the changes of joints by least squares in which each joint has a damping: (J^T J + D)^-1 J^T e.

    With the same damping of all joints they are those of `least_changes`, up to rounding.

    Args:
        jacobian: J, (..., m, n) m/rad.
        pull: J^T e, (..., n, 1); of one point (n,) alone.
        damping: D, (n, n) m^2, a diagonal matrix.

    Returns:
        As `pull`, rad.
    """
    xp = jacobian.__array_namespace__()
    return xp.linalg.solve(jacobian.swapaxes(-1, -2) @ jacobian + damping, pull)


def _rotations(axes, angles) -> np.ndarray:
    """Return rotations (..., 3, 3) by angles (...) about unit axes (..., 3), after Rodrigues.

    An axis of 0 gives no rotation.
    """
    xp = angles.__array_namespace__()
    cross = (axes @ _CROSS).reshape(*axes.shape, 3)
    sine = xp.sin(angles)[..., None, None]
    cosine = xp.cos(angles)[..., None, None]
    return _IDENTITY + sine * cross + (1.0 - cosine) * (cross @ cross)


def _cross(first, second):
    """Return the cross products (..., 3, n) of vectors (..., n, 3), in half of the time of `numpy.cross`."""
    xp = second.__array_namespace__()
    x, y, z = (first[..., i] for i in range(3))
    other_x, other_y, other_z = (second[..., i] for i in range(3))
    components = (y * other_z - z * other_y, z * other_x - x * other_z, x * other_y - y * other_x)
    return xp.stack(components, axis=-2)


def point_velocities(motion, points):
    """Return velocities (environments, points, 2) of points (..., points, 2 or 3) of a body in motion.

    Args:
        motion: (environments, 3) forward, left and turning, m/s and rad/s.
        points: m from the center of turning.
    """
    xp = motion.__array_namespace__()
    forward, left, turning = (motion[:, i : i + 1] for i in range(3))
    return xp.stack([forward - turning * points[..., 1], left + turning * points[..., 0]], axis=-1)


def tilt_heights(vertical, points):
    """Return by how much the torso's tilt raises points of it, (environments, points), m.

    Args:
        vertical: (environments, 3) the world's, in the torso's frame.
        points: (..., points, 2 or 3) m from the center.
    """
    return vertical[:, :1] * points[..., 0] + vertical[:, 1:2] * points[..., 1]


def path_weights(paths, across: float, level: float = 1.0):
    """Return matrices (..., 3, 3) that weigh an error along paths (..., 2), across them, and in height.

    Args:
        paths: paths of feet, of any length.
        across: weight of the error across the path, against that along it.
        level: weight of the error in height.
    """
    xp = paths.__array_namespace__()
    length = xp.hypot(paths[..., 0], paths[..., 1])[..., None]
    forward = np.array((1.0, 0.0))  # for a foot that does not move
    direction = xp.where(length > _MIN_PATH_LENGTH, paths / xp.maximum(length, _MIN_PATH_LENGTH), forward)
    x = direction[..., 0]
    y = direction[..., 1]
    zero = xp.zeros_like(x)
    along_row = (x, y, zero)
    across_row = (-across * y, across * x, zero)
    height_row = (zero, zero, xp.full_like(x, level))
    rows = [xp.stack(row, axis=-1) for row in (along_row, across_row, height_row)]
    return xp.stack(rows, axis=-2)
