"""What is painted arrives where it should, in the right light."""

import numpy as np
import pytest

from sim.appearance.sheet import light_up


def at(image: np.ndarray, y: float, x: float) -> np.ndarray:
    """Bilinear value at a relative place; beyond the outer pixels' centres theirs."""
    height, width = image.shape[:2]
    row, column = np.clip(y * height - 0.5, 0, height - 1), np.clip(x * width - 0.5, 0, width - 1)
    y0, x0 = int(row), int(column)
    y1, x1 = min(y0 + 1, height - 1), min(x0 + 1, width - 1)
    fy, fx = row - y0, column - x0
    image = image.astype(np.float64)
    upper = image[y0, x0] * (1 - fx) + image[y0, x1] * fx
    lower = image[y1, x0] * (1 - fx) + image[y1, x1] * fx
    return upper * (1 - fy) + lower * fy


@pytest.mark.kernel
@pytest.mark.parametrize("size", [(7, 9), (20, 24), (31, 5)])
def test_light_is_that_of_the_obvious_twin(size: tuple[int, int]) -> None:
    rng = np.random.default_rng(0)
    pixels = rng.uniform(0, 255, (*size, 3)).astype(np.float32)
    light = rng.uniform(0, 1.4, (4, 3, 3)).astype(np.float32)
    out = np.empty((20, 24, 3), np.uint8)
    light_up(pixels, light, out)
    for i, j in np.ndindex(20, 24):
        y, x = (i + 0.5) / 20, (j + 0.5) / 24
        value = at(pixels, y, x) * at(light, y, x) + 0.5
        np.testing.assert_array_equal(out[i, j], np.clip(value, 0, 255).astype(np.uint8))
