"""An animation: the images of both robots, and the aerial surface moving to its place in the map.
Only the ends of the motion are results: where the particles place the surface, and where refinement
does."""

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
"""Height from which the surface starts [m]."""
FALLING, SETTLING = 22, 10
"""Pictures of the way down, and of refinement."""
STEP_MS, PAUSE_MS, END_MS = 90, 900, 2200
QUALITY = 60
"""Quality of WebP, 1 to 100."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One picture (height, width, 3), and how long it is shown [ms]."""

    picture: NDArray[np.uint8]
    duration_ms: int


def landing(showcase: Showcase, T_ground_mav: SE3) -> Iterator[Frame]:
    """The surface falls to where the particles place it, and moves to where refinement does."""
    above = _both_views(showcase)
    guess = showcase.steps[0].belief.T_ground_mav
    high = SE3(guess.rotation, guess.translation + np.array([0.0, 0.0, FALL_M]))
    view = _viewpoint(T_ground_mav @ showcase.surface.cloud_mav.points)
    for start, end, count, pause_ms in (
        (high, guess, FALLING, PAUSE_MS),
        (guess, T_ground_mav, SETTLING, END_MS),
    ):
        for share in np.linspace(0, 1, count + 1)[1:]:
            T = interpolate(start, end, eased(share))
            placed = replace(showcase, aerial_cloud=moved(showcase.surface.cloud_mav, T))
            picture = np.vstack([above, render_augmented_map(placed, view, MAP_PX)])
            yield Frame(picture, STEP_MS if share < 1 else pause_ms)


def eased(share: float) -> float:
    """From 0 to 1 with zero speed at both ends."""
    return float(share * share * (3 - 2 * share))


def save_landing(path: Path, showcase: Showcase, T_ground_mav: SE3) -> None:
    """Write the animation as a WebP file that repeats."""
    frames = list(landing(showcase, T_ground_mav))
    first, *others = (Image.fromarray(frame.picture) for frame in frames)
    durations = [frame.duration_ms for frame in frames]
    first.save(
        path, save_all=True, append_images=others, duration=durations, loop=0, quality=QUALITY
    )


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
    """From above and beside, with the surface in the middle of the picture."""
    target = np.median(points_ground, axis=0).astype(np.float64)
    reach = float(np.ptp(points_ground[:, :2], axis=0).max())
    eye = target + reach * np.array([-0.45, -0.75, 0.8])
    return Viewpoint(eye, target + np.array([0.0, 0.0, 0.1 * reach]))
