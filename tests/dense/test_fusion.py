"""Eq. 1: the prox against a numerical minimizer, the step against loops, the energy falls."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from airground.dense import fusion
from airground.dense.fusion import Fusion, prox


def bin_centres(bins: int) -> NDArray[np.float64]:
    """(bins,) values c_j of the bins, evenly spaced in [-1, 1]."""
    return (2 * np.arange(bins) + 1) / bins - 1.0


CENTRES = bin_centres(8)


def pack(counts: NDArray) -> NDArray[np.uint32]:
    """(..., 8) counts into words."""
    return (counts.astype(np.uint32) << (4 * np.arange(8, dtype=np.uint32))).sum(-1).astype("u4")


def energy(phi: NDArray, counts: NDArray, weight: float) -> float:
    """Eq. 1 by its definition, forward differences, zero at the far faces."""
    squares = np.zeros(phi.shape)
    for axis in range(3):
        step = np.diff(phi.astype(float), axis=axis)
        padding = [(0, int(a == axis)) for a in range(3)]
        squares += np.pad(step, padding) ** 2
    data = (counts * np.abs(phi[..., None].astype(float) - CENTRES)).sum()
    return float(np.sqrt(squares).sum() + weight * data)


def slow_fuse(counts: NDArray, weight: float, iterations: int) -> NDArray[np.float64]:
    """Chambolle-Pock on Eq. 1 with a numerical prox: the definition, for small volumes."""
    votes = counts.sum(-1)
    mean = (counts * CENTRES).sum(-1) / np.maximum(votes, 1)
    phi = np.where(votes > 0, mean, -1.0)
    ahead, dual, step = phi.copy(), np.zeros((3, *phi.shape)), 1 / np.sqrt(12)
    for _ in range(iterations):
        for axis in range(3):
            padding = [(0, int(a == axis)) for a in range(3)]
            dual[axis] += step * np.pad(np.diff(ahead, axis=axis), padding)
        dual /= np.maximum(1, np.sqrt((dual**2).sum(0)))
        divergence = np.zeros_like(phi)
        for axis in range(3):
            padding = [(int(a == axis), 0) for a in range(3)]
            part = np.delete(dual[axis], -1, axis=axis)
            divergence += dual[axis] - np.pad(part, padding)
        # candidates of the piecewise quadratic: the kinks and the zeros between them
        v, old = phi + step * divergence, phi
        candidates = [np.full_like(v, c) for c in CENTRES]
        for k in range(9):
            candidates.append(
                v - step * weight * (counts[..., :k].sum(-1) - counts[..., k:].sum(-1))
            )
        stack = np.stack(candidates)
        data = np.abs(stack[..., None] - CENTRES) * counts
        costs = 0.5 * (stack - v) ** 2 + step * weight * data.sum(-1)
        phi = np.take_along_axis(stack, costs.argmin(0)[None], 0)[0]
        ahead = 2 * phi - old
    return phi


@settings(max_examples=60, deadline=None)
@given(
    counts=st.lists(st.integers(0, 15), min_size=2, max_size=8),
    v=st.floats(-3, 3),
    weight=st.floats(0.001, 1.0),
)
def test_prox_equals_a_numerical_minimizer(counts: list[int], v: float, weight: float) -> None:
    centres = bin_centres(len(counts))

    def objective(u: float) -> float:
        return 0.5 * (u - v) ** 2 + weight * float((counts * np.abs(u - centres)).sum())

    found = minimize_scalar(objective, bounds=(-80, 80), method="bounded", options={"xatol": 1e-9})
    kinks = min(centres, key=objective)
    best = min(found.x, kinks, key=objective)
    word = pack(np.pad(counts, (0, 8 - len(counts))))
    spacing = np.float32(2 / len(counts))
    assert prox(np.float32(v), word, np.float32(weight), spacing) == pytest.approx(best, abs=2e-4)


@pytest.mark.kernel
@pytest.mark.parametrize("rows", [1, 5, 32, 53])  # of one block, of whole blocks, of a longer last
@pytest.mark.parametrize("iterations", [1, 4, 7])
def test_fusion_equals_the_loops(rows: int, iterations: int) -> None:
    rng = np.random.default_rng(0)
    counts = rng.integers(0, 4, (rows, 6, 9, 8)) * (rng.random((rows, 6, 9, 1)) > 0.3)
    fast = Fusion(0.26, iterations).fuse(pack(counts))
    np.testing.assert_allclose(fast, slow_fuse(counts, 0.26, iterations), atol=2e-5)


@pytest.mark.parametrize("at_once", [1, 3, 8])
def test_iterations_in_one_pass_change_no_bit(
    at_once: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = np.random.default_rng(3).integers(0, 2**32, (77, 5, 20), dtype=np.uint32)
    usual = Fusion(0.26, 8).fuse(words).copy()
    monkeypatch.setattr(fusion, "AT_ONCE", at_once)
    np.testing.assert_array_equal(Fusion(0.26, 8).fuse(words), usual)


def test_energy_falls_with_iterations() -> None:
    rng = np.random.default_rng(1)
    depth = np.arange(20)[None, :, None]
    field = np.clip((10 - depth + rng.normal(0, 2, (16, 1, 24))) / 5, -1, 0.999)
    index = ((field + 1) * 4).astype(int)
    counts = sum(np.eye(8, dtype=int)[np.roll(index, i, axis=0)] for i in range(4))
    words = pack(counts)
    energies = [energy(Fusion(0.26, n).fuse(words), counts, 0.26) for n in (0, 2, 8, 32, 128)]
    assert energies == sorted(energies, reverse=True)
    assert energies[-1] < 0.9 * energies[0]


def test_memory_is_reused_without_a_trace() -> None:
    rng = np.random.default_rng(2)
    first, second = (rng.integers(0, 2**32, (4, 5, 6), dtype=np.uint32) for _ in range(2))
    keeper = Fusion(0.26, 4)
    keeper.fuse(first)
    again = keeper.fuse(second).copy()
    assert np.array_equal(again, Fusion(0.26, 4).fuse(second))
    assert fusion.STEP**2 * 12 <= 1 + 1e-12
