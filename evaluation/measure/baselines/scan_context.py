"""Scan context (Kim and Kim, IROS 2018) of height maps: a descriptor for the global search.

A place is described by the heights in rings and sectors around it. Moments of each ring, which no
turn changes, select candidates among all cells of the ground map; sectors, shifted against each
other, decide between candidates and give the heading. Two things differ from lidar scans: the
datum of the heights is unknown, so that they are compared about their means, and both maps have
holes, which are left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from airground.core.belief import HeightMap
from airground.core.height_map import lattice_index
from airground.localization.height_map_pair import HeightMapPair
from airground.localization.particle_filter import motion_at
from airground.pipeline import pair_of
from evaluation.measure.baselines.height_search import MIN_OVERLAP
from evaluation.measure.baselines.interface import Answer, Given
from evaluation.measure.baselines.registration import MAX_TURN_DEG
from evaluation.setup.setups import with_localization

RINGS, SECTORS = 20, 180
"""The original has 20 rings and 60 sectors; a sector of 2 degrees gives the heading within 1."""
COVERED = 0.8
"""Share of the aerial map's cells within the outermost ring; corners reach farther."""
CANDIDATES = 2_000
"""Cells whose sectors are compared: about a tenth of a search region of 6 x 6 m at 25 cells/m."""
MIN_LIKENESS = 0.7
"""Least correlation of the descriptors for a claim. Over two flights, right places correlate by
0.80 to 0.86, and the best places in the map of another scene by 0.39 to 0.59 (12 maps each)."""
MIN_RING_SHARE = 0.25
"""Least share of a ring that must be filled for its moments to count."""
MIN_RINGS = RINGS // 2
"""Least number of rings with moments in both maps."""


def scan_context(given: Given) -> Answer:
    """The cell and the turn where the descriptors of both maps correlate best.
    Claimed if they do so clearly, with the relief that ours demands of height maps."""
    settings = with_localization(given.config, heading="search", min_overlap=MIN_OVERLAP)
    maps = pair_of(given.sighting, settings)
    if not (maps.aerial.filled_cells and maps.ground.filled_cells):
        return Answer(None, "a height map is empty")
    grid = PolarGrid.around(maps.aerial)
    cells = candidates(maps, grid)
    found = best_of(maps, grid, cells, allowed_turns(given))
    if found is None:
        return Answer(None, f"nowhere do the descriptors overlap by {MIN_OVERLAP:.0%}")
    estimate, likeness, relief_m = found
    offset = float(maps.overlay(estimate[None]).height_offsets()[0])
    T_ground_mav = motion_at(estimate, given.sighting.surface.T_mav_camera.translation, offset)
    local = given.config.localization
    if relief_m < local.min_relief_m:
        return Answer(T_ground_mav, f"heights differ by {relief_m:.3f} m only")
    if likeness < MIN_LIKENESS:
        return Answer(T_ground_mav, f"the descriptors correlate by {likeness:.2f} only")
    return Answer(T_ground_mav)


def allowed_turns(given: Given) -> NDArray[np.bool_]:
    """(SECTORS,) which turns of `mav` in `ground` the magnetometers allow; all if unknown."""
    heading = given.sighting.heading
    if heading is None or given.config.localization.heading == "search":
        return np.ones(SECTORS, np.bool_)
    turns = 2 * np.pi * np.arange(SECTORS) / SECTORS
    off = np.abs(np.angle(np.exp(1j * (turns - heading))))
    return np.asarray(off <= np.deg2rad(MAX_TURN_DEG))


@dataclass(frozen=True, eq=False)
class PolarGrid:
    """Rings and sectors around a cell.

    Attributes:
        ring: (2n + 1, 2n + 1) ring of each cell around the middle; RINGS outside.
        samples: (RINGS, SECTORS, 2) offset of the cell in the middle of each bin [cells].
    """

    ring: NDArray[np.int64]
    samples: NDArray[np.int64]

    @property
    def reach(self) -> int:
        """Offset of the farthest cells [cells]."""
        return len(self.ring) // 2

    @classmethod
    def around(cls, aerial: HeightMap) -> PolarGrid:
        """Rings that cover most of an aerial map, in equal steps from the camera."""
        filled = np.argwhere(np.isfinite(aerial.heights)) + lattice_index(aerial)
        radius = max(float(np.quantile(np.linalg.norm(filled, axis=1), COVERED)), 1.0)
        reach = int(np.ceil(radius))
        along = np.arange(-reach, reach + 1)
        ring = np.floor(np.hypot(*np.meshgrid(along, along, indexing="ij")) * RINGS / radius)
        middles = (np.arange(RINGS) + 0.5) * radius / RINGS
        turns = 2 * np.pi * np.arange(SECTORS) / SECTORS
        samples = middles[:, None, None] * np.stack([np.cos(turns), np.sin(turns)], axis=-1)
        return cls(np.minimum(ring, RINGS).astype(np.int64), np.rint(samples).astype(np.int64))


def candidates(maps: HeightMapPair, grid: PolarGrid) -> NDArray[np.int64]:
    """(N, 2) lattice cells of the search region with the most similar rings, best first."""
    robot, radius_m = maps.ground_robot_position, maps.config.localization.search_radius_m
    scale = maps.ground.cells_per_m
    first = np.ceil((robot - radius_m) * scale).astype(np.int64)
    last = np.floor((robot + radius_m) * scale).astype(np.int64)
    ground = _window(maps.ground, first - grid.reach, last + grid.reach)
    aerial = _window(maps.aerial, np.full(2, -grid.reach), np.full(2, grid.reach))
    (mean_a, spread_a), (mean_g, spread_g) = _moments(aerial, grid), _moments(ground, grid)
    means, spreads = mean_g - mean_a, spread_g - spread_a
    known = np.isfinite(means)
    count = known.sum(axis=0)
    datum = np.where(known, means, 0).sum(axis=0) / np.maximum(count, 1)
    unlike = np.where(known, (means - datum) ** 2 + spreads**2, 0).sum(axis=0)
    unlike = np.where(count >= MIN_RINGS, unlike / np.maximum(count, 1), np.inf)
    order = np.argsort(unlike, axis=None, kind="stable")[:CANDIDATES]
    order = order[np.isfinite(unlike.ravel()[order])]
    return first + np.stack(np.unravel_index(order, unlike.shape), axis=1)


def _moments(heights: NDArray, grid: PolarGrid) -> tuple[NDArray, NDArray]:
    """Mean and standard deviation of the heights in each ring around each cell whose rings lie in
    the window: two arrays (RINGS, nx, ny) [m], NaN where too little of the ring is filled."""
    shape = [fft.next_fast_len(n, real=True) for n in heights.shape]
    filled = np.isfinite(heights)
    mean_height = float(heights[filled].mean()) if filled.any() else 0.0
    about = np.where(filled, heights - mean_height, 0).astype(np.float32)
    spectra = [fft.rfft2(image, shape) for image in (filled.astype(np.float32), about, about**2)]
    inside = tuple(slice(0, n - 2 * grid.reach) for n in heights.shape)
    means, spreads = [], []
    for index in range(RINGS):
        ring = grid.ring == index
        kernel = np.conj(fft.rfft2(ring.astype(np.float32), shape))
        count, total, squares = (fft.irfft2(s * kernel, shape)[inside] for s in spectra)
        enough = count > max(MIN_RING_SHARE * ring.sum(), 0.5)
        count = np.where(enough, count, np.nan)
        means.append(total / count)
        spreads.append(np.sqrt(np.maximum(squares / count - means[-1] ** 2, 0)))
    return np.stack(means) + mean_height, np.stack(spreads)


def best_of(
    maps: HeightMapPair, grid: PolarGrid, cells: NDArray, allowed: NDArray[np.bool_]
) -> tuple[NDArray[np.float64], float, float] | None:
    """Pose (x, y [m], turn [rad]) of the best candidate, its correlation, and the smaller standard
    deviation of both descriptors [m]; None where too little overlaps.

    Sums over bins count by their area. Each is a correlation over the sectors, of all shifts at
    once by the frequency domain (as in `airground.localization.cost_map`)."""
    if len(cells) == 0:
        return None
    reach = np.full(2, grid.reach)
    low = cells.min(axis=0) - reach
    around = _window(maps.ground, low, cells.max(axis=0) + reach)
    x, y = np.moveaxis(cells[:, None, None] - low + grid.samples, -1, 0)
    aerial = _window(maps.aerial, -reach, reach)[tuple(np.moveaxis(grid.samples + reach, -1, 0))]
    area = (np.arange(RINGS, dtype=np.float32) + 0.5)[:, None] / RINGS
    sums = _shifted_sums(aerial, around[x, y], area)
    total = float((np.isfinite(aerial) * area).sum())
    enough = (sums[0] > max(MIN_OVERLAP * total, 1e-6)) & allowed
    if not enough.any():
        return None
    count = np.where(enough, sums[0], np.nan)
    mean_a, mean_g = sums[1] / count, sums[2] / count
    variance = np.minimum(sums[3] / count - mean_a**2, sums[4] / count - mean_g**2)
    product = (sums[3] / count - mean_a**2) * (sums[4] / count - mean_g**2)
    likeness = (sums[5] / count - mean_a * mean_g) / np.sqrt(np.maximum(product, 1e-12))
    which, shift = np.unravel_index(int(np.nanargmax(likeness)), likeness.shape)
    turn = float(np.angle(np.exp(2j * np.pi * shift / SECTORS)))
    estimate = np.array([*(cells[which] / maps.ground.cells_per_m), turn])
    relief_m = float(np.sqrt(max(variance[which, shift], 0.0)))
    return estimate, float(likeness[which, shift]), relief_m


def _shifted_sums(aerial: NDArray, ground: NDArray, area: NDArray) -> list[NDArray[np.float64]]:
    """Sums over the bins that both have, for each of N places and each shift, (N, SECTORS) each:
    area, aerial heights, ground heights, their squares, and their product; about the means."""
    one_a, a_, aa = (np.conj(fft.rfft(area * image)) for image in _masked(aerial))
    one_g, g_, gg = (fft.rfft(image) for image in _masked(ground))
    pairs = ((one_a, one_g), (a_, one_g), (one_a, g_), (aa, one_g), (one_a, gg), (a_, g_))
    return [fft.irfft((left * right).sum(axis=1), SECTORS) for left, right in pairs]


def _masked(heights: NDArray) -> tuple[NDArray[np.float32], ...]:
    """Mask of the filled bins, heights about their mean with 0 in holes, and their squares."""
    filled = np.isfinite(heights)
    mean = heights[filled].mean() if filled.any() else 0.0
    about = np.where(filled, heights - mean, 0).astype(np.float32)
    return filled.astype(np.float32), about, about**2


def _window(heights: HeightMap, first: NDArray, last: NDArray) -> NDArray[np.float64]:
    """Heights of the lattice cells from `first` to `last`, NaN outside the map."""
    start = lattice_index(heights)
    window = np.full(tuple(last - first + 1), np.nan)
    low, high = np.maximum(first, start), np.minimum(last, start + heights.heights.shape - 1)
    if (low <= high).all():
        there = tuple(slice(a, b + 1) for a, b in zip(low - first, high - first, strict=True))
        here = tuple(slice(a, b + 1) for a, b in zip(low - start, high - start, strict=True))
        window[there] = heights.heights[here]
    return window
