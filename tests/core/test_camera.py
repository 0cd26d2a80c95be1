"""The pixel convention, and that projecting and back-projecting agree."""

import cv2
import numpy as np
import pytest

from airground.core.camera import PinholeCamera

CAMERA = PinholeCamera(64, 48, 50.0, 52.0, 31.0, 24.5)


def test_back_projection_lands_on_the_pixel_centre() -> None:
    depth = np.random.default_rng(0).uniform(1, 5, (48, 64))
    points = CAMERA.back_project(depth)
    pixels = CAMERA.project(points.reshape(-1, 3)).reshape(48, 64, 2)
    assert np.allclose(pixels[..., 0], np.arange(64)[None, :])
    assert np.allclose(pixels[..., 1], np.arange(48)[:, None])
    assert np.allclose(points[..., 2], depth)  # depth is z, not the ray's length


def test_points_behind_have_no_pixel() -> None:
    assert np.isnan(CAMERA.project(np.array([[0.1, 0.1, -1.0]]))).all()


def test_missing_depth_has_no_point() -> None:
    depth = np.full((48, 64), np.nan, np.float32)
    depth[3, 4] = 2.0
    assert np.isfinite(CAMERA.back_project(depth)).all(axis=2).sum() == 1


def test_halved_camera_matches_an_area_resized_image() -> None:
    # A smooth blob at a known point must sit where the halved camera projects that point.
    point = np.array([[0.07, -0.11, 1.0]])
    x, y = CAMERA.project(point)[0]
    columns, rows = np.meshgrid(np.arange(64), np.arange(48))
    image = np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / 18.0)
    half = cv2.resize(image, (32, 24), interpolation=cv2.INTER_AREA)
    columns, rows = np.meshgrid(np.arange(32), np.arange(24))
    centre = [(half * columns).sum() / half.sum(), (half * rows).sum() / half.sum()]
    assert np.allclose(centre, CAMERA.halved().project(point)[0], atol=1e-3)


@pytest.mark.parametrize("bad", [{"width": 0}, {"fx": -50.0}, {"fy": float("nan")}])
def test_refuses_impossible_cameras(bad: dict[str, float]) -> None:
    good = {"width": 64, "height": 48, "fx": 50.0, "fy": 50.0, "cx": 31.5, "cy": 23.5}
    with pytest.raises(ValueError, match="must be positive"):
        PinholeCamera(**{**good, **bad})
