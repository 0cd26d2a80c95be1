"""Elimination of velocities and biases from the normal equations, and back again.

Each of them depends on its own pose and on what is next to it in time, so that their part of
the Hessian is a chain of 9 x 9 blocks: a block Cholesky factorization runs along it, and only
the poses are left to a dense one.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from airground.core.arrays import F64


@njit(cache=True, nogil=True, error_model="numpy")
def eliminate_chain(
    chain: F64, links: F64, coupling: F64, gradient: F64, poses: F64, toward: F64
) -> tuple[F64, F64]:
    """Take velocities and biases out of the poses' equations.

    Args:
        chain: (F, 9, 9) blocks on the diagonal.
        links: (F, 9, 9) blocks between k and k + 1; the last is not read.
        coupling: (F, 9, 18) blocks with the poses k - 1, k and k + 1.
        gradient: (F, 9) gradient of velocities and biases.
        poses: (6 F, 6 F) matrix of the poses, whose upper triangle is reduced.
        toward: (6 F,) gradient of the poses, reduced.

    Returns:
        (F, 9, 6 F) and (F, 9): the matrix Z and vector z with which velocities and biases
        follow a step of the poses, -(z + Z step).

    Raises:
        LinAlgError: The chain is not positive definite.
    """
    count, width = len(chain), len(toward)
    spread, offset = np.zeros((count, 9, width)), np.zeros((count, 9))
    inverses, belows = np.empty((count, 9, 9)), np.zeros((count, 9, 9))
    for k in range(count):
        left, right = _columns(k, count)
        spread[k, :, left:right] = coupling[k, :, left - 6 * k + 6 : right - 6 * k + 6]
        offset[k] = gradient[k]
        block = chain[k].copy()
        if k > 0:
            belows[k] = links[k - 1].T @ inverses[k - 1].T
            block -= belows[k] @ belows[k].T
            spread[k] -= belows[k] @ spread[k - 1]
            offset[k] -= belows[k] @ offset[k - 1]
        inverses[k] = np.linalg.inv(np.linalg.cholesky(block))
        spread[k] = inverses[k] @ spread[k]
        offset[k] = inverses[k] @ offset[k]
    for k in range(count - 1, -1, -1):
        if k < count - 1:
            spread[k] -= belows[k + 1].T @ spread[k + 1]
            offset[k] -= belows[k + 1].T @ offset[k + 1]
        spread[k] = inverses[k].T @ spread[k]
        offset[k] = inverses[k].T @ offset[k]
    for k in range(count):
        left, right = _columns(k, count)
        back = coupling[k, :, left - 6 * k + 6 : right - 6 * k + 6].T.copy()
        # Of the poses' rows only what is right of the diagonal counts.
        poses[left:right, left:] -= back @ spread[k][:, left:].copy()
        toward[left:right] -= back @ offset[k]
    return spread, offset


@njit(cache=True, nogil=True, error_model="numpy")
def _columns(k: int, count: int) -> tuple[int, int]:
    """Columns of the poses k - 1 to k + 1."""
    return max(0, 6 * k - 6), min(6 * count, 6 * k + 12)


@njit(cache=True, nogil=True, error_model="numpy")
def place(slot: int, moving: int, n: int) -> int:
    """Index of number n of a keyframe's 15 among the unknowns."""
    return 6 * slot + n if n < 6 else 6 * moving + 9 * slot + n - 6
