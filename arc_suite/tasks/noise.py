"""Noise of sensors: numbers that depend on the key of an episode and the step alone.

Such a counter-based generator has no state. It gives the same numbers to one environment, to a batch and under JAX,
and again when an episode is repeated.
"""

import numpy as np

_GOLDEN = np.uint32(0x9E3779B9)  # 2^32 over the golden ratio; its multiples lie far apart


def noise(key, step, count: int):
    """Return numbers (..., count), uniform in [-1, 1), of a step of an episode.

    Args:
        key: (..., 1) uint32 of the episode.
        step: (..., 1) uint32.
        count: number of numbers.
    """
    xp = key.__array_namespace__()
    index = xp.arange(count, dtype=xp.uint32)
    bits = scramble(scramble(key ^ (step * _GOLDEN)) + index * _GOLDEN)
    return bits * 2.0**-31 - 1.0


def scramble(bits):
    """Return uint32 numbers (...) by a bijection in which every bit depends on all bits.

    This is the finalizer of MurmurHash3 (Appleby 2011).
    """
    bits = (bits ^ (bits >> 16)) * np.uint32(0x85EBCA6B)
    bits = (bits ^ (bits >> 13)) * np.uint32(0xC2B2AE35)
    return bits ^ (bits >> 16)
