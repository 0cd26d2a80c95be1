"""The depth camera errs as a Kinect does (Nguyen et al. 2012)."""

import numpy as np
import pytest

from airground.core.camera import PinholeCamera
from sim.presets import HARSH, NOMINAL
from sim.sensors.depth import (
    BASELINE_M,
    INFRARED_FOCAL_PX,
    incidence_angles,
    kinect_depth,
    projector_shadow,
)

CAMERA = PinholeCamera(320, 240, 262.5, 262.5, 159.5, 119.5)
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
    angles = incidence_angles(depth, CAMERA)
    # Head-on the angle is a square root of the rounding errors, hence a degree.
    seen = np.isfinite(depth) & (depth < 10)
    assert np.nanmax(np.abs(angles - expected)[seen]) < np.deg2rad(1.0)


def test_a_silhouette_is_no_surface() -> None:
    angles = np.rad2deg(incidence_angles(step(), CAMERA))
    assert angles.max() < 60  # of the rays alone; the jump in depth adds nothing


@pytest.mark.parametrize("distance", [0.8, 1.5, 2.5, 4.0])
def test_axial_noise_head_on(distance: float) -> None:
    depth = plane(distance)
    error = kinect_depth(depth, CAMERA, NOISE, rng()) - depth
    middle = error[100:140, 120:200]
    published = 0.0012 + 0.0019 * (distance - 0.4) ** 2
    quantum = distance**2 / (INFRARED_FOCAL_PX * BASELINE_M) * NOISE.disparity_step_px
    expected = np.hypot(published, quantum / np.sqrt(12))
    assert np.isfinite(middle).mean() > 0.99
    assert np.nanstd(middle) == pytest.approx(expected, rel=0.2)
    assert abs(np.nanmean(middle)) < 0.3 * expected


def test_disparity_comes_in_steps() -> None:
    measured = kinect_depth(plane(2.5, 20.0), CAMERA, NOISE, rng())
    steps = INFRARED_FOCAL_PX * BASELINE_M / measured[np.isfinite(measured)] / (1 / 8)
    assert np.abs(steps - np.round(steps)).max() < 1e-3
    assert len(np.unique(np.round(steps))) > 5


def test_range_ends() -> None:
    for distance in (0.3, 5.6):
        assert np.isnan(kinect_depth(plane(distance), CAMERA, NOISE, rng())).mean() > 0.99


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
    measured = kinect_depth(depth, CAMERA, NOISE, rng())
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
        return float(np.isnan(kinect_depth(depth, CAMERA, noise, rng()))[118:122].mean())

    assert missing(NOISE, 60.0) < 0.01
    assert 0.2 < missing(NOISE, 82.0) < 0.8
    assert missing(NOISE, 88.5) > 0.99
    assert missing(HARSH.depth, 79.0) > missing(NOISE, 79.0)


def test_the_same_generator_gives_the_same_depth() -> None:
    one, two, other = (kinect_depth(step(), CAMERA, NOISE, rng(seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, two)
    assert np.nanmean(one != other) > 0.5
