"""Angles, and rotations as quaternions (..., 4), w first: functions of NumPy or JAX arrays with any leading axes."""

import math

NO_TURN = (1.0, 0.0, 0.0, 0.0)  # the quaternion of a frame that is oriented as the one above


def wrap_angle(angle):
    """Return the equivalent angles (...) in [-pi, pi), rad."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def upright(quaternion):
    """Return the cosine (...) of the angle between a body's up axis and the vertical."""
    x = quaternion[..., 1]
    y = quaternion[..., 2]
    return 1.0 - 2.0 * (x * x + y * y)


def yaw(quaternion):
    """Return the angle (...) of a body's forward axis to world x, seen from above, rad in [-pi, pi]."""
    xp = quaternion.__array_namespace__()
    w, x, y, z = _components(quaternion)
    return xp.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def turn_about_z(quaternion, angle):
    """Return orientations (..., 4) turned by an angle (...), rad, about the world's z axis."""
    xp = quaternion.__array_namespace__()
    cosine = xp.cos(0.5 * angle)
    sine = xp.sin(0.5 * angle)
    w, x, y, z = _components(quaternion)
    turned_components = (
        cosine * w - sine * z,
        cosine * x - sine * y,
        cosine * y + sine * x,
        cosine * z + sine * w,
    )
    return xp.stack(turned_components, axis=-1)


def product(second_turn, first_turn):
    """Return the rotations (..., 4) that apply `first_turn` and then `second_turn`: the product of the quaternions."""
    xp = first_turn.__array_namespace__()
    a, b, c, d = _components(second_turn)
    w, x, y, z = _components(first_turn)
    product_components = (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )
    return xp.stack(product_components, axis=-1)


def inverse(quaternion):
    """Return the rotations (..., 4) that undo rotations."""
    xp = quaternion.__array_namespace__()
    w, x, y, z = _components(quaternion)
    return xp.stack([w, -x, -y, -z], axis=-1)


def matrix(quaternion):
    """Return rotation matrices (..., 3, 3) from a body's frame to the world."""
    xp = quaternion.__array_namespace__()
    w, x, y, z = _components(quaternion)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return xp.stack([xp.stack(row, axis=-1) for row in rows], axis=-2)


def from_matrix(matrix):
    """Return the quaternions (..., 4) of rotation matrices (..., 3, 3), w first."""
    xp = matrix.__array_namespace__()
    xx, yy, zz = (matrix[..., i, i] for i in range(3))
    x_turn = matrix[..., 2, 1] - matrix[..., 1, 2]
    y_turn = matrix[..., 0, 2] - matrix[..., 2, 0]
    z_turn = matrix[..., 1, 0] - matrix[..., 0, 1]
    xy = matrix[..., 0, 1] + matrix[..., 1, 0]
    xz = matrix[..., 0, 2] + matrix[..., 2, 0]
    yz = matrix[..., 1, 2] + matrix[..., 2, 1]
    # Each row is the quaternion times four of its components; the longest row has no small divisor.
    rows = (
        (1.0 + xx + yy + zz, x_turn, y_turn, z_turn),
        (x_turn, 1.0 + xx - yy - zz, xy, xz),
        (y_turn, xy, 1.0 - xx + yy - zz, yz),
        (z_turn, xz, yz, 1.0 - xx - yy + zz),
    )
    multiples = xp.stack([xp.stack(row, axis=-1) for row in rows], axis=-2)
    lengths = xp.sqrt((multiples * multiples).sum(axis=-1))
    longest = lengths.argmax(axis=-1)[..., None]
    multiple = xp.take_along_axis(multiples, longest[..., None], axis=-2)[..., 0, :]
    return multiple / xp.take_along_axis(lengths, longest, axis=-1)


def to_heading_frame(vectors, heading):
    """Return the forward and left components (..., 2) of world vectors (..., 2), given a heading (...), rad."""
    xp = vectors.__array_namespace__()
    cosine = xp.cos(heading)
    sine = xp.sin(heading)
    x = vectors[..., 0]
    y = vectors[..., 1]
    return xp.stack([cosine * x + sine * y, cosine * y - sine * x], axis=-1)


def _components(quaternion):
    """Return w, x, y and z (...) of quaternions (..., 4)."""
    return quaternion[..., 0], quaternion[..., 1], quaternion[..., 2], quaternion[..., 3]
