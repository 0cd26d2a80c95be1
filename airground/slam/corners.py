"""Corners to follow, spread over the image."""

from __future__ import annotations

import cv2
import numpy as np

from airground.core.arrays import F32, U8, Mask

QUALITY = 2e-4
"""Smallest eigenvalue of a corner's gradient matrix: below it, noise is as strong."""
NOT_PREFERRED = 0.03
"""Factor on the strength of a corner without depth: chosen only where nothing else is near."""
BLOCK_PX = 5
BORDER_PX = 12
"""Least distance of a corner from the border [px]: its patch must lie in the image."""


def detect_corners(
    image: U8, occupied: F32, wanted: int, spacing_px: int, preferred: Mask | None = None
) -> F32:
    """The strongest corners, one a cell of a grid, where none is followed yet.

    The grid keeps a cluttered part of the scene from taking all corners, and the strongest
    of a cell is stable where "every pixel above a threshold" is not.

    Args:
        image: (height, width) grey image.
        occupied: (N, 2) pixels of the corners followed already.
        wanted: Most new corners, from the strongest cells.
        preferred: (height, width) mask of the pixels with depth, where corners are worth more.
        spacing_px: Side of a cell; also the least distance to an occupied pixel.

    Returns:
        (M, 2) pixels as (x, y), strongest first.
    """
    if wanted <= 0:
        return np.empty((0, 2), np.float32)
    strength = cv2.cornerMinEigenVal(image, BLOCK_PX, ksize=3)
    strength[:BORDER_PX] = strength[-BORDER_PX:] = 0
    strength[:, :BORDER_PX] = strength[:, -BORDER_PX:] = 0
    if preferred is not None:
        strength *= np.where(preferred, 1.0, NOT_PREFERRED).astype(np.float32)
    for x, y in occupied:
        cv2.circle(strength, (round(float(x)), round(float(y))), spacing_px, (0.0,), -1)
    rows, columns = (size // spacing_px for size in image.shape)
    cells = strength[: rows * spacing_px, : columns * spacing_px]
    cells = cells.reshape(rows, spacing_px, columns, spacing_px).swapaxes(1, 2)
    flat = cells.reshape(rows * columns, spacing_px * spacing_px)
    best = flat.argmax(axis=1)
    peak = flat[np.arange(len(flat)), best]
    chosen = np.argsort(-peak, kind="stable")[:wanted]
    chosen = chosen[peak[chosen] > QUALITY]
    y = chosen // columns * spacing_px + best[chosen] // spacing_px
    x = chosen % columns * spacing_px + best[chosen] % spacing_px
    return np.stack([x, y], axis=1).astype(np.float32)
