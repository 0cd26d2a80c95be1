"""Lenses of every model: a point of the scene lands where the pinhole camera says."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from airground.errors import RecordingError
from airground.io.lens import MAX_HALF_ANGLE, Lens, Undistortion
from airground.io.sensor_file import read_lens

WIDTH, HEIGHT = 320, 240
INTRINSICS = (150.0, 149.0, 158.0, 121.0)
LENSES = {
    "k3": Lens(WIDTH, HEIGHT, INTRINSICS, (-0.28, 0.08, 2e-4, 2e-5, -0.01)),
    "rational": Lens(WIDTH, HEIGHT, INTRINSICS, (0.9, 0.3, 1e-4, -2e-4, 0.02, 1.2, 0.5, 0.05)),
    "thin prism": Lens(
        WIDTH, HEIGHT, INTRINSICS, (-0.2, 0.03, 0, 0, 0, 0, 0, 0, 1e-3, -5e-4, 8e-4, 3e-4)
    ),
    "fisheye": Lens(WIDTH, HEIGHT, INTRINSICS, (-0.013, 0.021, -0.012, 0.003), "equidistant"),
    "fisheye, 195 deg": Lens(
        WIDTH, HEIGHT, (95.0, 95.0, 160.0, 119.0), (0.004, 0.001, -0.001, 0.0), "equidistant"
    ),
}
RAYS = np.array([[0.1, 0.05, 1.0], [-0.4, 0.2, 1.0], [0.3, -0.3, 1.0]])


def project(lens: Lens, ray: np.ndarray) -> np.ndarray:
    """A ray's pixel in the lens's own image."""
    model = cv2.fisheye if lens.model == "equidistant" else cv2
    points, _ = model.projectPoints(
        ray[None, None], np.zeros(3), np.zeros(3), lens.matrix(), np.array(lens.distortion)
    )
    return np.asarray(points).reshape(2)


@pytest.mark.parametrize("name", LENSES)
def test_a_point_lands_where_the_pinhole_camera_says(name: str) -> None:
    lens = LENSES[name]
    straight = Undistortion(lens)
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    for ray in RAYS:
        x, y = project(lens, ray)
        spot = 255 * np.exp(-((u - x) ** 2 + (v - y) ** 2) / 18)
        image = straight.image(spot.astype(np.uint8)).astype(float)
        centre = np.array([(image * u).sum(), (image * v).sum()]) / image.sum()
        np.testing.assert_allclose(centre, straight.camera.project(ray[None])[0], atol=0.3)


@pytest.mark.parametrize("name", LENSES)
def test_there_are_no_black_rims(name: str) -> None:
    white = np.full((HEIGHT, WIDTH), 255, np.uint8)
    assert (Undistortion(LENSES[name]).image(white)[1:-1, 1:-1] == 255).all()


def test_the_view_of_a_fisheye_is_cut_where_a_pinhole_image_would_stretch() -> None:
    camera = Undistortion(LENSES["fisheye, 195 deg"]).camera
    assert np.arctan(WIDTH / 2 / camera.fx) == pytest.approx(MAX_HALF_ANGLE, abs=1e-6)
    narrower = Undistortion(LENSES["fisheye"]).camera
    assert np.arctan(WIDTH / 2 / narrower.fx) < MAX_HALF_ANGLE


def test_depth_follows_the_image() -> None:
    """A disc in both images stays the same disc."""
    disc = np.zeros((HEIGHT, WIDTH), np.uint8)
    cv2.circle(disc, (200, 90), 25, 255, -1)
    straight = Undistortion(LENSES["fisheye"])
    depth = np.where(disc > 0, np.float32(2.0), np.float32(np.nan))
    near, bright = np.isfinite(straight.depth(depth)), straight.image(disc) > 127
    assert near.sum() > 500
    assert (near != bright).sum() < 0.06 * near.sum()


YAML = """resolution: [320, 240]
intrinsics: [150.0, 149.0, 158.0, 121.0]
distortion_model: {model}
distortion_coefficients: {coefficients}
"""
NAMES = {
    "radtan": ([0.1, 0.0, 0.0, 0.0], "radial-tangential"),
    "plumb_bob": ([0.1, 0.0, 0.0, 0.0, 0.0], "radial-tangential"),
    "rational_polynomial": ([0.1, 0.0, 0.0, 0.0, 0.0, 0.2, 0.1, 0.0], "radial-tangential"),
    "equidistant": ([0.1, 0.0, 0.0, 0.0], "equidistant"),
    "fisheye": ([0.1, 0.0, 0.0, 0.0], "equidistant"),
}


@pytest.mark.parametrize("model", NAMES)
def test_models_have_the_names_of_several_tools(tmp_path: Path, model: str) -> None:
    file = tmp_path / "sensor.yaml"
    coefficients, meant = NAMES[model]
    file.write_text(YAML.format(model=model, coefficients=coefficients))
    lens = read_lens(file)
    assert (lens.model, lens.distortion) == (meant, tuple(coefficients))
    file.write_text(file.read_text().replace("coefficients:", "coeffs:"))  # as Kalibr writes
    assert read_lens(file) == lens


def test_a_camera_without_distortion_needs_no_coefficients(tmp_path: Path) -> None:
    file = tmp_path / "sensor.yaml"
    file.write_text(YAML.split("distortion")[0] + "distortion_model: none\n")
    assert not read_lens(file).bends


BAD = {
    "coefficients": ("equidistant", "[0.1, 0, 0, 0, 0]", "expected 4 numbers for equidistant, got"),
    "rational": ("radtan", "[0, 0, 0, 0, 0, 0]", "expected 4 or 5 or 8 or 12 or 14 numbers"),
    "model": ("omni", "[0, 0, 0, 0]", "'omni' is unknown; known: radial-tangential, radtan,"),
    "a list": ("[1]", "[0, 0, 0, 0]", "'distortion_model': '.1.' is unknown"),
    "words": ("radtan", "[a, b, c, d]", "expected a list of numbers"),
    "a fold": ("radtan", "[-1.0, 0, 0, 0]", "'distortion_coefficients': .* folds back within"),
    "a fisheye's fold": ("fisheye", "[-1.0, 0, 0, 0]", "folds back within its 320x240"),
}


@pytest.mark.parametrize("what", BAD)
def test_bad_lenses_are_named_in_one_line(tmp_path: Path, what: str) -> None:
    model, coefficients, message = BAD[what]
    file = tmp_path / "sensor.yaml"
    file.write_text(YAML.format(model=model, coefficients=coefficients))
    with pytest.raises(RecordingError, match=message) as raised:
        read_lens(file)
    assert "\n" not in str(raised.value)


def test_icls_negative_focal_length_is_explained(tmp_path: Path) -> None:
    file = tmp_path / "sensor.yaml"
    file.write_text(YAML.format(model="none", coefficients=[]).replace("149.0", "-149.0"))
    message = (
        r"fy is negative \(-149\), as ICL-NUIM states it .* y points down.*: give 149, and mir"
    )
    with pytest.raises(RecordingError, match=message):
        read_lens(file)


# Coefficients that calibrations of real cameras have, strongest first.
REAL = {
    "TUM freiburg1": (640, 480, (517.3, 516.5, 318.6, 255.3), (0.26, -0.95, -0.005, 0.003, 1.16)),
    "EuRoC": (752, 480, (458.7, 457.3, 367.2, 248.4), (-0.28, 0.074, 0.0002, 0.00002)),
    "action camera": (1920, 1080, (880.0, 880.0, 960.0, 540.0), (-0.27, 0.1, 0.0, 0.0, -0.019)),
}


@pytest.mark.parametrize("name", REAL)
def test_real_lenses_do_not_fold(name: str) -> None:
    width, height, intrinsics, distortion = REAL[name]
    assert not Lens(width, height, intrinsics, distortion).folds()


@pytest.mark.parametrize("name", LENSES)
def test_lenses_that_can_be_undone_do_not_fold(name: str) -> None:
    assert not LENSES[name].folds()


@pytest.mark.parametrize("name", [name for name in LENSES if "195" not in name])
def test_rays_and_pixels_are_each_others_inverse(name: str) -> None:
    lens = LENSES[name]
    rays = lens.rays()
    # Not up to the corners, where "k3" turns back.
    rows, columns = np.mgrid[30 : HEIGHT - 30 : 30, 30 : WIDTH - 30 : 30].reshape(2, -1)
    asked = rays[rows, columns]
    np.testing.assert_allclose(lens.project(3 * asked), np.stack([columns, rows], 1), atol=1e-6)
    for ray, pixel in zip(asked, lens.project(asked), strict=True):
        np.testing.assert_allclose(project(lens, ray), pixel, atol=1e-6)


def test_nothing_is_seen_beyond_the_corners_or_behind() -> None:
    lens = LENSES["k3"]
    assert np.isnan(lens.project(np.array([[4.0, 0, 1], [0, 0, -1], [0, 0, 0]]))).all()


@pytest.mark.parametrize("name", ["k3", "fisheye"])
def test_opencv_undistorts_images_as_we_do(name: str) -> None:
    """cv2.undistort and cv2.fisheye.undistortImage, with the matrix that we choose."""
    lens = LENSES[name]
    rng = np.random.default_rng(0)
    image = cv2.GaussianBlur(rng.integers(0, 256, (HEIGHT, WIDTH), np.uint8), (0, 0), 3)
    ours = Undistortion(lens)
    given = lens.matrix(), np.array(lens.distortion)
    if lens.model == "equidistant":
        theirs = cv2.fisheye.undistortImage(image, *given, Knew=ours.camera.matrix())
    else:
        theirs = cv2.undistort(image, *given, newCameraMatrix=ours.camera.matrix())
    difference = np.abs(ours.image(image).astype(int) - theirs.astype(int))
    assert difference[2:-2, 2:-2].max() <= 1
