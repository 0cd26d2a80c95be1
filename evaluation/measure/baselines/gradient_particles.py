"""Gradients of height maps, matched by particles in clusters.

The idea of Werner et al. ("Kilometer-Scale GNSS-Denied UAV Navigation via Heightmap Gradients",
2025), who won the SPRIN-D challenge by it: slopes need no common datum, and clusters keep several
places in question until the evidence decides. Theirs follows odometry over kilometres; here, as for
all baselines, one aerial map must do, and rounds of growing sharpness take the place of time.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from airground.core.belief import HeightMap
from airground.core.height_map import lattice_index
from airground.localization.height_map_pair import HeightMapPair
from airground.localization.particle_filter import motion_at
from airground.localization.particles import mean_pose
from airground.pipeline import pair_of
from evaluation.measure.baselines.height_search import MIN_OVERLAP
from evaluation.measure.baselines.interface import Answer, Given
from evaluation.measure.baselines.registration import MAX_TURN_DEG
from evaluation.setup.setups import with_localization

BLURS_M = (0.12, 0.12, 0.08, 0.05, 0.05)
"""Standard deviation of the Gaussian that blurs both maps in each round [m]: edges of boxes are two
cells wide, and a particle beside them would feel nothing."""
NOISE_M = (0.0, 0.08, 0.06, 0.03, 0.015)
NOISE_DEG = (0.0, 3.0, 2.0, 1.0, 0.5)
"""Noise per axis that spreads the particles before each round; the first are drawn uniformly."""
PARTICLES_PER_DEG = 150
"""Particles of the first round for each degree of heading in question: over 6 x 6 m one for each
square of 0.1 m and 2.4 degrees."""
PARTICLES = 1_600
CLUSTERS = 8
"""Largest number of places in question; each has the same number of particles."""
CLUSTER_M, CLUSTER_DEG = 0.3, 10.0
"""Particles as near to a cluster's best one belong to it."""
SHARPNESS = 0.05
"""Difference of correlation that makes a particle e times as likely."""
MIN_CELLS = 50


@dataclass(frozen=True, eq=False)
class Slopes:
    """Gradients of a blurred height map at its filled cells.

    Attributes:
        field: (2, nx, ny) float32 slope along x and y, without unit; NaN where unknown.
        first: (2,) lattice index of its first cell.
    """

    field: NDArray[np.float32]
    first: NDArray[np.int64]

    @classmethod
    def of(cls, heights: HeightMap, blur_m: float) -> Slopes:
        """Of a map blurred without its holes; defined where a cell and its neighbours are."""
        filled = np.isfinite(heights.heights)
        mean = np.float32(heights.heights[filled].mean()) if filled.any() else np.float32(0)
        about = np.where(filled, heights.heights - mean, 0).astype(np.float32)
        sigma = blur_m * heights.cells_per_m
        weight = cv2.GaussianBlur(filled.astype(np.float32), (0, 0), sigma)
        blurred = cv2.GaussianBlur(about, (0, 0), sigma) / np.maximum(weight, 1e-6)
        blurred[~filled] = np.nan
        field = np.full((2, *blurred.shape), np.nan, np.float32)
        half = np.float32(heights.cells_per_m / 2)
        field[0, 1:-1] = (blurred[2:] - blurred[:-2]) * half
        field[1, :, 1:-1] = (blurred[:, 2:] - blurred[:, :-2]) * half
        field[:, np.isnan(field).any(axis=0) | ~filled] = np.nan
        return cls(field, lattice_index(heights))

    def cells(self) -> NDArray[np.float32]:
        """(N, 4) x, y from the origin of the lattice [cells], and the slope there."""
        places = np.argwhere(np.isfinite(self.field[0]))
        slopes = self.field[:, places[:, 0], places[:, 1]].T
        return np.hstack([places + self.first, slopes]).astype(np.float32)


def gradient_particles(given: Given) -> Answer:
    """The cluster of particles where the gradients of both maps correlate best.
    Claimed if it outweighs all others together by the share that ours demands of its mode, at the
    correlation and the relief that ours demands of heights."""
    settings = with_localization(given.config, heading="search", min_overlap=MIN_OVERLAP)
    maps = pair_of(given.sighting, settings)
    particles = first_particles(given, maps)
    clusters: list[NDArray[np.float64]] = []
    for blur_m, noise_m, noise_deg in zip(BLURS_M, NOISE_M, NOISE_DEG, strict=True):
        if clusters:
            particles = _spread(clusters, noise_m, noise_deg, given.rng)
        aerial, ground = Slopes.of(maps.aerial, blur_m), Slopes.of(maps.ground, blur_m)
        cells = aerial.cells()
        if len(cells) < MIN_CELLS:
            return Answer(None, f"the aerial height map has {len(cells)} slopes")
        clusters = clustered(particles, likenesses(particles, cells, ground, maps))
        if not clusters:
            return Answer(None, f"no particle overlaps by {MIN_OVERLAP:.0%}")
    return _answer(given, maps, clusters)


def first_particles(given: Given, maps: HeightMapPair) -> NDArray[np.float64]:
    """(M, 3) x, y [m] and turn of `mav` [rad], uniform over what is in question."""
    heading, middle = given.sighting.heading, maps.ground_robot_position
    half_deg = MAX_TURN_DEG
    if heading is None or given.config.localization.heading == "search":
        heading, half_deg = 0.0, 180.0
    radius_m = maps.config.localization.search_radius_m
    half = np.array([radius_m, radius_m, np.deg2rad(half_deg)])
    count = int(2 * half_deg * PARTICLES_PER_DEG)
    return np.array([*middle, heading]) + given.rng.uniform(-half, half, (count, 3))


def likenesses(
    particles: NDArray, cells: NDArray, ground: Slopes, maps: HeightMapPair
) -> NDArray[np.float64]:
    """(M,) correlation of the slopes at each particle, NaN where too little overlaps."""
    poses = particles.copy()
    poses[:, :2] = particles[:, :2] * maps.ground.cells_per_m - ground.first
    return _correlate(poses, cells, ground.field, MIN_OVERLAP * len(cells))


@njit(cache=True, nogil=True, error_model="numpy")
def _correlate(poses, cells, field, least):  # type: ignore[no-untyped-def]
    """Sum of the products of slopes over the root of the product of their squares' sums."""
    found = np.full(len(poses), np.nan)
    for index in range(len(poses)):
        x, y, turn = poses[index]
        c, s = np.cos(turn), np.sin(turn)
        count, both, aerial, ground = 0, 0.0, 1e-12, 1e-12
        for cell in range(len(cells)):
            px, py, ax, ay = cells[cell]
            ix = int(np.floor(x + c * px - s * py + 0.5))
            iy = int(np.floor(y + s * px + c * py + 0.5))
            if ix < 0 or iy < 0 or ix >= field.shape[1] or iy >= field.shape[2]:
                continue
            gx, gy = field[0, ix, iy], field[1, ix, iy]
            if np.isnan(gx):
                continue
            count += 1
            both += (c * ax - s * ay) * gx + (s * ax + c * ay) * gy
            aerial += ax * ax + ay * ay
            ground += gx * gx + gy * gy
        if count > least:
            found[index] = both / np.sqrt(aerial * ground)
    return found


def clustered(particles: NDArray, likeness: NDArray) -> list[NDArray[np.float64]]:
    """Clusters (K, 4) of particles and their likeness, in the order of their best particle, which
    comes first in each. A particle joins the first cluster whose best particle is near."""
    known = np.isfinite(likeness)
    ranked = np.column_stack([particles, likeness])[known]
    ranked = ranked[np.argsort(-ranked[:, 3], kind="stable")]
    clusters: list[NDArray[np.float64]] = []
    while len(ranked) and len(clusters) < CLUSTERS:
        apart_m = np.linalg.norm(ranked[:, :2] - ranked[0, :2], axis=1)
        turned = np.abs(np.angle(np.exp(1j * (ranked[:, 2] - ranked[0, 2]))))
        near = (apart_m < CLUSTER_M) & (turned < np.deg2rad(CLUSTER_DEG))
        clusters.append(ranked[near])
        ranked = ranked[~near]
    return clusters


def _spread(
    clusters: list[NDArray[np.float64]], noise_m: float, noise_deg: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """(PARTICLES, 3) particles drawn by weight within each cluster, and moved by noise."""
    each = PARTICLES // len(clusters)
    drawn = [
        members[rng.choice(len(members), each, p=_weights(members)), :3] for members in clusters
    ]
    sigma = np.array([noise_m, noise_m, np.deg2rad(noise_deg)])
    return np.concatenate(drawn) + rng.normal(0, sigma, (each * len(clusters), 3))


def _weights(members: NDArray) -> NDArray[np.float64]:
    weight = np.exp((members[:, 3] - members[0, 3]) / SHARPNESS)
    return np.asarray(weight / weight.sum())


def _answer(given: Given, maps: HeightMapPair, clusters: list[NDArray[np.float64]]) -> Answer:
    best = clusters[0]
    # Those nearly as likely as the best; their mean is finer than any single one.
    near = best[best[:, 3] > best[0, 3] - SHARPNESS / 2]
    estimate = mean_pose(near[:, :3])
    overlay = maps.overlay(estimate[None])
    offset = float(overlay.height_offsets()[0])
    T_ground_mav = motion_at(estimate, given.sighting.surface.T_mav_camera.translation, offset)
    peaks = np.array([members[0, 3] for members in clusters])
    share = 1 / np.exp((peaks - peaks[0]) / SHARPNESS).sum()
    local = given.config.localization
    if overlay.reliefs()[0] < local.min_relief_m:
        return Answer(T_ground_mav, f"heights differ by {overlay.reliefs()[0]:.3f} m only")
    if peaks[0] < local.min_correlation:
        return Answer(T_ground_mav, f"the slopes correlate by {peaks[0]:.2f} only")
    if share < local.min_mode_share:
        return Answer(T_ground_mav, f"the best cluster has {share:.0%} of the weight")
    return Answer(T_ground_mav)
