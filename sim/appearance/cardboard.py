"""Generated pictures of cardboard: every face of every box its own.

A face is painted in true proportion (square pixels): board, creases, print, tape, labels, wear.
Only at the end it is stretched to the square of a cube texture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sim.appearance import print_marks as marks
from sim.appearance import wear
from sim.appearance.sheet import Colour, Sheet
from sim.geometry.noise import Image, cloud_bank, crop, fibre_bank, mottle_bank

BOARDS: tuple[Colour, ...] = (
    (187, 147, 104), (176, 133, 90), (199, 163, 121), (165, 124, 84), (190, 152, 112),
    (181, 140, 94), (206, 174, 136), (228, 224, 214), (171, 137, 104), (193, 158, 116),
    (160, 122, 88), (184, 150, 112),
)  # fmt: skip
INKS: tuple[Colour, ...] = (
    (42, 38, 36), (42, 38, 36), (33, 56, 120), (158, 34, 32), (24, 96, 62), (196, 88, 20),
    (70, 40, 110), (20, 110, 140),
)  # fmt: skip
TAPES: tuple[Colour, ...] = ((196, 160, 108), (150, 104, 58), (214, 200, 172), (232, 230, 224))
FaceKind = Literal["flaps", "end", "side"]
"""Top or bottom; a side on which the tape from the seam ends; a side along the seam."""

_FLUTE_M = 0.0072  # spacing of the corrugation that shows through the liner


@dataclass(frozen=True)
class Make:
    """What boxes of one make share.

    Attributes:
        board, ink, accent, tape: Display colours, 0 to 255 RGB.
        weight: Boldness of the lettering.
        layout: Seed of the places of the print.
        band: Whether a band of colour runs around the sides.
    """

    board: Colour
    ink: Colour
    accent: Colour
    tape: Colour
    brand: str
    mark: int
    weight: int
    layout: int
    band: bool

    @classmethod
    def draw(cls, rng: np.random.Generator, brand: str) -> Make:
        inks = rng.permutation(len(INKS))
        return cls(
            board=BOARDS[rng.integers(len(BOARDS))],
            ink=INKS[inks[0]],
            accent=INKS[inks[1]],
            tape=TAPES[rng.integers(len(TAPES))],
            brand=brand,
            mark=int(rng.integers(8)),
            weight=int(rng.choice([400, 600, 800, 900])),
            layout=int(rng.integers(2**31)),
            band=bool(rng.random() < 0.25),
        )


def paint_face(
    make: Make,
    size_m: tuple[float, float],
    kind: FaceKind,
    longest_px: int,
    rng: np.random.Generator,
    printed: bool = True,
) -> Image:
    """The picture of one face, upright: rows go down, columns to the right.

    Args:
        make: Features that the box shares with others of its make.
        size_m: Width and height of the face [m].
        kind: Kind of the face.
        longest_px: Pixels along the longer edge.
        rng: Source of the features of this face alone.
        printed: Whether the face may carry print, labels and stickers.

    Returns:
        (H, W, 3) float32 display values, 0 to 255, unlit, in the face's proportion.
    """
    px_per_m = longest_px / max(size_m)
    width, height = (max(48, round(edge * px_per_m)) for edge in size_m)
    sheet = Sheet(np.empty((height, width, 3), np.float32), px_per_m, rng)
    _board(sheet, make)
    if kind == "flaps":
        _flap_seam(sheet)
        if printed:
            _flap_print(sheet, make)
        wear.tape_seam(sheet, make.tape)
    else:
        if printed:
            _side_print(sheet, make)
        if kind == "end":
            wear.tape_end(sheet, make.tape)
    if printed and rng.random() < (0.45 if kind == "flaps" else 0.3):
        wear.shipping_label(sheet)
    if printed and rng.random() < 0.22:
        wear.sticker(sheet)
    wear.wear(sheet)
    return sheet.pixels


def _board(sheet: Sheet, make: Make) -> None:
    """Kraft liner: fibres, clouds, and the flutes showing through."""
    rng, shape = sheet.rng, sheet.shape
    fibre = crop(fibre_bank(), shape, rng)
    cloud = crop(mottle_bank(), shape, rng)
    x = np.arange(shape[1], dtype=np.float32) / (sheet.px_per_m * _FLUTE_M) * 2 * np.pi
    flutes = np.sin(x + rng.uniform(0, 6)).astype(np.float32)[None]
    tone = 1 + np.float32(0.046) * fibre + cloud * (np.float32(0.034) + np.float32(0.008) * flutes)
    tone += np.float32(0.01) * flutes
    tone += np.float32(0.05) * crop(cloud_bank(256), shape, rng)
    tint = np.array(make.board) * (1 + rng.normal(0, 0.012, 3)) * rng.uniform(0.88, 1.06)
    warm = crop(mottle_bank(), shape, rng)
    for channel, sway in enumerate((0.006, 0.0, -0.022)):
        colour = np.float32(tint[channel])
        sheet.pixels[..., channel] = colour * tone + (colour * np.float32(sway)) * warm


def _flap_seam(sheet: Sheet) -> None:
    """Two outer flaps meet along the middle; the inner ones press through."""
    height, width = sheet.shape
    middle = height / 2 + sheet.rng.normal(0, 1)
    sheet.crease((0, middle), (width, middle + sheet.rng.normal(0, 1.5)), 0.62, 2)
    for x in (width * 0.24, width * 0.76):
        sheet.crease((x, 0), (x + sheet.rng.normal(0, 3), height), 0.1, 2)


def _ink(sheet: Sheet, mask: NDArray[np.uint8], colour: Colour, strength: float = 0.88) -> None:
    """Print: thin where fibres stand out."""
    rows = np.flatnonzero(mask.any(1))
    if not len(rows):
        return
    top, bottom = rows[0], rows[-1] + 1
    part = Sheet(sheet.pixels[top:bottom], sheet.px_per_m, sheet.rng)
    fibre = crop(fibre_bank(), part.shape, sheet.rng)
    thin = np.clip(np.float32(strength) - np.float32(0.1) * fibre, 0, 1)
    part.blend(colour, mask[top:bottom] * thin * np.float32(1 / 255))


def _side_print(sheet: Sheet, make: Make) -> None:
    """Trade mark, name, lines of text, symbols and bar code, in the make's own layout."""
    height, width = sheet.shape
    layout = np.random.default_rng(make.layout)
    main, second = np.zeros(sheet.shape, np.uint8), np.zeros(sheet.shape, np.uint8)
    if make.band:
        top = int(height * layout.uniform(0.04, 0.14))
        second[top : top + int(height * layout.uniform(0.06, 0.14))] = 255
    side = max(16, int(min(height, width) * layout.uniform(0.18, 0.32)))
    y = height * layout.uniform(0.28, 0.44)
    left = layout.random() < 0.5
    marks.stamp(
        second if layout.random() < 0.5 else main,
        marks.logo(make.mark, side),
        0.07 * width + side / 2 if left else 0.93 * width - side / 2,
        y,
    )
    room = 0.82 * width - side
    size = min(height * layout.uniform(0.12, 0.24), room / (1.0 * len(make.brand)))
    name = marks.text_mask(make.brand, size, make.weight)
    shift = (side + 0.05 * width) / 2
    marks.stamp(main, name, width / 2 + (shift if left else -shift), y)
    line_px = max(5.0, height * layout.uniform(0.03, 0.05))
    for k in range(int(layout.integers(2, 5))):
        text = marks.LINES[layout.integers(len(marks.LINES))]
        target = main if k % 2 else second
        marks.write(target, text, width * 0.07, height * 0.66 + 1.7 * k * line_px, line_px, 600)
    for k in range(int(layout.integers(1, 4))):
        side = max(14, int(min(height, width) * 0.15))
        mark = marks.symbol(int(layout.integers(4)), side)
        marks.stamp(main, mark, width * 0.9 - 1.15 * side * k, height * 0.87)
    if layout.random() < 0.6:
        code = marks.bar_code(max(40, int(width * 0.22)), max(16, int(height * 0.13)), sheet.rng)
        marks.stamp(main, code, width * 0.82, height * 0.68)
    _ink(sheet, second, make.accent)
    _ink(sheet, main, make.ink)


def _flap_print(sheet: Sheet, make: Make) -> None:
    """What stands on the flaps."""
    height, width = sheet.shape
    rng = np.random.default_rng(make.layout + 1)
    mask = np.zeros(sheet.shape, np.uint8)
    size = max(7.0, min(height * 0.15, width / (1.2 * len(make.brand))))
    name = marks.text_mask(make.brand, size, make.weight)
    turn = float(rng.choice([0, 180]))
    marks.stamp(mask, name, width * rng.uniform(0.45, 0.55), height * 0.24, turn)
    text = marks.text_mask(
        marks.LINES[rng.integers(len(marks.LINES))], max(6.0, height * 0.06), 600
    )
    marks.stamp(mask, text, width * rng.uniform(0.5, 0.65), height * 0.78, 180 - turn)
    if rng.random() < 0.7:
        mark = marks.logo(make.mark, max(16, int(height * 0.22)))
        marks.stamp(mask, mark, width * 0.14, height * 0.77)
    _ink(sheet, mask, make.ink, 0.8)
