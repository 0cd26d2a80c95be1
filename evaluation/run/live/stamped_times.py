"""When something happened to each image, in a ninth of the memory of a dictionary."""

from __future__ import annotations

from array import array
from collections.abc import Iterator, Mapping

import numpy as np


class StampedTimes(Mapping[int, int]):
    """Times [ns] by the stamps of images [ns], which come in order."""

    def __init__(self) -> None:
        self._stamps_ns, self._times_ns = array("q"), array("q")

    def note(self, stamp_ns: int, time_ns: int) -> None:
        """Remember one image; of two with one stamp the second counts.

        Raises:
            ValueError: A stamp that came before is larger.
        """
        if self._stamps_ns and stamp_ns <= self._stamps_ns[-1]:
            if stamp_ns < self._stamps_ns[-1]:
                raise ValueError(f"stamp {stamp_ns} comes after {self._stamps_ns[-1]}")
            self._times_ns[-1] = time_ns
            return
        self._stamps_ns.append(stamp_ns)
        self._times_ns.append(time_ns)

    def __len__(self) -> int:
        return len(self._stamps_ns)

    def __iter__(self) -> Iterator[int]:
        return iter(self._stamps_ns)

    def __getitem__(self, stamp_ns: int) -> int:
        index = int(np.searchsorted(self._stamps_ns, stamp_ns))
        if index == len(self) or self._stamps_ns[index] != stamp_ns:
            raise KeyError(stamp_ns)
        return self._times_ns[index]
