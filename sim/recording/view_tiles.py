"""The pinhole views that together show all that a camera with a lens and a shutter sees.

An image is cut into tiles. Each is seen by a pinhole camera of its own, turned towards the middle
of the tile and everywhere finer than the image. A rolling shutter's rows are cut into strips, so
that each strip is drawn close to the poses of its rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.io.lens import Lens

MAX_STRIP_S = 0.005
"""Longest readout of one strip [s]. Within half of it the MAV moves by 1.3 mm: an edge at 1 m is
displaced by half a pixel against what is behind it."""
MAX_TURN_RATE = 3.0
"""Fastest turn that a strip has margins for [rad/s]; the robots' stays below 2."""
DENSITY = 1.25
"""Pixels of a view per pixel of the image, where they are fewest. Resampled bicubically, pictures
then have 0.93 to 0.99 of the sharpness (deviation of the Laplacian) of ones averaged from 4 x 4
rays per pixel; with 1 they have 0.73 to 0.79, with 1.5 they alias (1.07 to 1.15)."""
FILTER_PX = 3
"""Pixels beyond a tile that the filter of 4 x 4 pixels and the smoothed edges need [px]."""
VIEW_COST_PX = 100_000
"""Cost of one more view, in pixels drawn: 5 ms of the 20 that 400,000 pixels take."""
SPLITS = ((1, 1), (2, 1), (1, 2), (2, 2), (3, 1), (3, 2), (3, 3))
"""Numbers of tiles along columns and rows that are tried for a lens."""


@dataclass(frozen=True, eq=False)
class Tile:
    """A part of an image, and the pinhole camera that draws it.

    Attributes:
        name: Name of the view among all cameras of the drawn world.
        rows, columns: Part of the image.
        camera: Intrinsics of the view.
        T_camera_view: Turn of the view in the image's camera.
    """

    name: str
    rows: slice
    columns: slice
    camera: PinholeCamera
    T_camera_view: SE3


def is_plain(lens: Lens) -> bool:
    """Whether one pinhole view is the image itself."""
    return not lens.bends and lens.readout_s == 0


def tiles_of(camera: str, lens: Lens) -> list[Tile]:
    """The tiles of a camera of this name: those with the fewest pixels to draw."""
    if is_plain(lens):
        whole = slice(0, lens.height), slice(0, lens.width)
        return [Tile(camera, *whole, lens.pinhole(), SE3.identity())]
    strips = max(int(np.ceil(lens.readout_s / MAX_STRIP_S)), 1)
    splits = {(across, max(down, strips)) for across, down in SPLITS if lens.bends or across == 1}
    rays = lens.rays()
    choices = [
        _split(camera, lens, rays, *split, turned)
        for split in sorted(splits)
        for turned in (False, True)
    ]
    return min(choices, key=_cost)


def _cost(tiles: list[Tile]) -> float:
    return sum(tile.camera.width * tile.camera.height + VIEW_COST_PX for tile in tiles)


def _split(
    name: str, lens: Lens, rays: NDArray, across: int, down: int, turned: bool
) -> list[Tile]:
    """Tiles whose views look towards their middles if `turned`, else along the optical axis."""
    rows = np.linspace(0, lens.height, down + 1).round().astype(int)
    columns = np.linspace(0, lens.width, across + 1).round().astype(int)
    tiles: list[Tile] = []
    for top, bottom in pairwise(rows):
        for left, right in pairwise(columns):
            place = slice(int(top), int(bottom)), slice(int(left), int(right))
            spare_rad = MAX_TURN_RATE * lens.readout_s * (bottom - top) / lens.height / 2
            T_camera_view = _towards(rays[place]) if turned else SE3.identity()
            camera = _camera_over(rays, place, T_camera_view, float(spare_rad))
            tiles.append(Tile(f"{name}/{len(tiles)}", *place, camera, T_camera_view))
    return tiles


def _towards(rays: NDArray) -> SE3:
    """The least turn from the optical axis to the middle of a tile's rays (H, W, 3)."""
    corners = rays[[0, 0, -1, -1], [0, -1, 0, -1]]
    middle = (corners / np.linalg.norm(corners, axis=1, keepdims=True)).sum(0)
    middle /= np.linalg.norm(middle)
    axis = np.cross([0.0, 0.0, 1.0], middle)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-9:
        return SE3.identity()
    return SE3.from_rotation_vector(axis / sine * np.arctan2(sine, middle[2]))


def _camera_over(
    rays: NDArray, place: tuple[slice, slice], T_camera_view: SE3, spare_rad: float
) -> PinholeCamera:
    """The smallest pinhole camera over a tile, `DENSITY` times as fine as the image."""
    seen = rays[place] @ T_camera_view.rotation
    straight = seen[..., :2] / seen[..., 2:]
    focal_px = DENSITY / _finest_step(straight)
    low, high = straight.min((0, 1)), straight.max((0, 1))
    # A turn moves what is off the axis by more: by 1 / cos^2 of the angle.
    spare = spare_rad * (1 + np.maximum(low**2, high**2).sum()) + FILTER_PX / focal_px
    first = np.floor((low - spare) * focal_px)
    size = np.ceil((high + spare) * focal_px) - first + 1
    return PinholeCamera(
        int(size[0]), int(size[1]), focal_px, focal_px, float(-first[0]), float(-first[1])
    )


def _finest_step(straight: NDArray) -> float:
    """Least distance of neighbouring pixels' rays in a view of focal length 1, in any direction."""
    along = np.diff(straight, axis=1)[:-1]
    down = np.diff(straight, axis=0)[:, :-1]
    jacobians = np.stack([along, down], axis=-1)
    return float(np.linalg.svd(jacobians, compute_uv=False)[..., -1].min())
