"""Random patterns that the generated pictures are made of."""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.float32]

_BANK_PX = 1024
_FULL_PX = 16  # noise finer than this is worked out pixel by pixel


def smooth_noise(shape: tuple[int, int], cell_px: float, rng: np.random.Generator) -> Image:
    """(H, W) of about unit deviation, varying over `cell_px`."""
    height, width = shape
    grid = (int(np.ceil(height / cell_px)) + 3, int(np.ceil(width / cell_px)) + 3)
    coarse = rng.standard_normal(grid).astype(np.float32)
    size = (int(np.ceil(grid[1] * cell_px)), int(np.ceil(grid[0] * cell_px)))
    margin = int(cell_px)
    fine = cv2.resize(coarse, size, interpolation=cv2.INTER_CUBIC)
    return np.ascontiguousarray(fine[margin : margin + height, margin : margin + width])


def octave_noise(
    shape: tuple[int, int], coarsest_px: float, finest_px: float, rng: np.random.Generator,
    persistence: float = 0.6,
) -> Image:  # fmt: skip
    """(H, W) of about unit deviation: octaves from coarse to fine, ever weaker."""
    if coarsest_px >= 4 * _FULL_PX:
        # What is coarse is worked out on a quarter of the rows and columns.
        small = (-(-shape[0] // 4) + 1, -(-shape[1] // 4) + 1)
        coarse_end = max(finest_px, _FULL_PX) / 4
        total = octave_noise(small, coarsest_px / 4, coarse_end, rng, persistence)
        larger = cv2.resize(total, (4 * small[1], 4 * small[0]), interpolation=cv2.INTER_LINEAR)
        total = np.ascontiguousarray(larger[: shape[0], : shape[1]], np.float32)
        octaves = int(np.log2(coarsest_px / (4 * coarse_end))) + 1
        power = float(sum(persistence ** (2 * k) for k in range(octaves)))
        total *= np.float32(np.sqrt(power))
        weight, cell = persistence**octaves, coarsest_px / 2**octaves
    else:
        total = np.zeros(shape, np.float32)
        weight, power, cell = 1.0, 0.0, coarsest_px
    while cell >= finest_px:
        cv2.scaleAdd(smooth_noise(shape, cell, rng), weight, total, total)
        power += weight**2
        weight *= persistence
        cell /= 2
    return total / np.float32(np.sqrt(power))


@cache
def fibre_bank() -> Image:
    """A sheet of paper fibres: short hairs in every direction, finer grain between."""
    rng = np.random.default_rng(11)
    sheet = np.zeros((_BANK_PX, _BANK_PX), np.float32)
    for tone in (1, -1):
        layer = np.zeros((_BANK_PX, _BANK_PX), np.uint8)
        start = rng.uniform(0, _BANK_PX, (9000, 2))
        angle = rng.normal(0, 0.9, 9000)
        length = rng.uniform(3, 16, 9000)
        end = start + length[:, None] * np.stack([np.cos(angle), np.sin(angle)], 1)
        strength = rng.integers(60, 255, 9000)
        for a, b, value in zip(start.astype(int), end.astype(int), strength, strict=True):
            cv2.line(layer, tuple(map(int, a)), tuple(map(int, b)), int(value), 1, cv2.LINE_AA)
        sheet += tone * layer.astype(np.float32) / np.float32(255)
    grain = rng.standard_normal(sheet.shape).astype(np.float32)
    soft = cv2.GaussianBlur(grain, (0, 0), 0.8)
    sheet = sheet / sheet.std() * 0.75 + soft / soft.std() * 0.55 + grain * 0.25
    return sheet / sheet.std()


@cache
def mottle_bank() -> Image:
    """Cloudy paper: blotches over many scales."""
    return octave_noise((_BANK_PX, _BANK_PX), 160, 4, np.random.default_rng(12), 0.72)


@cache
def cloud_bank(cell_px: int) -> Image:
    """Noise of unit deviation that varies over `cell_px`."""
    rng = np.random.default_rng([14, cell_px])
    return smooth_noise((_BANK_PX, _BANK_PX), cell_px, rng)


@cache
def dent_bank(cell_px: int) -> Image:
    """How light or dark the slopes of shallow dents look, about -1 to 1."""
    depth = np.minimum(cloud_bank(cell_px) + 1.0, 0)  # only the deepest places give way
    depth = np.asarray(cv2.GaussianBlur(depth, (0, 0), cell_px / 9), np.float32)
    slope = np.gradient(depth, axis=1) + np.gradient(depth, axis=0)
    return np.asarray(0.5 * cell_px * slope, np.float32)


def power_of_two(value: float, low: int, high: int) -> int:
    """The nearest power of two within bounds: banks come in these sizes."""
    return int(np.clip(2 ** round(float(np.log2(max(value, 1)))), low, high))


@cache
def scratch_bank() -> Image:
    """Fine scratches and rub marks, 0 to 1."""
    rng = np.random.default_rng(13)
    layer = np.zeros((_BANK_PX, _BANK_PX), np.uint8)
    for _ in range(420):
        x, y = rng.uniform(0, _BANK_PX, 2)
        angle, length = rng.uniform(0, np.pi), rng.gamma(2.0, 22)
        bend = rng.normal(0, 0.15, 6).cumsum() + angle
        steps = length / 6 * np.stack([np.cos(bend), np.sin(bend)], 1)
        points = np.round((np.array([x, y]) + steps.cumsum(0)) * 8).astype(np.int32)
        cv2.polylines(layer, [points], False, int(rng.integers(50, 230)), 1, cv2.LINE_AA, 3)
    return layer.astype(np.float32) / np.float32(255)


def crop(bank: Image, shape: tuple[int, int], rng: np.random.Generator) -> Image:
    """(H, W) from a random place of a bank, mirrored at random; at most the bank's size."""
    height, width = shape
    y = int(rng.integers(0, bank.shape[0] - height + 1))
    x = int(rng.integers(0, bank.shape[1] - width + 1))
    piece = bank[y : y + height, x : x + width]
    return piece[:: rng.choice([-1, 1]), :: rng.choice([-1, 1])]
