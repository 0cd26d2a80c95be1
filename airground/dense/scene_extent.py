"""How near and how far the scene before a view is (Sec. VIII-B).

The paper reads it off the sparse map of the monocular SLAM, which lacks what just came into view.
So corners of the reference are tracked into its farthest view and triangulated as well, and both
ranges are joined."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.core.arrays import F32, F64, U8, Mask
from airground.core.camera import PinholeCamera
from airground.dense.view_selection import PosedImage

MAX_CORNERS = 600
MIN_POINTS = 30
"""Fewer triangulated points say nothing of the extent."""
MAX_BACKWARD_ERROR_PX = 0.7
MAX_EPIPOLAR_ERROR_PX = 1.0
MIN_PARALLAX_PX = 3.0
ROBUST_PERCENT = 1.0
"""Share of the points at either end that may be mistakes [%]."""
MARGIN = 0.06
"""Room at either end, as a share of the depth: three times what 0.4 px of tracking error
do at 12 cm baseline, and more than 5 cm wherever the MAV flies."""


@dataclass(frozen=True)
class Extent:
    """Depth range before a view [m]."""

    near_m: float
    far_m: float


def scene_extent(
    reference: PosedImage,
    views: list[PosedImage],
    camera: PinholeCamera,
    mapped: tuple[float, float] | None = None,
) -> Extent | None:
    """The depth range before `reference`, or None where too little is known of it.

    Args:
        reference: View before which the scene lies.
        views: Other views of the scene; the one with the longest baseline is used.
        camera: Camera of all views.
        mapped: Depth range of the sparse map in the view [m]; None without a map.
    """
    ranges = [] if mapped is None else [mapped]
    if views:
        far_view = max(views, key=reference.baseline)
        depths = triangulated_depths(reference, far_view, camera)
        if len(depths) >= MIN_POINTS:
            near, far = np.percentile(depths, [ROBUST_PERCENT, 100 - ROBUST_PERCENT])
            ranges.append((float(near), float(far)))
    if not ranges:
        return None
    nearest, farthest = min(near for near, _ in ranges), max(far for _, far in ranges)
    return Extent(nearest * (1 - MARGIN), farthest * (1 + MARGIN))


def triangulated_depths(reference: PosedImage, view: PosedImage, camera: PinholeCamera) -> F64:
    """(N,) depths in `reference` [m] of corners found again in `view`."""
    corners = cv2.goodFeaturesToTrack(reference.image, MAX_CORNERS, 0.005, 12)
    if corners is None:
        return np.empty(0)
    there, found = _track(reference.image, view.image, corners)
    back, found_back = _track(view.image, reference.image, there)
    good = found & found_back
    good &= np.linalg.norm(back - corners, axis=2)[:, 0] < MAX_BACKWARD_ERROR_PX
    return _depths(reference, view, camera, corners[good, 0], there[good, 0])


def _track(start: U8, end: U8, corners: NDArray[Any]) -> tuple[F32, Mask]:
    moved, status, _ = cv2.calcOpticalFlowPyrLK(  # type: ignore[call-overload]
        start, end, corners, None, winSize=(15, 15), maxLevel=4
    )
    return moved, status[:, 0] == 1


def _depths(
    reference: PosedImage, view: PosedImage, camera: PinholeCamera, here: F32, there: F32
) -> F64:
    """Depths of matched pixels (N, 2) that hold to the epipolar line and have parallax.
    With rays r (reference) and s (view) and the view's centre c: z (r x s) = c x s."""
    T_reference_view = reference.T_mav_camera.inverse() @ view.T_mav_camera
    inverse = np.linalg.inv(camera.matrix())
    rays = np.column_stack([here, np.ones(len(here))]) @ inverse.T
    others = np.column_stack([there, np.ones(len(there))]) @ inverse.T
    others = others @ T_reference_view.rotation.T
    others = others / others[:, 2:]
    normal = np.cross(rays, others)
    parallax = np.linalg.norm(normal, axis=1)
    centre = T_reference_view.translation
    baseline = float(np.linalg.norm(centre))
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.einsum("ij,ij->i", np.cross(centre, others), normal) / parallax**2
        # the part of the motion that leaves the plane of centre and ray
        plane = np.cross(centre / baseline, rays)
        off = np.abs(np.einsum("ij,ij->i", plane, others)) / np.linalg.norm(plane, axis=1)
    good = (parallax * camera.fx > MIN_PARALLAX_PX) & (off * camera.fx < MAX_EPIPOLAR_ERROR_PX)
    result: F64 = depth[good & (depth > 0)]
    return result
