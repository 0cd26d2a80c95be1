"""Where each pixel of a camera looks, and how pixels move with directions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.io.lens import Lens


@dataclass(frozen=True, eq=False)
class PixelRays:
    """A lens, pixel by pixel.

    Attributes:
        camera: The camera without its distortion; the camera itself if it has none.
        bent: (6, height, width) float32, or None for a pinhole camera: x and y of the directions
            with z = 1, then the change of the column with x and y and of the row with x and y [px].
    """

    camera: PinholeCamera
    bent: NDArray[np.float32] | None = None

    @classmethod
    def of(cls, lens: Lens) -> PixelRays:
        if not lens.bends:
            return cls(lens.pinhole())
        x, y = np.moveaxis(lens.rays()[..., :2], -1, 0)
        x_row, x_column = np.gradient(x)
        y_row, y_column = np.gradient(y)
        determinant = x_column * y_row - x_row * y_column
        moves = np.array([y_row, -x_row, -y_column, x_column]) / determinant
        return cls(lens.pinhole(), np.concatenate([[x, y], moves]).astype(np.float32))
