"""A structured-light depth camera of the Kinect's kind.

Axial and lateral noise are those of Nguyen, Izadi and Lovell, "Modeling Kinect Sensor Noise
for Improved 3D Reconstruction and Tracking" (3DIMPVT 2012), Eq. 2 to 4. Disparity is rounded;
what the projector does not light, what is seen at a grazing angle and what is out of range
is missing.
"""

from __future__ import annotations

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from sim.presets import DepthNoise
from sim.sensors.hashed_noise import gaussian, noise_key

BASELINE_M = 0.075
INFRARED_FOCAL_PX = 585.0
_CORRELATION_PX = 1.0  # the matching window correlates neighbouring errors
_PATCH_PX = 16  # whole patches of a surface seen at a grazing angle vanish together


def kinect_depth(
    depth: NDArray[np.float32],
    camera: PinholeCamera,
    noise: DepthNoise,
    rng: np.random.Generator,
) -> NDArray[np.float32]:
    """What a Kinect would measure.

    Args:
        depth: (height, width) true depth along the optical axis [m], NaN for nothing.
        camera: True intrinsics of the camera that depth is registered to.
        noise: How large the faults are.
        rng: Source of randomness.

    Returns:
        (height, width) float32 [m], NaN where missing.
    """
    height, width = depth.shape
    incidence = incidence_angles(depth, camera)
    shadow = projector_shadow(depth, camera.fx * BASELINE_M)
    parameters = np.array(
        [
            noise.axial_scale,
            noise.lateral_px,
            INFRARED_FOCAL_PX * BASELINE_M,
            noise.disparity_step_px,
            np.deg2rad(noise.grazing_limit_deg),
            np.deg2rad(noise.grazing_spread_deg),
            noise.range_m[0],
            noise.range_m[1],
        ],
        np.float32,
    )
    return _measure(
        depth,
        incidence,
        shadow,
        _correlated(height, width, rng),
        noise_key(rng),
        _patches(height, width, rng),
        parameters,
    )


def _correlated(height: int, width: int, rng: np.random.Generator) -> NDArray:
    """Unit noise over which the matching window has averaged."""
    white = rng.standard_normal((height, width), dtype=np.float32)
    smooth = cv2.GaussianBlur(white, (0, 0), _CORRELATION_PX)
    return smooth * np.float32(2 * np.sqrt(np.pi) * _CORRELATION_PX)


def _patches(height: int, width: int, rng: np.random.Generator) -> NDArray:
    """Noise that is alike over patches of the image."""
    coarse = rng.standard_normal((height // _PATCH_PX, width // _PATCH_PX), dtype=np.float32)
    return cv2.resize(coarse, (width, height), interpolation=cv2.INTER_LINEAR)


def incidence_angles(depth: NDArray[np.float32], camera: PinholeCamera) -> NDArray[np.float32]:
    """(height, width) angle between each ray and the surface's normal [rad], NaN at holes."""
    intrinsics = np.array([camera.fx, camera.fy, camera.cx, camera.cy], np.float32)
    return _incidence_angles(depth, intrinsics)


@njit(cache=True, error_model="numpy")
def _incidence_angles(depth, intrinsics):  # type: ignore[no-untyped-def]
    """Normals from the slopes of inverse depth, which is linear in the pixel on a plane.

    On each axis the smaller of the two one-sided slopes is taken, so that silhouettes do
    not count as surfaces.
    """
    height, width = depth.shape
    fx, fy, cx, cy = intrinsics
    one = np.float32(1)
    inverse = one / depth
    angles = np.full((height, width), np.nan, np.float32)
    for row in range(height):
        up, down = max(row - 1, 0), min(row + 1, height - 1)
        for column in range(width):
            left, right = max(column - 1, 0), min(column + 1, width - 1)
            here = inverse[row, column]
            slope_x = _smaller(
                here - inverse[row, left], inverse[row, right] - here, left, column, right
            )
            slope_y = _smaller(
                here - inverse[up, column], inverse[down, column] - here, up, row, down
            )
            # The plane n . X = 1 has 1/z = n . ray, with ray = ((u-cx)/fx, (v-cy)/fy, 1).
            x, y = (np.float32(column) - cx) / fx, (np.float32(row) - cy) / fy
            nx, ny = slope_x * fx, slope_y * fy
            nz = here - nx * x - ny * y
            length = np.sqrt((nx * nx + ny * ny + nz * nz) * (x * x + y * y + one))
            angles[row, column] = np.arccos(min(here / length, one))
    return angles


@njit(cache=True, error_model="numpy", inline="always")
def _smaller(before, after, low, middle, high):  # type: ignore[no-untyped-def]
    """The one-sided difference of least size among those that exist."""
    if low == middle or not abs(before) <= abs(after):
        if high == middle or not abs(after) >= 0:
            return before
        return after
    return before


@njit(cache=True, error_model="numpy")
def projector_shadow(depth, focal_times_baseline):  # type: ignore[no-untyped-def]
    """(height, width) bool: what the projector, to the camera's right, does not light.

    The pixel u of depth z lies at u - f b / z in the projector's image; of two that lie at
    the same place the nearer one takes the light.
    """
    height, width = depth.shape
    shadow = np.zeros((height, width), np.bool_)
    margin = int(focal_times_baseline / 0.2)
    nearest = np.empty(width + margin + 2, np.float32)
    for row in range(height):
        nearest[:] = 0
        for column in range(width):
            disparity = focal_times_baseline / depth[row, column]
            if not (disparity > 0 and disparity < margin):
                continue
            place = column - disparity + margin
            cell = int(place)
            nearest[cell] = max(nearest[cell], disparity)
            nearest[cell + 1] = max(nearest[cell + 1], disparity)
        for column in range(width):
            disparity = focal_times_baseline / depth[row, column]
            if not (disparity > 0 and disparity < margin):
                continue
            cell = int(column - disparity + margin + 0.5)
            shadow[row, column] = nearest[cell] > disparity + 1
    return shadow


@njit(cache=True, error_model="numpy")
def _measure(depth, incidence, shadow, axial, key, patches, parameters):  # type: ignore[no-untyped-def]
    (scale, lateral_px, disparity_metres, step, limit, spread, nearest, farthest) = parameters
    height, width = depth.shape
    measured = np.full((height, width), np.nan, np.float32)
    half_pi = np.float32(np.pi / 2)
    for row in range(height):
        for column in range(width):
            z, theta = depth[row, column], incidence[row, column]
            if shadow[row, column] or not z > 0:
                continue
            if theta + spread * patches[row, column] > limit:
                continue
            grazing = theta / max(half_pi - theta, np.float32(0.02))
            # Eq. 2: silhouettes are ragged. Inside a surface the shift changes nothing.
            reach = lateral_px + np.float32(0.035) * grazing
            index = 3 * (row * width + column)
            x = int(np.round(np.float32(column) + reach * gaussian(key, index)))
            y = int(np.round(np.float32(row) + reach * gaussian(key, index + 1)))
            x, y = min(max(x, 0), width - 1), min(max(y, 0), height - 1)
            there = depth[y, x]
            slack = np.float32(0.02) * z * (1 + grazing)
            if not abs(there - z) < slack:
                # Half of the windows across a silhouette match nothing.
                if gaussian(key, index + 2) > 0 or shadow[y, x]:
                    continue
                z = there
            # Eq. 3 and 4: axial noise, with the term for grazing angles.
            sigma = np.float32(0.0012) + np.float32(0.0019) * (z - np.float32(0.4)) ** 2
            sigma += np.float32(0.0001) / np.sqrt(z) * grazing**2
            z += scale * sigma * axial[row, column]
            if not (z >= nearest and z <= farthest):
                continue
            disparity = np.round(disparity_metres / z / step) * step
            measured[row, column] = disparity_metres / disparity
    return measured
