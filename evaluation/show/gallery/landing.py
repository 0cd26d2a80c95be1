"""The whole idea in a few seconds: what both robots see, and the aerial surface finding its place.

Only drawn: the glide has no meaning but its ends, where the particles put the surface and where
refinement does.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from airground.core.se3 import SE3, interpolate
from airground.pipeline import moved
from evaluation.measure.showcase import Showcase
from evaluation.show.figures.scene_pictures import Viewpoint, render_augmented_map

WIDTH_PX = 720
MAP_PX = (WIDTH_PX, 440)
FALL_M = 1.2
"""The surface comes from so far above."""
FALLING, SETTLING = 22, 10
"""Pictures of its way down, and of its refinement."""
STEP_MS, PAUSE_MS, END_MS = 90, 900, 2200
QUALITY = 60


@dataclass(frozen=True, eq=False)
class Frame:
    """One picture, and how long it stays [ms]."""

    picture: NDArray[np.uint8]
    duration_ms: int


def landing(showcase: Showcase, T_ground_mav: SE3) -> Iterator[Frame]:
    """The surface falls to where the particles put it, and settles where refinement does.

    Args:
        showcase: With the surface, its first belief and the ground robot's map.
        T_ground_mav: The refined alignment of the surface.
    """
    above = _both_views(showcase)
    guess = showcase.steps[0].belief.T_ground_mav
    high = SE3(guess.rotation, guess.translation + np.array([0.0, 0.0, FALL_M]))
    view = _viewpoint(T_ground_mav @ showcase.surface.cloud_mav.points)

    def frame(T: SE3, duration_ms: int) -> Frame:
        placed = replace(showcase, aerial_cloud=moved(showcase.surface.cloud_mav, T))
        return Frame(np.vstack([above, render_augmented_map(placed, view, MAP_PX)]), duration_ms)

    for start, end, count, pause_ms in (
        (high, guess, FALLING, PAUSE_MS),
        (guess, T_ground_mav, SETTLING, END_MS),
    ):
        for share in np.linspace(0, 1, count + 1)[1:]:
            duration_ms = STEP_MS if share < 1 else pause_ms
            yield frame(interpolate(start, end, _eased(share)), duration_ms)


def save_landing(path: Path, showcase: Showcase, T_ground_mav: SE3) -> None:
    """Write it as an animated WebP that repeats."""
    frames = list(landing(showcase, T_ground_mav))
    first, *others = (Image.fromarray(frame.picture) for frame in frames)
    durations = [frame.duration_ms for frame in frames]
    first.save(
        path, save_all=True, append_images=others, duration=durations, loop=0, quality=QUALITY
    )


def _eased(share: float) -> float:
    """From 0 to 1 without a jerk."""
    return float(share * share * (3 - 2 * share))


def _both_views(showcase: Showcase) -> NDArray[np.uint8]:
    """(height, WIDTH_PX, 3): the MAV's image beside the ground robot's."""
    aerial, ground = showcase.mav_image, showcase.ground_image
    if aerial.ndim == 2:
        aerial = np.repeat(aerial[..., None], 3, axis=2)
    aspects = [image.shape[1] / image.shape[0] for image in (aerial, ground)]
    height = round(WIDTH_PX / sum(aspects))
    left = round(height * aspects[0])
    pictures = [
        cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
        for image, width in ((aerial, left), (ground, WIDTH_PX - left))
    ]
    return np.hstack(pictures).astype(np.uint8)


def _viewpoint(points_ground: NDArray) -> Viewpoint:
    """From above and aside, with the place of the surface in the middle."""
    target = np.median(points_ground, axis=0).astype(np.float64)
    reach = float(np.ptp(points_ground[:, :2], axis=0).max())
    eye = target + reach * np.array([-0.45, -0.75, 0.8])
    return Viewpoint(eye, target + np.array([0.0, 0.0, 0.1 * reach]))
