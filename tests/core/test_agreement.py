"""Agreement beyond chance: what it accepts, and what shifting gives away."""

import numpy as np

from airground.core.agreement import agreement
from airground.core.belief import HeightMap

CELLS_PER_M = 25.0


def map_of(heights, first=(0, 0)):
    return HeightMap(heights.astype(np.float32), np.array(first) / CELLS_PER_M, CELLS_PER_M)


def blocks(rng, n=100, size=10):
    """A floor with blocks of random heights on a third of it."""
    coarse = rng.uniform(0.2, 1.0, (n // size, n // size))
    coarse[rng.random(coarse.shape) < 0.66] = 0.0
    return np.kron(coarse, np.ones((size, size)))


def test_the_right_place_agrees_and_a_wrong_heap_does_not():
    rng = np.random.default_rng(0)
    truth, other = blocks(rng), blocks(rng)
    aerial = truth[20:80, 30:90] + 0.7 + rng.normal(0, 0.005, (60, 60))
    aerial[rng.random(aerial.shape) < 0.1] = np.nan
    right = agreement(map_of(aerial, (20, 30)), map_of(truth))
    wrong = agreement(map_of(aerial, (20, 30)), map_of(other))
    assert right.share > 0.99
    assert right.kappa > 0.9
    assert wrong.kappa < 0.1


def test_nothing_agrees_beyond_chance_where_a_shift_does_not_matter():
    rng = np.random.default_rng(1)
    x, _ = np.meshgrid(np.arange(100.0), np.arange(100.0), indexing="ij")
    ridge = 0.3 * np.sin(x / 6)
    for surface in (np.zeros((100, 100)), 0.02 * x, ridge):
        aerial = surface[20:80, 20:80] + rng.normal(0, 0.005, (60, 60))
        assert agreement(map_of(aerial, (20, 20)), map_of(surface)).kappa < 0.05


def test_no_overlap_agrees_with_nothing():
    flat = map_of(np.zeros((20, 20)))
    apart = agreement(flat, map_of(np.zeros((20, 20)), (500, 0)))
    assert (apart.cells, apart.share) == (0, 0.0)
    assert apart.kappa <= 0
