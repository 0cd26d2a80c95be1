"""Paths along rows and columns against the recurrence as it is written in the paper."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from airground.config import PlaneSweep as Parameters
from airground.dense.aggregation import MEAN_SCALE
from airground.dense.plane_sweep import Workspace
from airground.dense.semiglobal import smooth

PARAMETERS = Parameters(step_penalty=0.5, jump_penalty=5.0, edge_levels=5.0)


def slow_smooth(mean: NDArray, image: NDArray, parameters: Parameters) -> NDArray:
    """L(p, d) = C(p, d) + min(L(q, d), L(q, d +- 1) + step, min L(q) + jump) - min L(q)."""
    height, width, planes = mean.shape
    total = np.zeros(mean.shape, np.int64)
    step = int(MEAN_SCALE * parameters.step_penalty)
    for dy, dx in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        path = np.zeros(mean.shape, np.int64)
        ys = range(height) if dy >= 0 else range(height - 1, -1, -1)
        for y in ys:
            for x in range(width) if dx >= 0 else range(width - 1, -1, -1):
                by, bx = y - dy, x - dx
                cost = mean[y, x].astype(np.int64)
                if not (0 <= by < height and 0 <= bx < width):
                    path[y, x] = cost
                    continue
                before = path[by, bx]
                change = abs(float(image[y, x]) - float(image[by, bx]))
                jump = max(
                    int(
                        MEAN_SCALE * parameters.jump_penalty / (1 + change / parameters.edge_levels)
                    ),
                    step,
                )
                padded = np.pad(before, 1, constant_values=10**6)
                options = [before, padded[:-2] + step, padded[2:] + step]
                options.append(np.full(planes, before.min() + jump))
                path[y, x] = cost + np.min(options, axis=0) - before.min()
        total += path
    return total


@pytest.mark.kernel
def test_smoothing_equals_the_recurrence() -> None:
    rng = np.random.default_rng(0)
    mean = rng.integers(0, 5120, (9, 37, 12)).astype(np.uint16)
    image = rng.uniform(0, 60, (9, 37)).astype(np.float32)
    fast = smooth(mean, image, PARAMETERS, Workspace())
    # an edge's penalty may round the other way in single precision
    assert np.abs(fast.astype(int) - slow_smooth(mean, image, PARAMETERS)).max() <= 4


def test_sum_of_four_paths_cannot_overflow() -> None:
    parameters = Parameters()
    highest = 4 * MEAN_SCALE * (parameters.truncation + parameters.jump_penalty)
    assert highest < 65536


def test_a_weak_patch_takes_the_plane_of_its_surroundings() -> None:
    planes = np.arange(20)
    mean = np.broadcast_to(np.abs(planes - 12) * 200, (15, 15, 20)).astype(np.uint16)
    mean[5:10, 5:10] = 300
    mean[7, 7, 3] = 250
    image = np.full((15, 15), 100, np.float32)
    assert (smooth(mean, image, PARAMETERS, Workspace()).argmin(2) == 12).all()
