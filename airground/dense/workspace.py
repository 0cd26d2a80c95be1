"""Memory that outlives a depth map.

A cost volume has 36 MB. Asking the system for it anew with each depth map, and touching it
for the first time, takes longer than aggregating it.
"""

from __future__ import annotations

import numpy as np

from airground.core.arrays import U16


class Workspace:
    """Arrays of uint16 that are free for use."""

    def __init__(self) -> None:
        self._free: list[U16] = []

    def take(self, shape: tuple[int, ...]) -> U16:
        """A contiguous array with anything in it, not zeros."""
        for index, array in enumerate(self._free):
            if array.size == np.prod(shape):
                return self._free.pop(index).reshape(shape)
        return np.empty(shape, np.uint16)

    def give(self, array: U16) -> None:
        """Hand an array back; it must not be used afterwards."""
        self._free.append(array)
