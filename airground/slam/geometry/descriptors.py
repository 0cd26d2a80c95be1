"""Binary descriptors of corners, independent of the heading, and their matching.

ORB (Rublee et al., "ORB: an efficient alternative to SIFT or SURF", ICCV 2011) at given
pixels: the direction of a patch is that from its centre to its centroid of intensity.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit

from airground.core.arrays import F64, I64, U8, U64, Floats, freeze

SCALE = 1.5
"""Factor by which images are reduced first: less noise, and a larger patch."""
RADIUS_PX = 15
PAIRS, NIBBLES = np.uint64(0x5555555555555555), np.uint64(0x3333333333333333)
BYTES, ONES = np.uint64(0x0F0F0F0F0F0F0F0F), np.uint64(0x0101010101010101)
MAX_DISTANCE = 64
"""Descriptors of one place differ in fewer of the 256 bits than this."""
VOTE_DISTANCE = 48
"""Stricter, since a vote has no second best to compare with."""
RATIO = 0.85
"""The second best may be no nearer than the best over this."""


@dataclass(frozen=True, eq=False)
class Described:
    """Pixels (n, 2) of one image and their (n, 4) uint64 descriptors of 256 bits."""

    pixels: F64
    descriptors: U64

    def __post_init__(self) -> None:
        freeze(self, "pixels", (None, 2), np.float64)
        freeze(self, "descriptors", (len(self.pixels), 4), np.uint64)


def describe(image: U8, pixels: Floats) -> Described:
    """ORB descriptors at (n, 2) pixels inside a (height, width) grey image."""
    size = (round(image.shape[1] / SCALE), round(image.shape[0] / SCALE))
    small = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
    pixels = np.asarray(pixels, np.float64).reshape(-1, 2)
    at = (pixels + 0.5) / SCALE - 0.5
    angles = np.rad2deg(_directions(small, at))
    points = [
        cv2.KeyPoint(x, y, 2.0 * RADIUS_PX + 1.0, angle, 0.0, 0, i)
        for i, ((x, y), angle) in enumerate(zip(at.tolist(), angles.tolist(), strict=True))
    ]
    orb = cv2.ORB.create(nlevels=1, edgeThreshold=0)
    kept, rows = orb.compute(small, points)
    order = np.array([point.class_id for point in kept], np.int64)
    descriptors = np.zeros((len(pixels), 4), np.uint64)
    if rows is not None:
        descriptors[order] = np.ascontiguousarray(rows).view(np.uint64)
    return Described(pixels, descriptors)


@njit(cache=True, nogil=True, error_model="numpy")
def _directions(image: U8, pixels: F64) -> F64:
    """(n,) angle [rad] in [0, 2 pi) from a disc's centre to its centroid of intensity."""
    height, width = image.shape
    angles = np.empty(len(pixels))
    for i in range(len(pixels)):
        x0, y0 = int(np.rint(pixels[i, 0])), int(np.rint(pixels[i, 1]))
        mx, my = 0.0, 0.0
        for dy in range(-RADIUS_PX, RADIUS_PX + 1):
            y = min(max(y0 + dy, 0), height - 1)
            reach = int(np.sqrt(RADIUS_PX * RADIUS_PX - dy * dy))
            for dx in range(-reach, reach + 1):
                x = min(max(x0 + dx, 0), width - 1)
                value = float(image[y, x])
                mx += dx * value
                my += dy * value
        angles[i] = np.arctan2(my, mx) % (2.0 * np.pi)
    return angles


@njit(cache=True, nogil=True, error_model="numpy")
def _bits(x: np.uint64) -> np.uint64:
    """Number of bits that are set."""
    x = x - ((x >> np.uint64(1)) & PAIRS)
    x = (x & NIBBLES) + ((x >> np.uint64(2)) & NIBBLES)
    x = (x + (x >> np.uint64(4))) & BYTES
    # Written this way, the compiler sees that one instruction counts bits.
    return (x * ONES) >> np.uint64(56)


@njit(cache=True, nogil=True, error_model="numpy")
def hamming(a: U64, b: U64) -> int:
    """Number of different bits of two (4,) uint64 descriptors."""
    total = np.uint64(0)
    for i in range(4):
        total += _bits(a[i] ^ b[i])
    return int(total)


@njit(cache=True, nogil=True, error_model="numpy")
def match(query: U64, known: U64) -> tuple[I64, I64]:
    """Rows in `query` (n, 4) and `known` (m, 4) nearest to each other and clearly nearer than the
    next, each at most once. The known descriptors are of places apart from each other."""
    n, m = len(query), len(known)
    nearest, distance = np.full(n, -1), np.full(n, 257)
    row_of, best_of = np.full(m, -1), np.full(m, 257)
    for i in range(n):
        first, second = 257, 257
        for j in range(m):
            d = hamming(query[i], known[j])
            if d < best_of[j]:
                best_of[j], row_of[j] = d, i
            if d < first:
                second, first = first, d
                nearest[i] = j
            elif d < second:
                second = d
        distance[i] = first
        if first > MAX_DISTANCE or first > RATIO * second:
            nearest[i] = -1
    kept = 0
    rows, partners = np.empty(n, np.int64), np.empty(n, np.int64)
    for i in range(n):
        if nearest[i] >= 0 and row_of[nearest[i]] == i:
            rows[kept], partners[kept] = i, nearest[i]
            kept += 1
    return rows[:kept], partners[:kept]


@njit(cache=True, nogil=True, error_model="numpy")
def votes(query: U64, known: U64, starts: I64) -> I64:
    """(g,) number of query descriptors (n, 4) with a likeness in each group of known ones (m, 4);
    `starts` (g + 1,) holds the index at which each group begins, and m."""
    counts = np.zeros(len(starts) - 1, np.int64)
    for g in range(len(counts)):
        group = known[starts[g] : starts[g + 1]]
        for i in range(len(query)):
            counts[g] += _has_likeness(query[i], group)
    return counts


@njit(cache=True, nogil=True, error_model="numpy")
def _has_likeness(descriptor: U64, group: U64) -> bool:
    """Whether one of some descriptors (n, 4) differs from another in few bits."""
    for j in range(len(group)):
        # Half of the bits tell almost all others apart.
        first = _bits(descriptor[0] ^ group[j, 0]) + _bits(descriptor[1] ^ group[j, 1])
        if first < VOTE_DISTANCE and hamming(descriptor, group[j]) < VOTE_DISTANCE:
            return True
    return False
