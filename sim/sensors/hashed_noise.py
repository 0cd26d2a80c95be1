"""Noise for compiled loops: a number for every pixel from a key, in any order.

A generator with a state would cost more than all else that a sensor does to an image. The
key comes from the one `numpy.random.Generator`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_BYTES = np.uint64(0x00FF00FF00FF00FF)
_LANES = np.uint64(0x0001000100010001)
_MEAN = np.float32(8 * 127.5)
_DEVIATION = np.float32(np.sqrt(8 * (256**2 - 1) / 12))


def noise_key(rng: np.random.Generator) -> np.uint64:
    """A key for `gaussian`."""
    return np.uint64(rng.integers(2**64, dtype=np.uint64))


@njit(cache=True, inline="always")
def gaussian(key: np.uint64, index: int) -> np.float32:
    """The normal deviate of this key and index, as the sum of a hash's eight bytes.

    The hash is the output function of SplitMix64 (Steele, Lea and Flood, OOPSLA 2014); the
    sum has the moments of a normal deviate within 2 % up to the fourth, and ends at 4.9.
    """
    bits = key + np.uint64(index) * _GOLDEN
    bits = (bits ^ (bits >> np.uint64(30))) * _MIX_1
    bits = (bits ^ (bits >> np.uint64(27))) * _MIX_2
    bits = bits ^ (bits >> np.uint64(31))
    pairs = (bits & _BYTES) + ((bits >> np.uint64(8)) & _BYTES)
    total = (pairs * _LANES) >> np.uint64(48)
    # By way of 32 bits, for which there are vector instructions.
    return (np.float32(np.int32(total)) - _MEAN) / _DEVIATION
