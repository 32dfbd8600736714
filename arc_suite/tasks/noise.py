"""Noise of senses: numbers that follow from an episode's key and its step alone.

A generator that counts gives the same numbers to one environment, to a batch and under
JAX, and once more when an episode is played again, without a state that steps would have to carry.
"""

import math
from collections.abc import Mapping

import numpy as np

from arc_suite.models.sizing import GRAVITY
from arc_suite.robots.spec import Body

# Half-widths at level 1, about those of legged_gym (joints 0.01 rad and 1.5 rad/s, velocity 0.1 m/s and 0.2 rad/s,
# gravity 0.05, heights 0.1 m) for a robot that stands half a metre high.
HEIGHT = 0.02  # h
ORIENTATION = 0.02  # of the quaternion's components
JOINT_ANGLE = 0.01  # rad
LINEAR_VELOCITY = 0.05  # sqrt(g h)
ANGULAR_VELOCITY = 0.05  # sqrt(g / h)
JOINT_VELOCITY = 0.3  # sqrt(g / h)
CONTACT_FORCE = 0.02  # of the range to which forces are clipped
SCAN = 0.1  # h
RANGES = 0.02  # of the farthest that is seen

_GOLDEN = np.uint32(0x9E3779B9)  # 2^32 over the golden ratio: what is counted lies far apart


def half_widths(body: Body, blocks: Mapping[str, int]) -> dict[str, np.ndarray]:
    """Return the half-widths (size,) of the noise at level 1 by name, of those blocks that are measured.

    Args:
        body: that measures.
        blocks: sizes of the blocks of an observation, by name; commands and clocks are known exactly.
    """
    height, joints = body.torso.standing_height, len(body.joint_names)
    unit, rate = math.sqrt(GRAVITY * height), math.sqrt(GRAVITY / height)
    measured = {
        "posture": np.repeat((HEIGHT * height, ORIENTATION, JOINT_ANGLE), (1, 4, joints)),
        "velocities": np.repeat(
            (LINEAR_VELOCITY * unit, ANGULAR_VELOCITY * rate, JOINT_VELOCITY * rate), (3, 3, joints)
        ),
        "contact_forces": np.full(6 * len(body.part_names), CONTACT_FORCE),
        "scan": np.full(blocks.get("scan", 0), SCAN),
        "ranges": np.full(blocks.get("ranges", 0), RANGES),
    }
    return {name: widths for name, widths in measured.items() if blocks.get(name) == len(widths)}


def noise(key, step, count: int):
    """Return numbers (..., count), uniform in [-1, 1), of a step of an episode.

    Args:
        key: (..., 1) uint32 of the episode.
        step: (..., 1) uint32.
        count: how many.
    """
    numpy = key.__array_namespace__()
    index = numpy.arange(count, dtype=numpy.uint32)
    drawn = scrambled(scrambled(key ^ (step * _GOLDEN)) + index * _GOLDEN)
    return drawn * 2.0**-31 - 1.0


def scrambled(bits):
    """Return scrambled uint32 numbers (...), a bijection in which every bit depends on all bits.

    This is the finaliser of MurmurHash3 (Appleby 2011).
    """
    bits = (bits ^ (bits >> 16)) * np.uint32(0x85EBCA6B)
    bits = (bits ^ (bits >> 13)) * np.uint32(0xC2B2AE35)
    return bits ^ (bits >> 16)
