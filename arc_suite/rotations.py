"""Angles, and quaternions (..., 4), w first: functions of arrays of NumPy or JAX with any leading axes."""

import math


def wrap_angle(angle):
    """Return angles (...) between -pi and pi, rad."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def upright(quaternion):
    """Return the cosine (...) of the angle between a body's up axis and the vertical."""
    x, y = quaternion[..., 1], quaternion[..., 2]
    return 1.0 - 2.0 * (x * x + y * y)


def yaw(quaternion):
    """Return the angle (...) of a body's forward axis to world x, seen from above, rad in [-pi, pi]."""
    w, x, y, z = _components(quaternion)
    numpy = quaternion.__array_namespace__()
    return numpy.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def turn_about_z(quaternion, angle):
    """Return orientations (..., 4) turned by an angle (...) about world z, rad."""
    numpy = quaternion.__array_namespace__()
    cosine, sine = numpy.cos(0.5 * angle), numpy.sin(0.5 * angle)
    w, x, y, z = _components(quaternion)
    parts = (cosine * w - sine * z, cosine * x - sine * y, cosine * y + sine * x, cosine * z + sine * w)
    return numpy.stack(parts, axis=-1)


def product(first, second):
    """Return the rotations (..., 4) that turn as `second` does and then as `first` does."""
    numpy = second.__array_namespace__()
    a, b, c, d = _components(first)
    w, x, y, z = _components(second)
    parts = (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )
    return numpy.stack(parts, axis=-1)


def matrix(quaternion):
    """Return rotation matrices (..., 3, 3) from a body's frame to the world."""
    w, x, y, z = _components(quaternion)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    numpy = quaternion.__array_namespace__()
    return numpy.stack([numpy.stack(row, axis=-1) for row in rows], axis=-2)


def to_heading_frame(vectors, heading):
    """Return world vectors (..., 2) in the frame of a heading (...), rad: forward and left."""
    numpy = vectors.__array_namespace__()
    cosine, sine, x, y = numpy.cos(heading), numpy.sin(heading), vectors[..., 0], vectors[..., 1]
    return numpy.stack([cosine * x + sine * y, cosine * y - sine * x], axis=-1)


def _components(quaternion):
    """Return the four components (...) of quaternions (..., 4)."""
    return quaternion[..., 0], quaternion[..., 1], quaternion[..., 2], quaternion[..., 3]
