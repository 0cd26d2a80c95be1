"""Slow, obvious twins of the cost kernels."""

import numpy as np


def cost(aerial, ground, config, aerial_cells, cells_per_m):
    """The cost of two equally large pieces with NaN in holes."""
    pairs = [
        (a, g)
        for a, g in zip(aerial.ravel(), ground.ravel(), strict=True)
        if np.isfinite(a) and np.isfinite(g)
    ]
    if not pairs or len(pairs) <= config.min_overlap * aerial_cells:
        return np.nan
    a, g = np.array(pairs, np.float64).T
    if config.cost == "zmssd":
        return (((a - a.mean()) - (g - g.mean())) ** 2).sum() / (2 * len(a))
    spread = [max(h.std(), config.min_relief_m) for h in (a, g)]
    correlation = ((a - a.mean()) * (g - g.mean())).mean() / (spread[0] * spread[1])
    if config.cost == "ncc":
        return 1.0 - correlation
    patches = len(a) / (config.patch_m * cells_per_m) ** 2
    return patches / 2 * np.log(1 - min(max(correlation, 0.0), 0.999) ** 2)


def cell(heights, ix, iy):
    """The height of a cell, NaN outside of the map."""
    nx, ny = heights.shape
    return heights[ix, iy] if 0 <= ix < nx and 0 <= iy < ny else np.nan


def piece(heights, first, shape):
    """Cells from `first` on, NaN outside of the map."""
    out = np.full(shape, np.nan)
    for ix, iy in np.ndindex(*shape):
        out[ix, iy] = cell(heights, first[0] + ix, first[1] + iy)
    return out


def bilinear(heights, x, y):
    """Mean of the filled cells around by their weights; NaN where these are below a half."""
    ix, iy = int(np.floor(x)), int(np.floor(y))
    total, weight = 0.0, 0.0
    for jx, jy in ((ix, iy), (ix, iy + 1), (ix + 1, iy), (ix + 1, iy + 1)):
        height = cell(heights, jx, jy)
        if np.isfinite(height):
            w = (1 - abs(x - jx)) * (1 - abs(y - jy))
            total, weight = total + w * height, weight + w
    return total / weight if weight >= 0.5 else np.nan
