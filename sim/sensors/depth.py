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

from sim.sensors.hashed_noise import gaussian, noise_key
from sim.sensors.pixel_rays import PixelRays
from sim.sensors.sensor_errors import DepthNoise

BASELINE_M = 0.075
INFRARED_FOCAL_PX = 585.0
"""Focal length of the depth camera [px]."""
_CORRELATION_PX = 1.0  # the matching window correlates neighbouring errors
_PATCH_PX = 16  # whole patches of a surface seen at a grazing angle vanish together


def kinect_depth(
    depth: NDArray[np.float32], rays: PixelRays, noise: DepthNoise, rng: np.random.Generator
) -> NDArray[np.float32]:
    """What a Kinect would measure.

    Args:
        depth: (height, width) true depth along the optical axis [m], NaN for nothing.
        rays: Where the pixels look of the camera that depth is registered to.
        noise: Size of the faults.
        rng: Source of randomness.

    Returns:
        (height, width) float32 [m], NaN where missing.
    """
    height, width = depth.shape
    incidence = incidence_angles(depth, rays)
    shadow = projector_shadow(depth, rays.camera.fx * BASELINE_M)
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
        correlated_noise(height, width, rng),
        noise_key(rng),
        patch_noise(height, width, rng),
        parameters,
    )


def correlated_noise(height: int, width: int, rng: np.random.Generator) -> NDArray:
    """Unit noise over which the matching window has averaged."""
    white = rng.standard_normal((height, width), dtype=np.float32)
    smooth = cv2.GaussianBlur(white, (0, 0), _CORRELATION_PX)
    return smooth * np.float32(2 * np.sqrt(np.pi) * _CORRELATION_PX)


def patch_noise(height: int, width: int, rng: np.random.Generator) -> NDArray:
    """Noise that is alike over patches of the image."""
    coarse = rng.standard_normal((height // _PATCH_PX, width // _PATCH_PX), dtype=np.float32)
    return cv2.resize(coarse, (width, height), interpolation=cv2.INTER_LINEAR)


def incidence_angles(depth: NDArray[np.float32], rays: PixelRays) -> NDArray[np.float32]:
    """(height, width) angle between each ray and the surface's normal [rad], NaN at holes."""
    camera = rays.camera
    fx, fy, cx, cy = np.array([camera.fx, camera.fy, camera.cx, camera.cy], np.float32)
    x_rays = (np.arange(camera.width, dtype=np.float32) - cx) / fx
    y_rays = (np.arange(camera.height, dtype=np.float32) - cy) / fy
    bent = np.zeros((6, 0, 0), np.float32) if rays.bent is None else rays.bent
    return _incidence_angles(depth, x_rays, y_rays, np.array([fx, fy]), bent)


# Each loop below does one kind of work along a row, and most have no branch: so the compiler
# vectorizes all but the gathers.


@njit(cache=True, error_model="numpy")
def _incidence_angles(depth, x_rays, y_rays, focal_px, bent):  # type: ignore[no-untyped-def]
    """Normals from the slopes of inverse depth, which is linear in the pixel on a plane.

    On each axis the smaller of the two one-sided slopes is taken, so that silhouettes do
    not count as surfaces.
    """
    height, width = depth.shape
    inverse = np.float32(1) / depth
    cosines = np.empty(width, np.float32)
    slope_x, slope_y = np.empty(width, np.float32), np.empty(width, np.float32)
    angles = np.empty((height, width), np.float32)
    for row in range(height):
        here = inverse[row]
        first, last = row == 0, row == height - 1
        up, down = inverse[max(row - 1, 0)], inverse[min(row + 1, height - 1)]
        _smaller_slopes(up, here, down, first, last, slope_y)
        _smaller_slopes(here[:-2], here[1:-1], here[2:], False, False, slope_x[1:-1])
        _smaller_slopes(here[:1], here[:1], here[1:2], True, False, slope_x[:1])
        _smaller_slopes(here[-2:-1], here[-1:], here[-1:], False, True, slope_x[-1:])
        if bent.size == 0:
            _cosines(here, slope_x, slope_y, x_rays, y_rays[row], focal_px, cosines)
        else:
            _bent_cosines(here, slope_x, slope_y, bent[:, row], cosines)
        angles[row] = np.arccos(cosines)
    return angles


@njit(cache=True, error_model="numpy")
def _smaller_slopes(before, here, after, first, last, slopes):  # type: ignore[no-untyped-def]
    """The one-sided difference of least size among those that exist."""
    for k in range(len(slopes)):
        back, ahead = here[k] - before[k], after[k] - here[k]
        no_back = first | (not abs(back) <= abs(ahead))
        no_ahead = last | (not abs(ahead) >= 0)
        slopes[k] = ahead if no_back & (not no_ahead) else back


@njit(cache=True, error_model="numpy")
def _cosines(inverse, slope_x, slope_y, x_rays, y, focal_px, cosines):  # type: ignore[no-untyped-def]
    """Of the angles between one row's rays and the surface's normals."""
    fx, fy = focal_px
    one = np.float32(1)
    for column in range(len(inverse)):
        # The plane n . X = 1 has 1/z = n . ray, with ray = ((u-cx)/fx, (v-cy)/fy, 1).
        x = x_rays[column]
        nx, ny = slope_x[column] * fx, slope_y[column] * fy
        nz = inverse[column] - nx * x - ny * y
        length = np.sqrt((nx * nx + ny * ny + nz * nz) * (x * x + y * y + one))
        cosines[column] = min(inverse[column] / length, one)


@njit(cache=True, error_model="numpy")
def _bent_cosines(inverse, slope_x, slope_y, bent, cosines):  # type: ignore[no-untyped-def]
    """As `_cosines`, with a ray and a derivative for each pixel."""
    one = np.float32(1)
    for column in range(len(inverse)):
        x, y = bent[0, column], bent[1, column]
        nx = slope_x[column] * bent[2, column] + slope_y[column] * bent[4, column]
        ny = slope_x[column] * bent[3, column] + slope_y[column] * bent[5, column]
        nz = inverse[column] - nx * x - ny * y
        length = np.sqrt((nx * nx + ny * ny + nz * nz) * (x * x + y * y + one))
        cosines[column] = min(inverse[column] / length, one)


@njit(cache=True, error_model="numpy")
def projector_shadow(depth, focal_times_baseline):  # type: ignore[no-untyped-def]
    """(height, width) bool: what the projector, to the camera's right, does not light.

    The pixel u of depth z lies at u - f b / z in the projector's image; of two that lie at
    the same place the nearer one takes the light.
    """
    height, width = depth.shape
    shadow = np.empty((height, width), np.bool_)
    margin = int(focal_times_baseline / 0.2)
    nowhere = width + margin + 1
    disparity, place = np.empty(width, np.float64), np.empty(width, np.float64)
    light, nearest = np.empty(nowhere + 1, np.float32), np.zeros(nowhere + 1, np.float32)
    for row in range(height):
        _projected(depth[row], focal_times_baseline, margin, nowhere, disparity, place)
        light[:] = 0
        for column in range(width):
            cell = np.int32(place[column])
            light[cell] = max(light[cell], np.float32(disparity[column]))
        # A pixel covers its place and the next.
        nearest[0] = light[0]
        nearest[1:] = np.maximum(light[1:], light[:-1])
        for column in range(width):
            cell = np.int32(place[column] + 0.5)
            shadow[row, column] = nearest[cell] > disparity[column] + 1
    return shadow


@njit(cache=True, error_model="numpy")
def _projected(depth, focal_times_baseline, margin, nowhere, disparity, place):  # type: ignore[no-untyped-def]
    """Disparity and place of one row's pixels; 0 and `nowhere` where there is nothing."""
    for column in range(len(depth)):
        exact = np.float64(focal_times_baseline / depth[column])
        seen = (exact > 0) & (exact < margin)
        disparity[column] = exact if seen else 0.0
        place[column] = column - exact + margin if seen else np.float64(nowhere)


@njit(cache=True, error_model="numpy")
def _measure(depth, incidence, shadow, axial, key, patches, parameters):  # type: ignore[no-untyped-def]
    height, width = depth.shape
    depths, shadows = depth.reshape(-1), shadow.reshape(-1)
    measured = np.empty((height, width), np.float32)
    index, grazing = np.empty(width, np.int32), np.empty(width, np.float32)
    there, lit = np.empty(width, np.float32), np.empty(width, np.bool_)
    for row in range(height):
        _ragged_places(row, height, incidence[row], key, parameters, grazing, index)
        for column in range(width):
            there[column], lit[column] = depths[index[column]], not shadows[index[column]]
        _measure_row(
            depth[row], incidence[row], shadow[row], axial[row], patches[row], key, row * width,
            grazing, there, lit, parameters, measured[row],
        )  # fmt: skip
    return measured


@njit(cache=True, error_model="numpy")
def _ragged_places(row, height, incidence, key, parameters, grazing, index):  # type: ignore[no-untyped-def]
    """Eq. 2: silhouettes are ragged. Inside a surface the shift changes nothing."""
    width, lateral_px = len(incidence), parameters[1]
    half_pi = np.float32(np.pi / 2)
    last_x, last_y = np.float32(width - 1), np.float32(height - 1)
    for column in range(width):
        theta = incidence[column]
        grazing[column] = theta / max(half_pi - theta, np.float32(0.02))
        reach = lateral_px + np.float32(0.035) * grazing[column]
        number = 3 * (row * width + column)
        x = np.rint(np.float32(column) + reach * gaussian(key, number))
        y = np.rint(np.float32(row) + reach * gaussian(key, number + 1))
        # Holes have no angle and so no place; any will do.
        x = min(x if x > 0 else np.float32(0), last_x)
        y = min(y if y > 0 else np.float32(0), last_y)
        index[column] = np.int32(y) * np.int32(width) + np.int32(x)


@njit(cache=True, error_model="numpy")
def _measure_row(  # type: ignore[no-untyped-def]
    depth, incidence, shadow, axial, patches, key, first, grazing, there, lit, parameters, measured
):
    """One row; `there` and `lit` are what lies at its ragged places."""
    (scale, _, disparity_metres, step, limit, spread, nearest, farthest) = parameters
    for column in range(len(depth)):
        z = depth[column]
        seen = (not shadow[column]) & (z > 0)
        seen &= not incidence[column] + spread * patches[column] > limit
        slack = np.float32(0.02) * z * (1.0 + grazing[column])
        across = not abs(there[column] - z) < slack
        # Half of the windows across a silhouette match nothing.
        matched = (not gaussian(key, 3 * (first + column) + 2) > 0) & lit[column]
        seen &= matched | (not across)
        z = there[column] if across else z
        # Eq. 3 and 4: axial noise, with the term for grazing angles.
        sigma = np.float32(0.0012) + np.float32(0.0019) * (z - np.float32(0.4)) ** 2
        sigma += np.float32(0.0001) / np.sqrt(z) * grazing[column] ** 2
        z += scale * sigma * axial[column]
        seen &= (z >= nearest) & (z <= farthest)
        disparity = np.rint(disparity_metres / z / step) * step
        measured[column] = disparity_metres / disparity if seen else np.float32(np.nan)
