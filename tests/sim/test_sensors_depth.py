"""The depth camera errs as a Kinect does (Nguyen et al. 2012)."""

import numpy as np
import pytest

from airground.core.camera import PinholeCamera
from sim.sensors.depth import (
    BASELINE_M,
    INFRARED_FOCAL_PX,
    correlated_noise,
    incidence_angles,
    kinect_depth,
    patch_noise,
    projector_shadow,
)
from sim.sensors.hashed_noise import gaussian, noise_key
from sim.sensors.pixel_rays import PixelRays
from sim.sensors.presets import HARSH, NOMINAL
from sim.sensors.sensor_errors import DepthNoise

CAMERA = PinholeCamera(320, 240, 262.5, 262.5, 159.5, 119.5)
RAYS = PixelRays(CAMERA)
NOISE = NOMINAL.depth


def rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def plane(distance: float, tilt_deg: float = 0.0) -> np.ndarray:
    """Depth of a plane `distance` m ahead on the axis, turned about the x axis."""
    normal = np.array([0.0, np.sin(np.deg2rad(tilt_deg)), np.cos(np.deg2rad(tilt_deg))])
    with np.errstate(divide="ignore"):
        depth = normal[2] * distance / (CAMERA.rays() @ normal)
    return np.where(depth > 0, depth, np.nan).astype(np.float32)


def step(near: float = 1.0, far: float = 2.0) -> np.ndarray:
    """A wide board in the middle of the image before a wall."""
    depth = np.full((240, 320), far, np.float32)
    depth[60:180, 120:200] = near
    return depth


@pytest.mark.parametrize("tilt", [0.0, 30.0, 60.0, 75.0])
def test_incidence_of_a_plane(tilt: float) -> None:
    depth = plane(2.0, tilt)
    rays = CAMERA.rays()
    normal = np.array([0.0, np.sin(np.deg2rad(tilt)), np.cos(np.deg2rad(tilt))])
    expected = np.arccos(rays @ normal / np.linalg.norm(rays, axis=2))
    angles = incidence_angles(depth, RAYS)
    # Head-on the angle is a square root of the rounding errors, hence a degree.
    seen = np.isfinite(depth) & (depth < 10)
    assert np.nanmax(np.abs(angles - expected)[seen]) < np.deg2rad(1.0)


def test_a_silhouette_is_no_surface() -> None:
    angles = np.rad2deg(incidence_angles(step(), RAYS))
    assert angles.max() < 60  # of the rays alone; the jump in depth adds nothing


def angle_of_pixel(inverse: np.ndarray, camera: PinholeCamera, row: int, column: int) -> float:
    """The obvious twin: the smaller slope on each axis, of those that exist."""

    def slope(line: np.ndarray, k: int) -> float:
        back = line[k] - line[k - 1] if k > 0 else np.nan
        ahead = line[k + 1] - line[k] if k + 1 < len(line) else np.nan
        existing = [s for s in (back, ahead) if np.isfinite(s)]
        return min(existing, key=abs) if existing else np.nan

    x, y = (column - camera.cx) / camera.fx, (row - camera.cy) / camera.fy
    nx = slope(inverse[row], column) * camera.fx
    ny = slope(inverse[:, column], row) * camera.fy
    normal = np.array([nx, ny, inverse[row, column] - nx * x - ny * y])
    ray = np.array([x, y, 1.0])
    cosine = normal @ ray / (np.linalg.norm(normal) * np.linalg.norm(ray))
    return float(np.arccos(min(cosine, 1.0)))


def uneven(camera: PinholeCamera) -> np.ndarray:
    """Depth of a tilted, rough surface with a jump and holes, some at the border's inside."""
    rows, columns = np.mgrid[: camera.height, : camera.width]
    depth = 1.2 + 0.01 * columns + 0.02 * rows + 0.004 * rng().standard_normal(rows.shape)
    depth[4:12, 8:15] -= 0.5
    depth[rng(1).random(depth.shape) < 0.05] = np.nan
    depth[:2], depth[-2:], depth[:, :2], depth[:, -2:] = 1.5, 1.6, 1.7, 1.8
    return depth.astype(np.float32)


@pytest.mark.kernel
def test_incidence_is_that_of_the_obvious_twin() -> None:
    camera = PinholeCamera(24, 18, 30.0, 31.0, 11.0, 9.5)
    depth = uneven(camera)
    inverse = 1 / depth.astype(np.float64)
    twin = [angle_of_pixel(inverse, camera, *pixel) for pixel in np.ndindex(depth.shape)]
    angles = incidence_angles(depth, PixelRays(camera)).ravel()
    np.testing.assert_array_equal(np.isnan(angles), np.isnan(twin))
    # Head-on the angle is a square root of the rounding errors.
    np.testing.assert_allclose(angles, twin, atol=2e-3)


def measured_pixel_by_pixel(
    depth: np.ndarray, camera: PinholeCamera, noise: DepthNoise, draw: np.random.Generator
) -> np.ndarray:
    """The obvious twin of `kinect_depth`, in double precision, given what it draws."""
    height, width = depth.shape
    axial = correlated_noise(height, width, draw)
    key = noise_key(draw)
    patches = patch_noise(height, width, draw)
    incidence = incidence_angles(depth, PixelRays(camera)).astype(float)
    shadow = projector_shadow(depth, camera.fx * BASELINE_M)
    measured = np.full(depth.shape, np.nan)
    for row, column in np.ndindex(height, width):
        z, theta = float(depth[row, column]), incidence[row, column]
        softened = theta + np.deg2rad(noise.grazing_spread_deg) * patches[row, column]
        if np.isnan(theta) or shadow[row, column] or softened > np.deg2rad(noise.grazing_limit_deg):
            continue
        grazing = theta / max(np.pi / 2 - theta, 0.02)
        first = 3 * (row * width + column)
        shift_x, shift_y, coin = (float(gaussian(key, first + k)) for k in range(3))
        reach = noise.lateral_px + 0.035 * grazing
        x = int(np.clip(round(column + reach * shift_x), 0, width - 1))
        y = int(np.clip(round(row + reach * shift_y), 0, height - 1))
        if not abs(depth[y, x] - z) < 0.02 * z * (1 + grazing):
            if coin > 0 or shadow[y, x]:
                continue
            z = float(depth[y, x])
        sigma = 0.0012 + 0.0019 * (z - 0.4) ** 2 + 0.0001 / np.sqrt(z) * grazing**2
        z += noise.axial_scale * sigma * axial[row, column]
        if noise.range_m[0] <= z <= noise.range_m[1]:
            steps = round(INFRARED_FOCAL_PX * BASELINE_M / z / noise.disparity_step_px)
            measured[row, column] = (
                INFRARED_FOCAL_PX * BASELINE_M / (steps * noise.disparity_step_px)
            )
    return measured


@pytest.mark.kernel
@pytest.mark.filterwarnings("ignore:overflow", "ignore:invalid", "ignore:divide")  # uncompiled
def test_measured_depth_is_that_of_the_obvious_twin() -> None:
    """Up to rounding: float32 may fall on the other side of a disparity's step."""
    camera = PinholeCamera(64, 48, 50.0, 51.0, 31.0, 23.5)
    depth = uneven(camera)
    measured = kinect_depth(depth, PixelRays(camera), NOISE, rng(2))
    twin = measured_pixel_by_pixel(depth, camera, NOISE, rng(2))
    assert 0.1 < np.isnan(twin).mean() < 0.9
    assert (np.isnan(measured) != np.isnan(twin)).mean() < 0.002
    both = np.isfinite(measured) & np.isfinite(twin)
    assert (np.abs(measured - twin)[both] > 1e-5).mean() < 0.002


@pytest.mark.parametrize("distance", [0.8, 1.5, 2.5, 4.0])
def test_axial_noise_head_on(distance: float) -> None:
    depth = plane(distance)
    error = kinect_depth(depth, RAYS, NOISE, rng()) - depth
    middle = error[100:140, 120:200]
    published = 0.0012 + 0.0019 * (distance - 0.4) ** 2
    quantum = distance**2 / (INFRARED_FOCAL_PX * BASELINE_M) * NOISE.disparity_step_px
    expected = np.hypot(published, quantum / np.sqrt(12))
    assert np.isfinite(middle).mean() > 0.99
    assert np.nanstd(middle) == pytest.approx(expected, rel=0.2)
    assert abs(np.nanmean(middle)) < 0.3 * expected


def test_disparity_comes_in_steps() -> None:
    measured = kinect_depth(plane(2.5, 20.0), RAYS, NOISE, rng())
    steps = INFRARED_FOCAL_PX * BASELINE_M / measured[np.isfinite(measured)] / (1 / 8)
    assert np.abs(steps - np.round(steps)).max() < 1e-3
    assert len(np.unique(np.round(steps))) > 5


def test_range_ends() -> None:
    for distance in (0.3, 5.6):
        assert np.isnan(kinect_depth(plane(distance), RAYS, NOISE, rng())).mean() > 0.99


def shadow_by_rays(depth: np.ndarray, focal_times_baseline: float) -> np.ndarray:
    """The obvious twin: each pixel against every nearer one of its row."""
    shadow = np.zeros(depth.shape, bool)
    columns = np.arange(depth.shape[1])
    for row in range(depth.shape[0]):
        disparity = focal_times_baseline / depth[row]
        place = columns - disparity
        for column in columns[np.isfinite(disparity)]:
            nearer = disparity > disparity[column] + 1
            shadow[row, column] = (np.abs(place - place[column])[nearer] < 0.5).any()
    return shadow


@pytest.mark.kernel
def test_shadow_is_that_of_the_obvious_twin() -> None:
    depth = rng().uniform(1.0, 1.02, (12, 60)).astype(np.float32)
    depth[3:9, 20:35] = 0.6
    depth[5:7, 40:44] = np.nan
    shadow = projector_shadow(depth, np.float32(20.0))
    twin = shadow_by_rays(depth, 20.0)
    assert twin.sum() > 30
    assert (shadow != twin).mean() < 0.02  # the rounding of places


def test_shadow_falls_to_the_left_and_is_as_wide_as_the_disparities_differ() -> None:
    focal_times_baseline = CAMERA.fx * BASELINE_M
    shadow = projector_shadow(step(1.0, 2.0), np.float32(focal_times_baseline))
    width = focal_times_baseline * (1 / 1.0 - 1 / 2.0)
    row = np.flatnonzero(shadow[120])
    assert len(row) == pytest.approx(width, abs=1.5)
    assert row.max() == 119  # up to the board's left edge at 120
    assert not shadow[30].any()


def test_silhouettes_are_ragged_and_partly_missing() -> None:
    depth = step()
    measured = kinect_depth(depth, RAYS, NOISE, rng())
    right_edge = measured[70:170, 197:203]
    assert 0.02 < np.isnan(right_edge).mean() < 0.5
    swapped = np.abs(right_edge - depth[70:170, 197:203]) > 0.5
    assert swapped.any()
    inside = measured[70:170, 130:190]
    assert np.isfinite(inside).mean() > 0.99
    assert np.nanmax(np.abs(inside - 1.0)) < 0.05


def test_grazing_surfaces_vanish_softly() -> None:
    def missing(noise, tilt: float) -> float:
        depth = plane(1.5, tilt)
        return float(np.isnan(kinect_depth(depth, RAYS, noise, rng()))[118:122].mean())

    assert missing(NOISE, 60.0) < 0.01
    assert 0.2 < missing(NOISE, 82.0) < 0.8
    assert missing(NOISE, 88.5) > 0.99
    assert missing(HARSH.depth, 79.0) > missing(NOISE, 79.0)


def test_the_same_generator_gives_the_same_depth() -> None:
    one, two, other = (kinect_depth(step(), RAYS, NOISE, rng(seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, two)
    assert np.nanmean(one != other) > 0.5
