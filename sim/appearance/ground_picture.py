"""Pictures of natural ground and of rock, neither of which repeats."""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from sim.appearance.sheet import Colour, fixed_point
from sim.geometry.noise import Image, octave_noise

_SOILS: tuple[Colour, ...] = ((124, 102, 78), (166, 146, 116), (98, 84, 66))
_GRASSES: tuple[Colour, ...] = (
    (150, 140, 84), (176, 160, 104), (116, 122, 62), (92, 104, 50), (192, 176, 126), (134, 120, 74),
)  # fmt: skip
STONES: tuple[Colour, ...] = (
    (150, 146, 140), (122, 116, 110), (172, 166, 154), (140, 124, 106), (98, 94, 92),
    (186, 178, 170),
)  # fmt: skip
LEAF_GREENS: tuple[Colour, ...] = (
    (106, 122, 62), (88, 108, 54), (126, 134, 74), (140, 132, 78), (112, 116, 72),
)  # fmt: skip
_LEAVES: tuple[Colour, ...] = ((146, 92, 44), (120, 74, 40), (172, 124, 60), (98, 66, 40))
_LATTICE = 32  # a power of two: cells are wrapped by their bits
_ROCKS: tuple[Colour, ...] = ((150, 145, 138), (132, 126, 122), (162, 150, 134), (118, 116, 116))


def paint_ground(
    size_m: tuple[float, float], px_per_m: float, azimuth_deg: float, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Soil, gravel, dry grass, twigs and leaves: (rows, columns, 3) display values, unlit.

    `azimuth_deg` of the sun shades the details that are smaller than the mesh.
    """
    shape = (round(size_m[1] * px_per_m), round(size_m[0] * px_per_m))
    sun = np.array([np.cos(np.radians(azimuth_deg)), -np.sin(np.radians(azimuth_deg))])
    growth = octave_noise(shape, 1.8 * px_per_m, 0.12 * px_per_m, rng, 0.7)
    canvas = _soil(shape, px_per_m, sun, growth, rng)
    area = size_m[0] * size_m[1]
    _pebbles(canvas, int(1000 * area), px_per_m, sun, growth, rng)
    _grass(canvas, int(2200 * area), px_per_m, growth, rng)
    _leaves(canvas, int(7 * area), px_per_m, rng)
    return canvas


def _soil(
    shape: tuple[int, int], px_per_m: float, sun: NDArray, growth: Image, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Crumbly soil in three tones, its crumbs lit from the sun's side."""
    dry = np.clip(0.5 + 0.6 * octave_noise(shape, 0.9 * px_per_m, 0.05 * px_per_m, rng), 0, 1)
    crumbs = octave_noise(shape, 0.05 * px_per_m, 2, rng, 0.85)
    relief = float(sun[0]) * cv2.Sobel(crumbs, cv2.CV_32F, 1, 0) + float(sun[1]) * cv2.Sobel(
        crumbs, cv2.CV_32F, 0, 1
    )
    tone = 1 + np.clip(0.075 * relief, -0.4, 0.3) + 0.05 * crumbs
    tone += 0.03 * rng.standard_normal(shape, np.float32)
    canvas = np.empty((*shape, 3), np.uint8)
    colours = np.array([_SOILS[0], _SOILS[1], _GRASSES[2]], np.float32)
    _mix_soil(colours, dry, growth, tone, canvas)
    return canvas


@njit(cache=True, error_model="numpy")
def _mix_soil(colours: NDArray, dry: NDArray, growth: NDArray, tone: NDArray, out: NDArray) -> None:
    """Dark to light soil by `dry`, toward moss by `growth`, times `tone`."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            green = min(max(0.45 * growth[i, j], 0.0), 0.55)
            for c in range(3):
                value = colours[0, c] + (colours[1, c] - colours[0, c]) * dry[i, j]
                value += (0.9 * colours[2, c] - value) * green
                out[i, j, c] = np.uint8(min(max(value * tone[i, j], 0.0), 255.0))


def _pebbles(
    canvas: NDArray[np.uint8], count: int, px_per_m: float, sun: NDArray, growth: Image,
    rng: np.random.Generator,
) -> None:  # fmt: skip
    """Stones from grit to fist size with a shadow and a lit side, rarer where grass grows."""
    rows, columns = canvas.shape[:2]
    places = rng.uniform(0, 1, (count, 2)) * (columns, rows)
    bare = growth[places[:, 1].astype(int), places[:, 0].astype(int)] < rng.normal(0.1, 0.7, count)
    places = places[bare]
    count = len(places)
    radii = px_per_m * np.minimum(0.0022 * rng.pareto(2.1, count) + 0.002, 0.03)
    angles = np.sort(rng.uniform(0, 2 * np.pi, (count, 8)), axis=1)
    outline = np.stack([np.cos(angles), 0.75 * np.sin(angles)], -1) * radii[:, None, None]
    turn = rng.uniform(0, np.pi, count)
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], 1)
    outline = np.einsum("nij,nkj->nki", rotation, outline) + places[:, None]
    tones = rng.uniform(0.72, 1.12, count)
    kinds = rng.integers(len(STONES), size=count)
    shift = 0.35 * radii[:, None, None] * sun
    shadows = fixed_point(outline - shift)
    cores = fixed_point(places[:, None] + shift + 0.55 * (outline - places[:, None]))
    bodies = fixed_point(outline)
    for i in range(count):
        colour = np.array(STONES[kinds[i]]) * tones[i]
        cv2.fillConvexPoly(canvas, shadows[i], (52, 44, 36), cv2.LINE_AA, 3)
        cv2.fillConvexPoly(canvas, bodies[i], tuple(colour * 0.86), cv2.LINE_AA, 3)
        if radii[i] > 2:
            cv2.fillConvexPoly(
                canvas, cores[i], tuple(np.minimum(colour * 1.1, 240)), cv2.LINE_AA, 3
            )


def _grass(
    canvas: NDArray[np.uint8], count: int, px_per_m: float, growth: Image, rng: np.random.Generator
) -> None:
    """Blades in tufts: a dark layer first, then ever lighter ones."""
    rows, columns = canvas.shape[:2]
    tufts = rng.uniform(0, 1, (count // 14, 2)) * (columns, rows)
    thick = growth[tufts[:, 1].astype(int), tufts[:, 0].astype(int)]
    tufts = tufts[thick > rng.normal(0.35, 0.5, len(tufts))]
    root = np.repeat(tufts, 24, axis=0)
    root = root + rng.normal(0, 0.022 * px_per_m, root.shape)
    lean = np.repeat(rng.uniform(0, 2 * np.pi, len(tufts)), 24) + rng.normal(0, 1.1, len(root))
    length = px_per_m * rng.gamma(4.0, 0.013, len(root))
    bend = lean[:, None] + rng.normal(0, 0.35, len(root))[:, None] * np.arange(4)
    steps = length[:, None, None] / 4 * np.stack([np.cos(bend), np.sin(bend)], -1)
    blades = np.concatenate([root[:, None], root[:, None] + steps.cumsum(1)], axis=1)
    fixed = fixed_point(blades)
    layer = rng.integers(0, 12, len(root))
    for k in range(12):
        tone = 0.5 + 0.05 * k
        colour = tuple(tone * c for c in _GRASSES[k % len(_GRASSES)])
        width = 2 if k % 4 == 0 else 1
        cv2.polylines(canvas, list(fixed[layer == k]), False, colour, width, cv2.LINE_AA, 3)


def _leaves(
    canvas: NDArray[np.uint8], count: int, px_per_m: float, rng: np.random.Generator
) -> None:
    """Fallen leaves with a rib, and twigs."""
    rows, columns = canvas.shape[:2]
    t = np.linspace(0, np.pi, 9)
    for _ in range(count):
        place = rng.uniform(0, 1, 2) * (columns, rows)
        length, angle = px_per_m * rng.uniform(0.015, 0.04), rng.uniform(0, 2 * np.pi)
        rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        side = length * rng.uniform(0.25, 0.5) * np.sin(t) ** 0.8
        along = -length * np.cos(t)
        outline = np.concatenate([np.stack([along, side], 1), np.stack([along, -side], 1)[::-1]])
        shape = outline @ rotation.T + place
        colour = np.array(_LEAVES[rng.integers(len(_LEAVES))]) * rng.uniform(0.75, 1.2)
        cv2.fillPoly(canvas, [fixed_point(shape + 2)], (58, 48, 38), cv2.LINE_AA, 3)
        cv2.fillPoly(canvas, [fixed_point(shape)], tuple(np.minimum(colour, 235)), cv2.LINE_AA, 3)
        rib = np.array([[-length, 0], [length, 0]]) @ rotation.T + place
        cv2.polylines(canvas, [fixed_point(rib)], False, tuple(colour * 0.7), 1, cv2.LINE_AA, 3)
        if rng.random() < 0.25:
            bends = angle + rng.normal(0, 0.25, 6).cumsum()
            twig = place + np.cumsum(np.stack([np.cos(bends), np.sin(bends)], 1), 0) * length
            cv2.polylines(canvas, [fixed_point(twig)], False, (70, 54, 40), 2, cv2.LINE_AA, 3)


def paint_rock(nodes: NDArray, diameter_m: float, rng: np.random.Generator) -> Image:
    """Mottled, veined stone with lichen: (..., 3) display values at points in space.

    `nodes` (..., 3) lie on the rock [m], in any frame; `diameter_m` sets the size of the mottles.
    """
    points = nodes.reshape(-1, 3)
    coarse = noise_in_space(points, 0.3 * diameter_m, rng)
    middle = noise_in_space(points, 0.035, rng)
    fine = noise_in_space(points, 0.009, rng)
    grain = noise_in_space(points, 0.0035, rng)
    tone = 1 + 0.07 * coarse + 0.08 * middle + 0.09 * fine + 0.09 * grain
    crack = np.abs(noise_in_space(points, 0.12, rng) + 0.25 * middle)
    tone *= 1 - 0.45 * np.exp(-((crack / 0.035) ** 2))
    pits = np.clip(fine + 0.6 * grain - 1.5, 0, 0.6)
    tone *= 1 - 0.5 * pits
    colour = np.array(_ROCKS[rng.integers(len(_ROCKS))]) * rng.uniform(0.82, 1.08)
    pixels = colour.astype(np.float32) * tone[:, None]
    lichen = np.clip(3 * (noise_in_space(points, 0.05, rng) + 0.5 * fine - 1.15), 0, 0.75)
    patch = ((196, 192, 150), (168, 164, 96), (204, 204, 196))[rng.integers(3)]
    pixels += (np.array(patch) * (1 + 0.06 * grain)[:, None] - pixels) * lichen[:, None]
    return pixels.reshape(nodes.shape).astype(np.float32)


def noise_in_space(points: NDArray, cell_m: float, rng: np.random.Generator) -> NDArray:
    """(N,) of about unit deviation, varying over `cell_m` in every direction."""
    lattice = rng.standard_normal((_LATTICE,) * 3, np.float32)
    return 1.6 * _interpolate(lattice, (points / cell_m).astype(np.float32))


@njit(cache=True, error_model="numpy")
def _interpolate(lattice: NDArray, places: NDArray) -> NDArray:
    """(N,) trilinear values at places (N, 3) [cells] of a lattice that repeats."""
    out = np.empty(len(places), np.float32)
    mask = lattice.shape[0] - 1
    for n in range(len(places)):
        x, y, z = places[n]
        i, j, k = int(np.floor(x)), int(np.floor(y)), int(np.floor(z))
        u, v, w = x - i, y - j, z - k
        i0, j0, k0 = i & mask, j & mask, k & mask
        i1, j1, k1 = (i + 1) & mask, (j + 1) & mask, (k + 1) & mask
        a = lattice[i0, j0, k0] * (1 - u) + lattice[i1, j0, k0] * u
        b = lattice[i0, j1, k0] * (1 - u) + lattice[i1, j1, k0] * u
        c = lattice[i0, j0, k1] * (1 - u) + lattice[i1, j0, k1] * u
        d = lattice[i0, j1, k1] * (1 - u) + lattice[i1, j1, k1] * u
        out[n] = (a * (1 - v) + b * v) * (1 - w) + (c * (1 - v) + d * v) * w
    return out
