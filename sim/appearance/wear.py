"""What happens to a carton after it is printed: tape, labels, stickers, dents, stains."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from sim.appearance import print_marks as marks
from sim.appearance.sheet import Colour, Sheet, fixed_point
from sim.geometry.noise import (
    cloud_bank,
    crop,
    dent_bank,
    fibre_bank,
    mottle_bank,
    power_of_two,
    scratch_bank,
)

TAPE_HALF_WIDTH_M = 0.024
_STICKERS = ("FRAGILE", "HEAVY", "URGENT", "QC PASS", "GLASS")
_STICKER_COLOURS: tuple[Colour, ...] = (
    (200, 40, 36),
    (226, 120, 24),
    (44, 130, 70),
    (240, 200, 40),
)


def tape_seam(sheet: Sheet, colour: Colour) -> None:
    """A strip along the seam of the flaps; sometimes a second one across."""
    height, width = sheet.shape
    lean = sheet.rng.normal(0, 2.0)
    centre = height / 2 + sheet.rng.normal(0, 0.003 * sheet.px_per_m)
    tape(sheet, colour, (-5.0, centre - lean), (width + 5.0, centre + lean))
    if sheet.rng.random() < 0.3:
        x = width * sheet.rng.uniform(0.25, 0.75)
        tape(sheet, colour, (x, -5.0), (x + sheet.rng.normal(0, 8), height + 5.0))


def tape_end(sheet: Sheet, colour: Colour) -> None:
    """Where the strip from the top comes down a side."""
    x = sheet.shape[1] / 2 + sheet.rng.normal(0, 3)
    length = sheet.rng.uniform(0.04, 0.09) * sheet.px_per_m
    tape(sheet, colour, (x, -5.0), (x + sheet.rng.normal(0, 3), length))


def tape(
    sheet: Sheet, colour: Colour, start: tuple[float, float], end: tuple[float, float]
) -> None:
    """Tape from start to end: a glossy film with streaks, wrinkles, bubbles and hard edges."""
    rng = sheet.rng
    half = TAPE_HALF_WIDTH_M * sheet.px_per_m
    along = np.subtract(end, start) / np.hypot(*np.subtract(end, start))
    across = half * np.array([-along[1], along[0]])
    corners = np.array([start - across, end - across, end + across, start + across])
    low = np.floor(np.maximum(corners.min(0) - 2, 0)).astype(int)
    part = Sheet(sheet.pixels[low[1] :, low[0] :], sheet.px_per_m, rng)
    extent = np.ceil(corners.max(0) + 2 - low).astype(int)
    part.pixels = part.pixels[: extent[1], : extent[0]]
    if min(part.shape) < 2:
        return
    mask = np.zeros(part.shape, np.uint8)
    cv2.fillPoly(mask, [fixed_point(corners - low)], 255, cv2.LINE_AA, 3)
    lengthwise = 1 if abs(along[0]) > abs(along[1]) else 0
    streaks = rng.standard_normal(part.shape[1 - lengthwise]).astype(np.float32)
    streaks = np.expand_dims(streaks, lengthwise)
    sheen = crop(cloud_bank(power_of_two(half, 8, 64)), part.shape, rng)
    shine = 0.06 * np.clip(sheen, -1, 2.5) + 0.018 * streaks
    shine = shine + 0.12 * crop(scratch_bank(), part.shape, rng)
    share = mask * np.float32(1 / 255)
    part.blend(colour, share * np.float32(rng.uniform(0.5, 0.85)))
    part.darken(1 + share * shine)
    edge = cv2.morphologyEx(mask, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))
    part.darken(1 - edge * np.float32(0.22 / 255))


def shipping_label(sheet: Sheet) -> None:
    """A white or yellow label, glued on slightly askew."""
    rng = sheet.rng
    height = int(min(0.105 * sheet.px_per_m, 0.6 * sheet.shape[0]))
    width = int(min(0.15 * sheet.px_per_m, 0.7 * sheet.shape[1]))
    if height < 24 or width < 30:
        return
    paper = (238.0, 237.0, 231.0) if rng.random() < 0.8 else (240.0, 214.0, 90.0)
    _glue(sheet, marks.label(width, height, rng), paper, (36, 34, 38))


def sticker(sheet: Sheet) -> None:
    """A coloured warning sticker."""
    rng = sheet.rng
    height = max(10, int(min(0.05 * sheet.px_per_m, 0.4 * sheet.shape[0])))
    width = max(20, int(min(0.12 * sheet.px_per_m, 0.6 * sheet.shape[1])))
    ink = np.zeros((height, width), np.uint8)
    text = _STICKERS[rng.integers(len(_STICKERS))]
    size = min(height * 0.5, width / (len(text) * 1.3))
    marks.write(ink, text, width * 0.07, height * 0.5 + size * 0.5, size, 900)
    paper = _STICKER_COLOURS[rng.integers(len(_STICKER_COLOURS))]
    _glue(sheet, ink, paper, (246, 244, 240) if paper[1] < 150 else (30, 30, 30))


def _glue(sheet: Sheet, ink: NDArray[np.uint8], paper: Colour, colour: Colour) -> None:
    """Put a rectangle of paper with ink on it at a random place, with a faint shadow."""
    rng = sheet.rng
    x, y = sheet.shape[1] * rng.uniform(0.22, 0.78), sheet.shape[0] * rng.uniform(0.25, 0.75)
    turn = float(rng.normal(0, 5) + rng.choice([0, 0, 90, 180]))
    part, x, y = sheet.window(x, y, float(np.hypot(*ink.shape)) / 2 + 6)
    paper_mask, ink_mask = np.zeros(part.shape, np.uint8), np.zeros(part.shape, np.uint8)
    marks.stamp(paper_mask, np.full(ink.shape, 255, np.uint8), x, y, turn)
    marks.stamp(ink_mask, ink, x, y, turn)
    shadow = cv2.GaussianBlur(np.roll(paper_mask, (2, 2), (0, 1)), (0, 0), 2.0)
    part.darken(1 - shadow * np.float32(0.3 / 255))
    part.blend(paper, paper_mask * np.float32(1 / 255))
    part.blend(colour, ink_mask * np.float32(0.92 / 255))
    grain = 0.012 * crop(fibre_bank(), part.shape, rng)
    grain = grain + 0.03 * crop(cloud_bank(32), part.shape, rng)
    part.darken(1 + np.where(paper_mask > 127, grain, np.float32(0)))


def wear(sheet: Sheet) -> None:
    """Rubbed edges, dents, creases, scratches and stains."""
    rng, (height, width) = sheet.rng, sheet.shape
    ragged = crop(mottle_bank(), sheet.shape, rng)
    fray = _from_edge(sheet, 0.004) * np.clip(0.55 + 0.5 * ragged, 0, 1.3)
    dents = crop(dent_bank(power_of_two(0.09 * sheet.px_per_m, 16, 128)), sheet.shape, rng)
    scratches = crop(scratch_bank(), sheet.shape, rng)
    tone = 1 - np.float32(0.12) * _from_edge(sheet, 0.02)
    tone += np.clip(np.float32(rng.uniform(0.02, 0.12)) * dents, -0.2, 0.14)
    tone -= np.float32(rng.uniform(0.02, 0.16)) * scratches
    sheet.darken(tone)
    sheet.blend((218, 190, 152), np.clip(np.float32(0.62) * fray, 0, 0.75))
    if rng.random() < 0.35:
        a, b = rng.uniform(0, 1, (2, 2)) * (width, height)
        sheet.crease(tuple(a), tuple(b), 0.16, 2)
    if rng.random() < 0.45:
        _stain(sheet)


def _from_edge(sheet: Sheet, reach_m: float) -> NDArray[np.float32]:
    """(H, W) 1 at the border, falling off over `reach_m` inward."""
    sides = []
    for count in sheet.shape:
        index = np.arange(count, dtype=np.float32)
        inward = np.minimum(index, index[::-1]) / np.float32(reach_m * sheet.px_per_m)
        sides.append(np.exp(-inward))
    return np.maximum(sides[0][:, None], sides[1][None])


def _stain(sheet: Sheet) -> None:
    """Something dripped: a blotch with a darker rim."""
    rng = sheet.rng
    radius = rng.uniform(0.02, 0.09) * sheet.px_per_m
    x, y = rng.uniform(0, 1, 2) * sheet.shape[::-1]
    part, x, y = sheet.window(x, y, 1.7 * radius)
    rows, columns = (np.arange(n, dtype=np.float32) for n in part.shape)
    across = (columns - np.float32(x)) * np.float32(rng.uniform(0.75, 1.5) / radius)
    down = (rows - np.float32(y)) / np.float32(radius)
    distance = np.sqrt(across[None] ** 2 + down[:, None] ** 2)
    distance += np.float32(0.2) * np.clip(crop(mottle_bank(), part.shape, rng), -2, 2)
    blotch = np.clip((1.0 - distance) * 8, 0, 1)
    rim = np.exp(-(((distance - 0.95) / np.float32(0.06)) ** 2))
    depth = np.float32(rng.uniform(0.06, 0.22))
    part.darken(1 - depth * blotch - np.float32(0.6) * depth * rim)
