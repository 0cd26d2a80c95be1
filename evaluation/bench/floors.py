"""The floor of each row: the least data to move and arithmetic to do, whatever the program.
Counted are data that fit no cache (cost volumes, voxels), once in and once out of every pass that
the method needs, and the arithmetic of the method's inner loop. Cached data, indices, conversions
and comparisons are left out: the floor may be too low, never too high."""

from __future__ import annotations

import math

from pydantic import ConfigDict
from pydantic.dataclasses import dataclass

from evaluation.setup.checked_json import Amount

FLOAT, COST, COUNTS, POINT = 4, 2, 4, 12
"""Bytes of a float32, of a uint16 cost, of a voxel's packed histogram, of a point."""

STRICT = ConfigDict(extra="forbid")


@dataclass(frozen=True, config=STRICT)
class Speed:
    """The most that a number of cores can do, as probed: to and from memory, and in float32."""

    threads: int
    bandwidth_gb_s: Amount
    arithmetic_gflop_s: Amount

    def at_least(self, other: Speed) -> Speed:
        """The higher of both, figure by figure, for the same number of cores."""
        return Speed(
            self.threads,
            max(self.bandwidth_gb_s, other.bandwidth_gb_s),
            max(self.arithmetic_gflop_s, other.arithmetic_gflop_s),
        )


@dataclass(frozen=True, config=STRICT)
class Floor:
    """What any program must do for one call of a row: bytes of data that fit no cache, moved to
    and from memory, and float32 additions and multiplications."""

    bytes_moved: Amount
    operations: Amount

    def __add__(self, other: Floor) -> Floor:
        return Floor(self.bytes_moved + other.bytes_moved, self.operations + other.operations)

    def __mul__(self, count: float) -> Floor:
        return Floor(count * self.bytes_moved, count * self.operations)

    def least_ms(self, speed: Speed) -> float:
        """Its time where memory and arithmetic overlap perfectly [ms]."""
        memory = self.bytes_moved / speed.bandwidth_gb_s
        return 1e-6 * max(memory, self.operations / speed.arithmetic_gflop_s)


def add_frame(pixels: int, planes: int) -> Floor:
    """One view against all planes (Sec. V).
    The view has two columns for each of the reference: two interpolations across rows and one along
    the row make a sample; then difference and sum."""
    return Floor(2 * COST * pixels * planes, (3 * 3 + 2) * pixels * planes)


def depth_map(pixels: int, planes: int, sides: int, semiglobal: bool) -> Floor:
    """Window means over the sides, smoothing along four directions, and the minimum.
    Running sums take four operations per side, whatever the window. Smoothing needs a pass along
    rows and one along columns: each reads the means, and reads and writes the sums."""
    samples = pixels * planes
    window = Floor(COST * (sides + 1) * samples, (4 * sides + 2) * samples)
    smoothing = Floor(2 * 3 * COST * samples, 4 * 6 * samples)
    pick = Floor(COST * samples, samples)
    return window + smoothing + pick if semiglobal else window + pick


def distance_field(voxels: int) -> Floor:
    """One depth map into the histogram: a projection, a difference and a vote per voxel."""
    return Floor(2 * COUNTS * voxels, 14 * voxels)


def fusion(voxels: int, iterations: int, bins: int) -> Floor:
    """Eq. 1 by primal-dual steps (Chambolle and Pock 2011).
    phi, its extrapolation and three dual fields are read and written, and the counts read, once:
    rows can take any number of steps while they are in the cache. The prox takes a product, two
    sums, a minimum and a maximum per bin."""
    operations = 17 + 8 + 5 * bins
    return Floor((10 * FLOAT + COUNTS) * voxels, operations * iterations * voxels)


def ray_cast(voxels: int, pixels: int) -> Floor:
    """The sign of every voxel once; a crossing with its normal per pixel."""
    return Floor(FLOAT * voxels + (FLOAT + POINT) * pixels, 2 * voxels + 40 * pixels)


def transforms(cells: float, count: int) -> Floor:
    """Real Fourier transforms of maps that stay in the cache: 2.5 n log2 n each."""
    return Floor(0, 2.5 * cells * math.log2(cells) * count)


def cost_map(cells: int) -> Floor:
    """Eq. 2 at all offsets by masked correlations.
    Six transforms of values, squares and masks and three back: count, sum and sum of squares of the
    differences; six complex products. `cells` are those of the searched square, widened by the
    aerial map."""
    return transforms(cells, 9) + Floor(0, 6 * 6 * cells / 2)


def cost_map_channels(cells: float, channels: int, shifts: int) -> Floor:
    """The agreement of two maps in channels at all offsets, with shifts of their heights.
    Each channel of both maps is transformed; the share of each channel of both in the overlap and
    for each shift the agreement back. A shift takes a complex product and a sum per channel."""
    count = 4 * channels + shifts
    return transforms(cells, count) + Floor(0, 8 * channels * shifts * cells / 2)


def heading_search(cells: int, headings: int) -> Floor:
    """The cost map for many headings; the ground's three transforms are shared."""
    return transforms(cells, 3) + (transforms(cells, 6) + Floor(0, 18 * cells)) * headings


def particles(cells: int, count: int, turned: bool) -> Floor:
    """Six sums over the overlap at each particle, heights and mask interpolated.
    `cells` are the filled ones of the aerial map. If particles are `turned` by a heading, every
    cell has its own place and weights."""
    each = (7 + 7 + 1) + 10 + (8 + 6 if turned else 0)
    return Floor(0, each * cells * count)


def height_map(points: int, cells: int) -> Floor:
    """Every point read once; every cell written, and read again for its holes."""
    return Floor(POINT * points + 2 * FLOAT * cells, 6 * points)


def ground_surface(voxels: int, points: int) -> Floor:
    """Distance and weight of every voxel once, three comparisons; each point and its normal."""
    colours = 3
    return Floor(2 * FLOAT * voxels + (2 * POINT + colours) * points, 3 * voxels + 40 * points)


def added_points(points: int) -> Floor:
    """Points moved, and written beside those that were there."""
    return Floor(2 * POINT * points, 18 * points)
