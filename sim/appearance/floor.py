"""Pictures of floors (concrete, a plain covering, a print) and of plaster walls."""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from sim.appearance import print_marks as marks
from sim.appearance.sheet import Colour, Sheet, fixed_point
from sim.geometry.noise import Image, octave_noise, smooth_noise

_CONCRETE: Colour = (154, 151, 145)
_PLASTER: Colour = (196, 193, 184)
_ASPHALT: Colour = (92, 92, 94)
LINE_M = 3.0
"""Length of a dash and its gap in the middle of a road [m]."""
_COVERING: Colour = (134, 138, 142)


def paint_concrete(size_m: tuple[float, float], px_per_m: float, rng: np.random.Generator) -> Image:
    """Worn concrete without repetition: (rows, columns, 3) float32 display values, unlit."""
    sheet = _blank(size_m, px_per_m, rng)
    _concrete_base(sheet)
    _spots(sheet, 45, (0.03, 0.28), 0.30)
    _arcs(sheet, 260, (0.2, 1.6), 0.10)
    _cracks(sheet, int(1.2 * np.prod(size_m) ** 0.5))
    _joints(sheet, size_m)
    _arcs(sheet, 160, (0.05, 0.35), 0.38)
    _tape_and_paint(sheet, int(0.28 * np.prod(size_m)))
    _litter(sheet, int(5 * np.prod(size_m)))
    return sheet.pixels


def paint_plain(size_m: tuple[float, float], px_per_m: float, rng: np.random.Generator) -> Image:
    """A covering of one colour, as in offices and laboratories: fine flecks, dirt, some scuffs."""
    sheet = _blank(size_m, px_per_m, rng)
    clouds = octave_noise(sheet.shape, 1.6 * px_per_m, 0.05 * px_per_m, rng, 0.7)
    flecks = np.asarray(cv2.GaussianBlur(rng.standard_normal(sheet.shape, np.float32), (0, 0), 1.2))
    tone = 1 + np.float32(0.025) * clouds + np.float32(0.12) * flecks.astype(np.float32)
    sheet.pixels[:] = np.array(_COVERING, np.float32) * tone[..., None]
    _spots(sheet, int(0.3 * np.prod(size_m)), (0.02, 0.12), 0.12)
    _arcs(sheet, int(2 * np.prod(size_m)), (0.05, 0.5), 0.15)
    return sheet.pixels


def paint_plaster(size_m: tuple[float, float], px_per_m: float, rng: np.random.Generator) -> Image:
    """A plastered wall: patches, runs, cracks, scuffs along the foot, notices."""
    sheet = _blank(size_m, px_per_m, rng)
    height = sheet.shape[0]
    tone = 1 + 0.04 * octave_noise(sheet.shape, px_per_m * 1.2, 4, rng, 0.7)
    tone += 0.02 * rng.standard_normal(sheet.shape, np.float32)
    foot = np.linspace(0, size_m[1], height, dtype=np.float32)[::-1, None]
    dirt = np.clip(1 + 0.5 * smooth_noise(sheet.shape, px_per_m * 0.3, rng), 0, 2)
    tone -= 0.16 * np.exp(-foot / 0.25) * dirt
    sheet.pixels[:] = np.array(_PLASTER, np.float32) * tone[..., None]
    band = height - int(1.1 * px_per_m)
    cover = np.zeros(sheet.shape, np.float32)
    cover[band:] = 0.5
    sheet.blend((120, 138, 136), cover)
    _spots(sheet, 14, (0.05, 0.3), 0.12)
    _cracks(sheet, 5)
    _arcs(sheet, 90, (0.1, 0.8), 0.2)
    for _ in range(int(2 * size_m[0])):
        _notice(sheet)
    return sheet.pixels


def paint_asphalt(size_m: tuple[float, float], px_per_m: float, rng: np.random.Generator) -> Image:
    """A road along x: aggregate, patches, cracks, oil, a broken line along the middle."""
    sheet = _blank(size_m, px_per_m, rng)
    grain = rng.standard_normal(sheet.shape, np.float32)
    stones = np.asarray(cv2.GaussianBlur(grain[::-1], (0, 0), 1.0), np.float32)
    tone = 1 + np.float32(0.06) * octave_noise(sheet.shape, 2.0 * px_per_m, 4, rng, 0.7)
    tone += np.float32(0.09) * grain + np.float32(0.45) * np.maximum(stones - np.float32(0.3), 0)
    sheet.pixels[:] = np.array(_ASPHALT, np.float32) * tone[..., None]
    height, width = sheet.shape
    for _ in range(int(0.03 * np.prod(size_m))):
        x, y = rng.uniform(0, 1, 2) * (width, height)
        a, b = rng.uniform(0.4, 1.6, 2) * px_per_m
        patch = sheet.pixels[int(y) : int(y + a), int(x) : int(x + b)]
        patch *= np.float32(rng.uniform(0.72, 0.9))
    middle, half = height // 2, max(1, round(0.06 * px_per_m))
    paint = np.zeros(sheet.shape, np.float32)
    for x in np.arange(0.5, size_m[0], LINE_M) * px_per_m:
        paint[middle - half : middle + half, int(x) : int(x + LINE_M / 2 * px_per_m)] = 0.75
    sheet.blend((222, 220, 210), paint * np.clip(1 - np.float32(0.25) * np.abs(grain), 0, 1))
    _spots(sheet, int(0.12 * np.prod(size_m)), (0.05, 0.35), 0.4)
    _arcs(sheet, int(1.5 * np.prod(size_m)), (0.2, 1.5), 0.2)
    _cracks(sheet, int(0.15 * np.prod(size_m)))
    _litter(sheet, int(4 * np.prod(size_m)))
    return sheet.pixels


def paint_print(size_m: tuple[float, float], px_per_m: float, rng: np.random.Generator) -> Image:
    """A flat print full of texture at every scale: shapes over shapes, letters, codes."""
    sheet = _blank(size_m, px_per_m, rng)
    canvas = np.full((*sheet.shape, 3), 128, np.uint8)
    height, width = sheet.shape
    reach = 0.7 * px_per_m
    while reach > 0.012 * px_per_m:
        count = int(0.55 * height * width / reach**2)
        places = rng.uniform(0, 1, (count, 2)) * (width, height)
        shades = rng.uniform(35, 225, (count, 1)) + rng.normal(0, 14, (count, 3))
        angles, kinds = rng.uniform(0, 360, count), rng.integers(0, 2, count)
        for (x, y), shade, angle, kind in zip(places, shades, angles, kinds, strict=True):
            colour = tuple(float(v) for v in np.clip(shade, 20, 240))
            size = reach * rng.uniform(0.25, 0.75)
            if kind:
                box = cv2.boxPoints(((x, y), (size, size * 0.6), angle))
                cv2.fillPoly(canvas, [box.astype(np.int32)], colour, cv2.LINE_AA)
            else:
                axes = (int(size / 2) + 1, int(size / 3) + 1)
                cv2.ellipse(canvas, (int(x), int(y)), axes, angle, 0, 360, colour, -1, cv2.LINE_AA)
        reach *= 0.6
    sheet.pixels[:] = canvas
    for _ in range(int(4 * np.prod(size_m))):
        text = marks.text_mask(marks.LINES[rng.integers(len(marks.LINES))], 0.04 * px_per_m, 800)
        x, y = rng.uniform(0, 1, 2) * (width, height)
        shade = float(rng.choice([25, 235]))
        _stamp(sheet, text, x, y, (shade, shade, shade), 0.9, float(rng.uniform(0, 360)))
    sheet.darken(1 + 0.04 * rng.standard_normal(sheet.shape, np.float32))
    return sheet.pixels


def _blank(size_m: tuple[float, float], px_per_m: float, rng: np.random.Generator) -> Sheet:
    columns, rows = (round(edge * px_per_m) for edge in size_m)
    return Sheet(np.empty((rows, columns, 3), np.float32), px_per_m, rng)


def _concrete_base(sheet: Sheet) -> None:
    """Clouds, cement mottling, sand, stones that show, pinholes."""
    rng, shape, scale = sheet.rng, sheet.shape, sheet.px_per_m
    clouds = octave_noise(shape, 1.6 * scale, 0.02 * scale, rng, 0.75)
    white = rng.standard_normal(shape, np.float32)
    fine = np.asarray(cv2.GaussianBlur(white, (0, 0), 1.1), np.float32)
    stones = np.asarray(cv2.GaussianBlur(white[::-1, ::-1], (0, 0), 2.6), np.float32)
    worn = smooth_noise(shape, 0.8 * scale, rng)
    warm = smooth_noise(shape, 0.5 * scale, rng)
    # Blurred white noise has the deviation 1 / (2 sqrt(pi) sigma).
    gains = np.array([1.1, 2.6], np.float32) * np.float32(2 * np.sqrt(np.pi))
    colour = np.array(_CONCRETE, np.float32)
    _mix_concrete(colour, clouds, white, fine, stones, gains, worn, warm, sheet.pixels)


@njit(cache=True, error_model="numpy")
def _mix_concrete(
    colour: NDArray, clouds: NDArray, white: NDArray, fine: NDArray, stones: NDArray,
    gains: NDArray, worn: NDArray, warm: NDArray, out: NDArray,
) -> None:  # fmt: skip
    """Every layer of the base in one pass; stones and voids show where the surface is worn."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            sand, stone = gains[0] * fine[i, j], gains[1] * stones[i, j]
            tone = 1 + 0.06 * clouds[i, j] + 0.035 * white[i, j] + 0.04 * sand
            tone -= 0.30 * min(max(sand - 2.2, 0.0), 0.8)  # pinholes
            relief = 0.22 * min(max(stone - 1.2, 0.0), 0.5)
            relief -= 0.26 * min(max(-stone - 1.3, 0.0), 0.5)
            tone += relief * min(max(0.55 + worn[i, j], 0.0), 1.0)
            out[i, j, 0] = colour[0] * (tone + 0.012 * warm[i, j])
            out[i, j, 1] = colour[1] * (tone + 0.003 * warm[i, j])
            out[i, j, 2] = colour[2] * (tone - 0.014 * warm[i, j])


def _spots(sheet: Sheet, count: int, radius_m: tuple[float, float], depth: float) -> None:
    """Stains: oil, water and rust, with ragged rims."""
    for _ in range(count):
        rng = sheet.rng
        radius = rng.uniform(*radius_m) * rng.random() ** 0.7 * sheet.px_per_m + 4
        x, y = rng.uniform(0, 1, 2) * sheet.shape[::-1]
        part, x, y = sheet.window(x, y, 1.8 * radius)
        rows, columns = (np.arange(n, dtype=np.float32) for n in part.shape)
        distance = np.hypot((columns[None] - x) * rng.uniform(0.7, 1.3), rows[:, None] - y) / radius
        distance += 0.25 * octave_noise(part.shape, max(radius * 0.8, 8), 3, rng, 0.6)
        body = np.clip((1 - distance) * rng.uniform(1.5, 6), 0, 1).astype(np.float32)
        rim = np.exp(-(((distance - 0.9) / 0.07) ** 2)).astype(np.float32)
        strength = depth * rng.uniform(0.3, 1.0)
        colour = ((46, 42, 38), (70, 66, 60), (112, 82, 58), (206, 204, 198))[rng.integers(4)]
        part.blend(colour, strength * np.maximum(body, 0.7 * rim))


def _arcs(sheet: Sheet, count: int, length_m: tuple[float, float], depth: float) -> None:
    """Trowel marks, scuffs and rubber: bent strokes, dark or light."""
    rng = sheet.rng
    for tone in ((40, 39, 38), (214, 212, 206)):
        layer = np.zeros(sheet.shape, np.uint8)
        for _ in range(count // 2):
            length = rng.uniform(*length_m) * sheet.px_per_m
            bend = rng.uniform(0, 2 * np.pi) + np.cumsum(rng.normal(rng.normal(0, 0.1), 0.05, 12))
            steps = length / 12 * np.stack([np.cos(bend), np.sin(bend)], 1)
            points = rng.uniform(0, 1, 2) * sheet.shape[::-1] + steps.cumsum(0)
            thick = int(rng.choice([1, 1, 1, 2, 3, 5]))
            value = int(rng.integers(60, 255))
            cv2.polylines(layer, [fixed_point(points)], False, value, thick, cv2.LINE_AA, 3)
        sheet.blend(tone, layer * np.float32(depth / 255))


def _cracks(sheet: Sheet, count: int) -> None:
    """Wandering cracks with branches."""
    rng = sheet.rng
    layer = np.zeros(sheet.shape, np.uint8)
    step = 0.02 * sheet.px_per_m
    seeds = [
        (rng.uniform(0, 1, 2) * sheet.shape[::-1], rng.uniform(0, 2 * np.pi), int(n), 2)
        for n in rng.integers(25, 130, count)
    ]
    while seeds:
        place, angle, length, thick = seeds.pop()
        turns = angle + np.cumsum(rng.normal(0, 0.28, length))
        points = place + np.cumsum(step * np.stack([np.cos(turns), np.sin(turns)], 1), 0)
        cv2.polylines(layer, [fixed_point(points)], False, 255, thick, cv2.LINE_AA, 3)
        if length > 40:
            for k in rng.integers(5, length - 5, 2):
                fork = turns[k] + rng.choice([-1, 1]) * rng.uniform(0.5, 1.2)
                seeds.append((points[k], fork, length // 3, 1))
    sheet.blend((58, 54, 50), layer * np.float32(0.75 / 255))


def _joints(sheet: Sheet, size_m: tuple[float, float]) -> None:
    """Saw cuts that divide the slab: a dark line each."""
    half = max(1, round(0.0025 * sheet.px_per_m))
    dark = np.float32(0.4)
    for k in range(1, int(size_m[0] // 2.7) + 1):
        x = round((k * 2.7 - 1.1) * sheet.px_per_m)
        sheet.pixels[:, x - half : x + half] *= dark
    for k in range(1, int(size_m[1] // 2.7) + 1):
        y = round((k * 2.7 - 0.4) * sheet.px_per_m)
        sheet.pixels[y - half : y + half] *= dark


def _tape_and_paint(sheet: Sheet, count: int) -> None:
    """Floor tape, chalk figures, stencilled words, drops of paint."""
    rng, scale = sheet.rng, sheet.px_per_m
    for _ in range(count):
        x, y = rng.uniform(0, 1, 2) * sheet.shape[::-1]
        turn = float(rng.uniform(0, 360))
        kind = rng.integers(4)
        if kind == 0:
            strip = np.full((int(0.05 * scale), int(rng.uniform(0.15, 0.9) * scale)), 255, np.uint8)
            colour = ((222, 178, 30), (212, 210, 204), (60, 84, 150), (170, 40, 36))[
                rng.integers(4)
            ]
            _stamp(sheet, strip, x, y, colour, 0.72, turn)
        elif kind == 1:
            text = marks.text_mask(f"{rng.integers(1, 99)}-{rng.choice(list('ABCDEF'))}",
                                   rng.uniform(0.05, 0.16) * scale, 500)  # fmt: skip
            _stamp(sheet, text, x, y, (226, 224, 214), 0.55, turn)
        elif kind == 2:
            mark = marks.symbol(int(rng.integers(4)), int(rng.uniform(0.1, 0.22) * scale))
            _stamp(sheet, mark, x, y, (206, 160, 40), 0.5, turn)
        else:
            drops = np.zeros((int(0.2 * scale), int(0.2 * scale)), np.uint8)
            for u, v, r in rng.uniform(0.1, 0.9, (14, 3)):
                centre = (int(u * drops.shape[1]), int(v * drops.shape[0]))
                cv2.circle(drops, centre, int(1 + r**3 * 0.02 * scale), 255, -1, cv2.LINE_AA)
            colour = ((230, 228, 222), (40, 70, 120), (130, 30, 28))[rng.integers(3)]
            _stamp(sheet, drops, x, y, colour, 0.8, turn)


def _litter(sheet: Sheet, count: int) -> None:
    """Flat scraps: shreds of board and tape, splinters, grit."""
    rng, scale = sheet.rng, sheet.px_per_m
    for _ in range(count):
        x, y = rng.uniform(0, 1, 2) * sheet.shape[::-1]
        size = (0.004 + 0.02 * rng.random() ** 3) * scale
        angle = np.sort(rng.uniform(0, 2 * np.pi, 5))
        radius = size * rng.uniform(0.4, 1.0, 5)
        outline = (
            np.stack([np.cos(angle) * rng.uniform(0.3, 1), np.sin(angle)], 1) * radius[:, None]
        )
        part, x, y = sheet.window(x, y, size + 4)
        scrap = np.zeros(part.shape, np.uint8)
        cv2.fillPoly(scrap, [fixed_point(outline + np.array([x, y]))], 255, cv2.LINE_AA, 3)
        shadow = cv2.GaussianBlur(np.roll(scrap, (1, 1), (0, 1)), (0, 0), 1.0)
        part.darken(1 - shadow * np.float32(0.4 / 255))
        tone = rng.uniform(0.45, 1.15)
        colour = ((186, 148, 106), (120, 116, 110), (222, 220, 214), (90, 70, 52))[rng.integers(4)]
        r, g, b = (min(tone * c, 235.0) for c in colour)
        part.blend((r, g, b), scrap * np.float32(0.9 / 255))


def _notice(sheet: Sheet) -> None:
    """A sheet of paper on the wall."""
    rng, scale = sheet.rng, sheet.px_per_m
    height, width = int(0.297 * scale), int(0.21 * scale)
    x = rng.uniform(0.1, 0.9) * sheet.shape[1]
    y = sheet.shape[0] - rng.uniform(0.5, 2.0) * scale
    paper = ((236, 234, 226), (228, 214, 160), (206, 220, 230), (214, 90, 70))[rng.integers(4)]
    _stamp(sheet, np.full((height, width), 255, np.uint8), x, y, paper, 0.95, rng.normal(0, 2))
    _stamp(sheet, marks.label(width, height, rng), x, y, (40, 38, 44), 0.9, 0.0)


def _stamp(
    sheet: Sheet, mark: NDArray[np.uint8], x: float, y: float, colour: Colour, cover: float,
    turn_deg: float,
) -> None:  # fmt: skip
    """Paint a mask, worn through here and there."""
    part, x, y = sheet.window(x, y, float(np.hypot(*mark.shape)) / 2 + 3)
    layer = np.zeros(part.shape, np.uint8)
    marks.stamp(layer, mark, x, y, turn_deg)
    worn = np.clip(cover - 0.16 * octave_noise(part.shape, 24, 1, sheet.rng, 0.9), 0, 1)
    part.blend(colour, layer * worn * np.float32(1 / 255))
