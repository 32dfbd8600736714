"""Noise of senses: numbers that follow from an episode's key and its step alone.

A generator that counts gives the same numbers to one environment, to a batch and under
JAX, and once more when an episode is played again, without a state that steps would have to carry.
"""

import numpy as np

_GOLDEN = np.uint32(0x9E3779B9)  # 2^32 over the golden ratio: what is counted lies far apart


def noise(key, step, count: int):
    """Return numbers (..., count), uniform in [-1, 1), of a step of an episode.

    Args:
        key: (..., 1) uint32 of the episode.
        step: (..., 1) uint32.
        count: how many.
    """
    numpy = key.__array_namespace__()
    index = numpy.arange(count, dtype=numpy.uint32)
    drawn = scramble(scramble(key ^ (step * _GOLDEN)) + index * _GOLDEN)
    return drawn * 2.0**-31 - 1.0


def scramble(bits):
    """Return scrambled uint32 numbers (...), a bijection in which every bit depends on all bits.

    This is the finalizer of MurmurHash3 (Appleby 2011).
    """
    bits = (bits ^ (bits >> 16)) * np.uint32(0x85EBCA6B)
    bits = (bits ^ (bits >> 13)) * np.uint32(0xC2B2AE35)
    return bits ^ (bits >> 16)
