"""Pairs of stamps of two unsynchronized sensors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def associate(
    first_ns: NDArray[np.int64], second_ns: NDArray[np.int64], max_difference_ns: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pair stamps one to one, the nearest pairs first (as TUM's `associate.py` does).

    Args:
        first_ns, second_ns: (N,), (M,) strictly increasing.
        max_difference_ns: Stamps farther apart than this are no pair.

    Returns:
        (P,) indices into both, in order of time.
    """
    low = np.searchsorted(second_ns, first_ns - max_difference_ns, side="left")
    high = np.searchsorted(second_ns, first_ns + max_difference_ns, side="right")
    counts = high - low
    i = np.repeat(np.arange(len(first_ns)), counts)
    # Within each run of equal i, j counts up from its low.
    j = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    j += np.repeat(low, counts)
    taken_i, taken_j = np.zeros(len(first_ns), bool), np.zeros(len(second_ns), bool)
    pairs = []
    for k in np.lexsort((j, i, np.abs(first_ns[i] - second_ns[j]))):
        if not (taken_i[i[k]] or taken_j[j[k]]):
            taken_i[i[k]] = taken_j[j[k]] = True
            pairs.append((i[k], j[k]))
    pairs.sort()
    table = np.array(pairs, np.int64).reshape(-1, 2)
    return table[:, 0], table[:, 1]
