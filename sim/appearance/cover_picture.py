"""Lit pictures of the small stones and leaves that cover natural ground."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.appearance.bake_light import LightBaker
from sim.appearance.ground_picture import LEAF_GREENS, STONES, noise_in_space
from sim.appearance.sheet import Colour, faded
from sim.geometry.ground_cover import GroundCover, patch_normals

PATCH_PX = 24
"""Side of the picture of a patch [px]: 2 to 5 mm each on a stone, finer than either camera sees."""
_APART_M = 50.0
"""Stones lie so far apart in the noise that colours them, so that no two look alike [m]."""


def lit_patches(
    cover: GroundCover, texture: float, baker: LightBaker, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """(P, PATCH_PX, PATCH_PX, 3) pictures in the order of `cover.patches`."""
    groups = cover.patches()
    stones, leaves = _stones(_stretched(groups[0]), rng), _leaves(_stretched(groups[1]), rng)
    painted = stones, leaves, leaves[:, ::-1]
    lit = [
        faded(pixels, texture) * _stretched(_light(patches, baker))
        for patches, pixels in zip(groups, painted, strict=True)
    ]
    return np.clip(np.concatenate(lit) + 0.5, 0, 255).astype(np.uint8)


def _light(patches: NDArray, baker: LightBaker) -> NDArray[np.float32]:
    """(K, rows, columns, 3) light factors at the nodes of patches."""
    if len(patches) == 0:
        return np.empty(patches.shape, np.float32)
    light = baker.shade(patches.reshape(-1, 3), patch_normals(patches).reshape(-1, 3))
    return light.reshape(patches.shape)


def _stretched(values: NDArray) -> NDArray[np.float32]:
    """(K, PATCH_PX, PATCH_PX, 3) from values (K, rows, columns, 3) at the nodes of patches."""
    for axis in (1, 2):
        places = np.linspace(0, values.shape[axis] - 1, PATCH_PX)
        low = np.minimum(places.astype(int), values.shape[axis] - 2)
        share = (places - low).astype(np.float32).reshape((-1, 1) if axis == 2 else (-1, 1, 1))
        before, after = values.take(low, axis), values.take(low + 1, axis)
        values = before.astype(np.float32) * (1 - share) + after.astype(np.float32) * share
    return np.asarray(values, np.float32)


def _stones(nodes: NDArray, rng: np.random.Generator) -> NDArray[np.float32]:
    """(S, m, m, 3) mottled stone at points of the stones' surfaces [m]."""
    count = len(nodes)
    points = (nodes + rng.uniform(0, _APART_M, (count, 1, 1, 3))).reshape(-1, 3)
    tone = np.ones(len(points), np.float32)
    for cell_m, depth in ((0.03, 0.08), (0.009, 0.09), (0.0035, 0.08)):
        tone += depth * noise_in_space(points, cell_m, rng)
    colour = _drawn(STONES, count, 0.72, 1.12, rng)
    return (colour * tone.reshape(*nodes.shape[:3], 1)).astype(np.float32)


def _leaves(nodes: NDArray, rng: np.random.Generator) -> NDArray[np.float32]:
    """(L, m, m, 3) leaves with a pale rib along the middle row and mottled halves."""
    count, side = nodes.shape[:2]
    points = (nodes + rng.uniform(0, _APART_M, (count, 1, 1, 3))).reshape(-1, 3)
    mottle = 0.12 * noise_in_space(points, 0.012, rng).reshape(nodes.shape[:3])
    across = np.abs(np.linspace(-1, 1, side))
    rib = 0.35 * np.exp(-((across / 0.12) ** 2))
    tone = 1 + mottle + rib[None, :, None].astype(np.float32)
    colour = _drawn(LEAF_GREENS, count, 0.7, 1.15, rng)
    return (colour * tone[..., None]).astype(np.float32)


def _drawn(
    colours: tuple[Colour, ...], count: int, low: float, high: float, rng: np.random.Generator
) -> NDArray[np.float32]:
    """(count, 1, 1, 3) colours, one each, lighter or darker."""
    drawn = np.array(colours, np.float32)[rng.integers(len(colours), size=count)]
    return (drawn * rng.uniform(low, high, (count, 1)))[:, None, None].astype(np.float32)
