"""Generated pictures of what buildings and racks are made of: concrete, brickwork, steel, board."""

from __future__ import annotations

import cv2
import numpy as np

from sim.appearance.sheet import Colour, Sheet
from sim.geometry.noise import Image, cloud_bank, crop, dent_bank, mottle_bank, scratch_bank

BRICK_M = (0.24, 0.071)
"""Length and height of a brick (German normal format) [m]."""
MORTAR_M = 0.011
"""Thickness of a joint [m]."""
FLAG_M = 0.5
"""Edge of a flag of a pavement [m]."""
_CONCRETE: Colour = (158, 154, 147)
_MORTAR: Colour = (172, 166, 154)
_RED: Colour = (146, 88, 70)
_STEEL: Colour = (58, 88, 142)
_CHIPBOARD: Colour = (188, 158, 116)


def paint_concrete_face(
    size_m: tuple[float, float], px_per_m: float, rng: np.random.Generator
) -> Image:
    """Cast concrete: clouds, joints of the formwork, voids, rust and broken rims."""
    sheet = _blank(size_m, px_per_m, rng)
    shape = sheet.shape
    tint = np.array(_CONCRETE, np.float32) * np.float32(rng.uniform(0.82, 1.08))
    grain = np.asarray(cv2.GaussianBlur(rng.standard_normal(shape, np.float32), (0, 0), 0.9))
    tone = 1 + np.float32(0.07) * crop(mottle_bank(), shape, rng)
    tone += np.float32(0.05) * crop(cloud_bank(256), shape, rng) + np.float32(0.06) * grain
    tone += np.float32(0.07) * crop(dent_bank(32), shape, rng)
    sheet.pixels[:] = tint * tone[..., None]
    _formwork(sheet)
    _voids(sheet)
    _broken_rim(sheet)
    if rng.random() < 0.6:
        _rust(sheet)
    return sheet.pixels


def paint_brickwork(
    size_m: tuple[float, float], px_per_m: float, rng: np.random.Generator
) -> Image:
    """Bricks in running bond, each of its own shade, with mortar between and on them."""
    sheet = _blank(size_m, px_per_m, rng)
    shape = sheet.shape
    sheet.pixels[:] = np.array(_MORTAR, np.float32) * (
        1 + np.float32(0.08) * crop(mottle_bank(), shape, rng)[..., None]
    )
    length, height = (edge * px_per_m for edge in BRICK_M)
    joint = max(1.0, MORTAR_M * px_per_m)
    x0, y0 = rng.uniform(-1, 0, 2) * (length, height)
    cover, shade = np.zeros(shape, np.uint8), np.ones(shape, np.float32)
    for row in range(int(shape[0] / (height + joint)) + 2):
        top = y0 + row * (height + joint)
        for column in range(-1, int(shape[1] / (length + joint)) + 2):
            left = x0 + (column + 0.5 * (row % 2)) * (length + joint)
            low = (round(left), round(top))
            high = (round(left + length), round(top + height))
            cv2.rectangle(cover, low, high, 255, -1)
            cv2.rectangle(shade, low, high, float(rng.uniform(0.72, 1.18)), -1)
    worn = np.clip(1.15 - 0.45 * np.maximum(crop(cloud_bank(64), shape, rng), 0), 0.15, 1)
    sheet.blend(_RED, cover * worn * np.float32(1 / 255))
    tone = shade * (1 + np.float32(0.09) * crop(mottle_bank(), shape, rng))
    tone += np.float32(0.1) * crop(dent_bank(32), shape, rng)
    sheet.darken(np.where(cover > 0, tone, 1 + np.float32(0.5) * (tone - shade)))
    _broken_rim(sheet)
    return sheet.pixels


def paint_paving(size_m: tuple[float, float], px_per_m: float, rng: np.random.Generator) -> Image:
    """Square flags of concrete with open joints, or a kerb where a side is low."""
    pixels = paint_concrete_face(size_m, px_per_m, rng)
    scale = pixels.shape[1] / size_m[0]
    sheet = Sheet(pixels, scale, rng)
    height, width = sheet.shape
    for x in np.arange(FLAG_M, size_m[0] - 0.1, FLAG_M) * scale:
        sheet.crease((x, 0), (x, height), 0.5, 2)
    if size_m[1] > FLAG_M:
        flags = (int(np.ceil(size_m[1] / FLAG_M)), int(np.ceil(size_m[0] / FLAG_M)))
        shade = rng.uniform(0.86, 1.08, flags)
        tone = cv2.resize(shade, (width, height), interpolation=cv2.INTER_NEAREST)
        sheet.darken(tone.astype(np.float32))
        for y in np.arange(FLAG_M, size_m[1] - 0.1, FLAG_M) * scale:
            sheet.crease((0, y), (width, y), 0.5, 2)
    return pixels


def paint_steel(size_m: tuple[float, float], px_per_m: float, rng: np.random.Generator) -> Image:
    """A painted profile with a row of slots, scratched."""
    sheet = _blank(size_m, px_per_m, rng)
    height, width = sheet.shape
    sheet.pixels[:] = _STEEL
    scratches = crop(scratch_bank(), sheet.shape, rng)
    sheet.blend((168, 166, 160), np.float32(0.5) * scratches)
    slots = np.zeros(sheet.shape, np.uint8)
    half = (max(1, round(0.006 * px_per_m)), max(1, round(0.012 * px_per_m)))
    for y in np.arange(0.05, size_m[1], 0.1) * px_per_m:
        low, high = (
            (width // 2 - half[0], int(y) - half[1]),
            (width // 2 + half[0], int(y) + half[1]),
        )
        cv2.rectangle(slots, low, high, 255, -1)
    sheet.blend((24, 26, 30), slots * np.float32(0.9 / 255))
    foot = np.linspace(1, 0, height, dtype=np.float32)[:, None] * np.ones((1, width), np.float32)
    sheet.darken(1 - np.float32(0.12) * (1 - foot))
    return sheet.pixels


def paint_chipboard(
    size_m: tuple[float, float], px_per_m: float, rng: np.random.Generator
) -> Image:
    """Chipboard: flakes of many shades, rub marks."""
    sheet = _blank(size_m, px_per_m, rng)
    shape = sheet.shape
    flakes = np.asarray(cv2.GaussianBlur(rng.standard_normal(shape, np.float32), (0, 0), 1.3))
    tone = 1 + np.float32(0.28) * flakes + np.float32(0.04) * crop(mottle_bank(), shape, rng)
    sheet.pixels[:] = np.array(_CHIPBOARD, np.float32) * tone[..., None]
    sheet.blend((96, 80, 62), np.float32(0.35) * crop(scratch_bank(), shape, rng))
    return sheet.pixels


def _blank(size_m: tuple[float, float], px_per_m: float, rng: np.random.Generator) -> Sheet:
    width, height = (min(max(48, round(edge * px_per_m)), 1024) for edge in size_m)
    return Sheet(np.empty((height, width, 3), np.float32), px_per_m, rng)


def _formwork(sheet: Sheet) -> None:
    """Faint ridges where the boards of the formwork met."""
    rng, (height, width) = sheet.rng, sheet.shape
    step = rng.uniform(0.12, 0.3) * sheet.px_per_m
    along = bool(rng.random() < 0.5)
    for place in np.arange(rng.uniform(0.2, 1) * step, width if along else height, step):
        lean = rng.normal(0, 1.5)
        if along:
            sheet.crease((place, 0), (place + lean, height), 0.16, 1)
        else:
            sheet.crease((0, place), (width, place + lean), 0.16, 1)


def _voids(sheet: Sheet) -> None:
    """Pores of air that the casting left."""
    rng, (height, width) = sheet.rng, sheet.shape
    layer = np.zeros(sheet.shape, np.uint8)
    count = int(160 * height * width / sheet.px_per_m**2) + 4
    for x, y, r in rng.random((count, 3)):
        radius = round(0.5 + 0.006 * sheet.px_per_m * float(r) ** 4)
        cv2.circle(layer, (int(x * width), int(y * height)), radius, int(120 + 130 * r), -1)
    sheet.blend((70, 66, 62), layer * np.float32(0.6 / 255))


def _broken_rim(sheet: Sheet) -> None:
    """Rims that broke off: lighter, rough, of uneven width."""
    rng, (height, width) = sheet.rng, sheet.shape
    rows, columns = np.arange(height, dtype=np.float32), np.arange(width, dtype=np.float32)
    inside = np.minimum.outer(
        np.minimum(rows, rows[::-1]), np.minimum(columns, columns[::-1])
    ) / np.float32(sheet.px_per_m)
    ragged = np.float32(0.012) + np.float32(0.014) * crop(cloud_bank(32), sheet.shape, rng)
    cover = np.clip((ragged - inside) / np.float32(0.006), 0, 1)
    rough = crop(mottle_bank(), sheet.shape, rng) * np.float32(0.12)
    sheet.blend((182, 174, 160), np.clip(cover * (np.float32(0.6) + rough), 0, 1))


def _rust(sheet: Sheet) -> None:
    """Stains of reinforcement that shows."""
    rng, (height, width) = sheet.rng, sheet.shape
    layer = np.zeros(sheet.shape, np.float32)
    for _ in range(int(rng.integers(1, 4))):
        x, y = rng.uniform(0, 1, 2) * (width, height)
        end = (int(x + rng.normal(0, 0.15) * width), int(y + rng.normal(0, 0.15) * height))
        cv2.line(layer, (int(x), int(y)), end, 1.0, max(2, round(0.02 * sheet.px_per_m)))
    soft = np.asarray(cv2.GaussianBlur(layer, (0, 0), 0.02 * sheet.px_per_m), np.float32)
    sheet.blend((126, 78, 48), np.clip(soft * np.float32(0.8), 0, 0.7))
