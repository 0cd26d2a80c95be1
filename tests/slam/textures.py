"""Pictures whose every patch is different, and what happens to them when a camera turns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates

from airground.core.camera import PinholeCamera

CAMERA = PinholeCamera(320, 240, 250.0, 240.0, 158.5, 121.5)


def texture(height: int = 240, width: int = 320, seed: int = 0) -> NDArray[np.uint8]:
    """Smooth random grey levels."""
    noise = gaussian_filter(np.random.default_rng(seed).normal(size=(height, width)), 2.0)
    return np.rint(128 + 40 * noise / noise.std()).clip(0, 255).astype(np.uint8)


def moved(image: NDArray[np.uint8], matrix: NDArray[np.float64]) -> NDArray[np.uint8]:
    """The image after what was at pixel x went to `matrix` (3, 3) times x; it goes on mirrored.

    By cubic splines: OpenCV's interpolation is off by 0.05 px, more than what is tested.
    """
    y, x = np.indices(image.shape)
    from_x, from_y, w = np.linalg.inv(matrix) @ np.stack([x.ravel(), y.ravel(), np.ones(x.size)])
    grey = map_coordinates(image.astype(float), [from_y / w, from_x / w], order=3, mode="mirror")
    return np.rint(grey).clip(0, 255).astype(np.uint8).reshape(image.shape)


def slid(image: NDArray[np.uint8], right_px: float, down_px: float) -> NDArray[np.uint8]:
    return moved(image, np.array([[1, 0, right_px], [0, 1, down_px], [0, 0, 1.0]]))


def turned(
    image: NDArray[np.uint8], R_a_b: NDArray[np.float64], camera: PinholeCamera = CAMERA
) -> NDArray[np.uint8]:
    """What a camera that saw `image` sees after turning: a point x_a is at R_a_b^T x_a."""
    K = camera.matrix()
    return moved(image, K @ R_a_b.T @ np.linalg.inv(K))
