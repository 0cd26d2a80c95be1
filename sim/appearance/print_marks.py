"""What is printed on cartons and stuck to them: names, symbols, bar codes, labels."""

from __future__ import annotations

import threading

import cv2
import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.uint8]

BRANDS = (
    "NORDWIND", "Helvia", "PAPAYA&CO", "Orbitronic", "LUMO", "Kestrel", "AGRANA", "Brixton",
    "solar fit", "VOLTA", "Mistral", "CASA VERDE", "Quanta", "PIONEER", "Tessera", "Rialto",
    "ALPINA", "Polaris", "DELTA 9", "Marlow", "ZEPHYR", "Cobalt", "HIGHLAND", "Nimbus",
)  # fmt: skip
LINES = (
    "FRAGILE", "HANDLE WITH CARE", "THIS SIDE UP", "KEEP DRY", "DO NOT STACK", "QTY 24 PCS",
    "GROSS 8.4 KG", "NET 6.9 KG", "MADE IN EUROPE", "HEAVY", "GLASS", "ART. NO 40-1187",
    "OFFICE SUPPLIES", "SPARE PARTS", "PAPER TOWELS", "ORGANIC TEA", "KITCHENWARE", "LED LAMPS",
    "BOOKS", "RETURN TO DEPOT", "LOT 0731-B", "RECYCLE ME", "OPEN HERE", "UN3481",
)  # fmt: skip


class _Fonts(threading.local):
    """A font a thread: drawing changes the font's inner state."""

    def __init__(self) -> None:
        self.sans = cv2.FontFace("sans")


_FONTS = _Fonts()


def write(mask: Mask, text: str, x: float, y: float, height_px: float, weight: int = 500) -> None:
    """Write `text` with its baseline's left end at (x, y), capitals `height_px` high."""
    size = max(4, round(height_px * 1.4))
    cv2.putText(mask, text, (round(x), round(y)), (255, 255, 255), _FONTS.sans, size, weight)


def text_mask(text: str, height_px: float, weight: int) -> Mask:
    """A mask that just holds the text."""
    width = int(len(text) * height_px * 1.05 + height_px)
    mask = np.zeros((int(height_px * 1.7), width), np.uint8)
    write(mask, text, height_px * 0.2, height_px * 1.25, height_px, weight)
    used = np.flatnonzero(mask.any(0))
    return mask[:, : used[-1] + 2] if len(used) else mask[:, :2]


def stamp(canvas: Mask, mark: Mask, x: float, y: float, turn_deg: float = 0.0) -> None:
    """Add `mark` to `canvas`, its centre at (x, y), turned counter-clockwise."""
    height, width = mark.shape
    matrix = cv2.getRotationMatrix2D(((width - 1) / 2, (height - 1) / 2), turn_deg, 1.0)
    matrix[:, 2] += [x - (width - 1) / 2, y - (height - 1) / 2]
    size = (canvas.shape[1], canvas.shape[0])
    np.maximum(canvas, cv2.warpAffine(mark, matrix, size, flags=cv2.INTER_LINEAR), out=canvas)


def logo(kind: int, side: int) -> Mask:
    """One of eight simple trade marks, `side` pixels square."""
    mask = np.zeros((side, side), np.uint8)
    c, r = side // 2, int(side * 0.44)
    thick = max(2, side // 11)
    match kind % 8:
        case 0:
            cv2.circle(mask, (c, c), r, 255, thick, cv2.LINE_AA)
            cv2.circle(mask, (c, c), r // 2, 255, -1, cv2.LINE_AA)
        case 1:
            points = np.array([[c, c - r], [c + r, c + r * 3 // 4], [c - r, c + r * 3 // 4]])
            cv2.fillPoly(mask, [points], 255, cv2.LINE_AA)
            cv2.circle(mask, (c, c + r // 4), r // 3, 0, -1, cv2.LINE_AA)
        case 2:
            for k in range(4):
                x = c - r + k * r * 2 // 4
                cv2.line(mask, (x, c + r), (x + r // 2, c - r), 255, thick, cv2.LINE_AA)
        case 3:
            cv2.ellipse(mask, (c, c), (r, r * 3 // 5), 25, 0, 360, 255, -1, cv2.LINE_AA)
            cv2.ellipse(mask, (c, c), (r * 2 // 3, r // 3), 25, 0, 360, 0, -1, cv2.LINE_AA)
        case 4:
            cv2.rectangle(mask, (c - r, c - r), (c + r, c + r), 255, thick)
            cv2.line(mask, (c - r, c + r), (c + r, c - r), 255, thick, cv2.LINE_AA)
        case 5:
            for k in range(6):
                a = k * np.pi / 3
                tip = (int(c + r * np.cos(a)), int(c + r * np.sin(a)))
                cv2.line(mask, (c, c), tip, 255, thick, cv2.LINE_AA)
        case 6:
            for k in range(3):
                cv2.ellipse(mask, (c, c + r // 2), (r - k * r // 3,) * 2, 0, 180, 360, 255, thick)
        case _:
            points = np.array([[c, c - r], [c + r, c], [c, c + r], [c - r, c]])
            cv2.fillPoly(mask, [points], 255, cv2.LINE_AA)
            cv2.rectangle(mask, (c - r // 4, c - r // 4), (c + r // 4, c + r // 4), 0, -1)
    return mask


def symbol(kind: int, side: int) -> Mask:
    """A handling symbol in its frame: arrows up, glass, umbrella, stack limit."""
    mask = np.zeros((side, side), np.uint8)
    s = side / 100
    line = max(1, round(5 * s))

    def at(*points: tuple[float, float]) -> NDArray[np.int32]:
        return np.round(np.array(points) * s).astype(np.int32)

    cv2.rectangle(mask, (line, line), (side - 1 - line, side - 1 - line), 255, line)
    match kind % 4:
        case 0:
            for x in (33, 67):
                tip = at((x, 16), (x + 15, 42), (x - 15, 42))
                cv2.fillPoly(mask, [tip], 255, cv2.LINE_AA)
                cv2.fillPoly(mask, [at((x - 5, 42), (x + 5, 42), (x + 5, 74), (x - 5, 74))], 255)
            cv2.fillPoly(mask, [at((14, 80), (86, 80), (86, 87), (14, 87))], 255)
        case 1:
            cup = at((28, 15), (72, 15), (66, 48), (54, 58), (54, 78), (70, 86), (30, 86), (46, 78),
                     (46, 58), (34, 48))  # fmt: skip
            cv2.fillPoly(mask, [cup], 255, cv2.LINE_AA)
            cv2.polylines(mask, [at((50, 15), (44, 28), (54, 34), (48, 46))], False, 0, line)
        case 2:
            centre, axes = (round(50 * s), round(52 * s)), (round(36 * s), round(32 * s))
            cv2.ellipse(mask, centre, axes, 0, 180, 360, 255, -1, cv2.LINE_AA)
            cv2.polylines(mask, [at((50, 50), (50, 80), (58, 86), (64, 80))], False, 255, line)
        case _:
            cv2.rectangle(mask, tuple(at((20, 58))[0]), tuple(at((80, 84))[0]), 255, -1)
            cv2.rectangle(mask, tuple(at((30, 26))[0]), tuple(at((70, 50))[0]), 255, line)
            cv2.line(mask, tuple(at((16, 20))[0]), tuple(at((84, 54))[0]), 255, line, cv2.LINE_AA)
    return mask


def bar_code(width: int, height: int, rng: np.random.Generator) -> Mask:
    """Upright bars, each at least a pixel wide, with digits below."""
    mask = np.zeros((height, width), np.uint8)
    unit = max(1.0, width / 95)
    edges = np.cumsum(rng.integers(1, 5, 70) * unit).astype(int)
    edges = edges[edges < width - 1]
    for left, right in zip(edges[::2], edges[1::2], strict=False):
        mask[: int(height * 0.8), left:right] = 255
    digits = "".join(map(str, rng.integers(0, 10, 12)))
    write(mask, digits, width * 0.08, height - 1, height * 0.14, 400)
    return mask


def matrix_code(side: int, rng: np.random.Generator) -> Mask:
    """A square code of random modules with three finder marks."""
    modules = (rng.random((21, 21)) < 0.5).astype(np.uint8) * 255
    for y, x in ((0, 0), (0, 14), (14, 0)):
        modules[y : y + 7, x : x + 7] = 255
        modules[y + 1 : y + 6, x + 1 : x + 6] = 0
        modules[y + 2 : y + 5, x + 2 : x + 5] = 255
    return np.asarray(cv2.resize(modules, (side, side), interpolation=cv2.INTER_NEAREST), np.uint8)


def label(width: int, height: int, rng: np.random.Generator) -> Mask:
    """The ink on a shipping label: address lines, a bar code, a square code, rules."""
    mask = np.zeros((height, width), np.uint8)
    rule = max(1, height // 90)
    cv2.rectangle(mask, (rule, rule), (width - 1 - rule, height - 1 - rule), 255, rule)
    brand = str(rng.choice(BRANDS)).upper()
    write(mask, brand, width * 0.05, height * 0.17, height * 0.1, 800)
    cv2.line(mask, (0, int(height * 0.23)), (width, int(height * 0.23)), 255, rule)
    for k in range(4):
        words = f"{rng.choice(LINES)} {rng.integers(10, 999)}"
        write(mask, words, width * 0.05, height * (0.32 + 0.075 * k), height * 0.045, 500)
    side = int(min(height * 0.26, width * 0.26))
    x, y = int(width * 0.68), int(height * 0.27)
    if x + side < width and y + side < height:
        mask[y : y + side, x : x + side] = matrix_code(side, rng)
    bars = bar_code(int(width * 0.86), int(height * 0.3), rng)
    y, x = int(height * 0.64), int(width * 0.07)
    mask[y : y + bars.shape[0], x : x + bars.shape[1]] |= bars[: height - y]
    return mask
