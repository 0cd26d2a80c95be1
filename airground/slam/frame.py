"""One image as SLAM takes it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Frame:
    """One image as the engine takes it.

    Attributes:
        stamp_ns: Of the image.
        image: (height, width) grey.
        depth: (height, width) [m], NaN where missing; None without a depth camera.
    """

    stamp_ns: int
    image: NDArray[np.uint8]
    depth: NDArray[np.float32] | None = None
