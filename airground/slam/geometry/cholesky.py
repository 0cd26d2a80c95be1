"""Small positive definite systems inside kernels, where an exception cannot be caught."""

from __future__ import annotations

import numpy as np
from numba import njit

from airground.core.arrays import F64


@njit(cache=True, nogil=True, error_model="numpy")
def solve(H: F64, g: F64) -> tuple[F64, bool]:
    """x with H x = g by Cholesky, and whether H is positive definite."""
    n = len(g)
    L, x = np.zeros((n, n)), g.copy()
    for j in range(n):
        for i in range(j, n):
            s = H[i, j]
            for m in range(j):
                s -= L[i, m] * L[j, m]
            if i == j:
                # A pivot lost in the rounding of its row counts as zero.
                if not s > 1e-13 * H[j, j]:
                    return x, False
                L[j, j] = np.sqrt(s)
            else:
                L[i, j] = s / L[j, j]
    for i in range(n):
        for m in range(i):
            x[i] -= L[i, m] * x[m]
        x[i] /= L[i, i]
    for i in range(n - 1, -1, -1):
        for m in range(i + 1, n):
            x[i] -= L[m, i] * x[m]
        x[i] /= L[i, i]
    return x, True


@njit(cache=True, nogil=True, error_model="numpy")
def inverse(H: F64) -> F64:
    """Inverse of a positive definite matrix; NaN if it is not."""
    result = np.full(H.shape, np.nan)
    for j in range(len(H)):
        unit = np.zeros(len(H))
        unit[j] = 1.0
        column, solved = solve(H, unit)
        if not solved:
            return np.full(H.shape, np.nan)
        result[:, j] = column
    symmetric: F64 = 0.5 * (result + result.T)
    return symmetric
