"""How far what the MAV reconstructed lies from the true surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from sim.truth import Truth


@dataclass(frozen=True)
class SurfaceError:
    """Distances of a depth map's points to the true surface.

    Attributes:
        error_m: (height, width) float64 [m], NaN where the map has no depth.
        median_m, p90_m: Of those that are finite [m]; NaN for an empty map.
        completeness: Share of the pixels that have a depth.
    """

    error_m: NDArray[np.float64]
    median_m: float
    p90_m: float
    completeness: float


def surface_error(
    depth: NDArray[np.float32], camera: PinholeCamera, T_world_camera: SE3, truth: Truth
) -> SurfaceError:
    """Compare a depth map with the truth, point by nearest point.

    Args:
        depth: (height, width) [m], NaN where missing.
        camera: The camera that the pipeline believes in, wrong calibration and all.
        T_world_camera: Where the reference view truly was, so that errors of the poses'
            drift do not count here.
        truth: The scene.
    """
    seen = np.isfinite(depth)
    error = np.full(depth.shape, np.nan)
    if not seen.any():
        return SurfaceError(error, np.nan, np.nan, 0.0)
    points_camera = camera.back_project(depth.astype(np.float64))[seen]
    error[seen] = np.abs(truth.distance_to_surface(T_world_camera @ points_camera))
    return SurfaceError(
        error,
        float(np.median(error[seen])),
        float(np.quantile(error[seen], 0.9)),
        float(seen.mean()),
    )


def depth_error(
    depth: NDArray[np.float32], camera: PinholeCamera, stamp_ns: int, truth: Truth
) -> NDArray[np.float32]:
    """(height, width) depth minus true depth [m] of a view of the MAV, NaN where one is missing.

    Args:
        depth, camera: As in `surface_error`.
        stamp_ns: When the view was taken.
        truth: The scene, and where the camera truly was.
    """
    return (depth - truth.cast(camera, truth.T_world_mav_camera(stamp_ns))).astype(np.float32)
