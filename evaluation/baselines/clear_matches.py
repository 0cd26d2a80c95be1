"""Which features of two images match clearly: Lowe's ratio test over all pairs.

ASIFT finds a hundred thousand features on a carpet. All pairs of so many are what time goes into,
so distances are taken from matrix products, which are the fastest thing that a processor does.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

RATIO = 0.8
"""A match must be this much nearer than the second best (Lowe, IJCV 2004, Sec. 7.1)."""
_ROWS, _COLUMNS = 256, 2048  # so many products stay in the cache


def clear_matches(aerial: NDArray[np.float32], ground: NDArray[np.float32]) -> NDArray[np.int64]:
    """Features whose best match is clearly better than the second.

    Args:
        aerial: (N, D) descriptors.
        ground: (M, D) descriptors.

    Returns:
        (K, 2) indices into both, in the order of the first.
    """
    if len(aerial) == 0 or len(ground) < 2:
        return np.empty((0, 2), np.int64)
    ground_squared = (ground**2).sum(axis=1)
    tiles = [slice(start, start + _COLUMNS) for start in range(0, len(ground), _COLUMNS)]
    transposed = [np.ascontiguousarray(ground[tile].T) for tile in tiles]
    two_least = np.full((len(aerial), 2), np.inf, np.float32)
    best = np.zeros(len(aerial), np.int64)
    for start in range(0, len(aerial), _ROWS):
        rows = slice(start, start + _ROWS)
        for tile, words in zip(tiles, transposed, strict=True):
            products = aerial[rows] @ words
            _keep_nearest(products, ground_squared[tile], tile.start, two_least[rows], best[rows])
    distances = np.maximum(two_least + (aerial**2).sum(axis=1)[:, None], 0)
    kept = np.flatnonzero(distances[:, 0] < RATIO**2 * distances[:, 1])
    return np.stack([kept, best[kept]], axis=1)


@njit(cache=True, nogil=True)
def _keep_nearest(products, ground_squared, start, two_least, best):  # type: ignore[no-untyped-def]
    """Take in some more columns: squared distances, less what all of a row have in common."""
    two = np.float32(2)
    for row in range(len(products)):
        first, second = two_least[row]
        index = best[row]
        for column in range(len(ground_squared)):
            distance = ground_squared[column] - two * products[row, column]
            if distance < second:
                if distance < first:
                    first, second, index = distance, first, start + column
                else:
                    second = distance
        two_least[row, 0], two_least[row, 1], best[row] = first, second, index
