"""Depth moved to the colour camera: closed form over planes and steps, and against a slow twin."""

import numpy as np
import pytest

from airground.core.se3 import SE3
from airground.io.lens import Lens
from airground.io.registration import SPREAD, Registration

WIDTH, HEIGHT = 160, 120
DEPTH = Lens(WIDTH, HEIGHT, (146.0, 146.0, 79.5, 59.5), ())
COLOUR = Lens(WIDTH, HEIGHT, (131.0, 132.0, 80.0, 58.0), ())
BENT = Lens(WIDTH, HEIGHT, (131.0, 132.0, 80.0, 58.0), (0.23, -0.5, -0.003, 0.002))
FISHEYE = Lens(WIDTH, HEIGHT, (90.0, 90.0, 80.0, 58.0), (0.01, 0.0, 0.0, 0.0), "equidistant")
BASELINE_M = 0.1
BESIDE = SE3(np.eye(3), np.array([-BASELINE_M, 0.0, 0.0]))
TURNED = SE3.from_rotation_vector((0.01, -0.02, 0.015), (-0.1, 0.01, 0.02))


def plane_depth(lens: Lens, normal: np.ndarray, T_camera_lens: SE3) -> np.ndarray:
    """(H, W) depth of the plane normal . X = 1 in the colour camera, seen by a camera there."""
    turned = lens.rays() @ T_camera_lens.rotation.T
    away = 1 - normal @ T_camera_lens.translation
    return (away / (turned @ normal)).astype(np.float32)


@pytest.mark.parametrize("colour", [COLOUR, BENT, FISHEYE], ids=["pinhole", "radtan", "fisheye"])
@pytest.mark.parametrize("T_camera_depth", [BESIDE, TURNED], ids=["beside", "turned"])
def test_a_plane_keeps_its_depth(colour: Lens, T_camera_depth: SE3) -> None:
    normal = np.array([0.12, -0.08, 0.5])
    depth = plane_depth(DEPTH, normal, T_camera_depth)
    moved = Registration(DEPTH, colour, T_camera_depth).registered(depth)
    exact = plane_depth(colour, normal, SE3.identity())
    known = np.isfinite(moved)
    # A pixel's depth is that of the depth pixel it lies in: at most its half width beside.
    rows, columns = np.gradient(exact)
    slack = 0.6 * (abs(rows) + abs(columns)) + 1e-5
    assert (abs(moved - exact)[known] <= slack[known]).all()
    # All that the depth camera sees has depth, without a crack.
    inside = known[20:-20, 30:-20] if colour is not FISHEYE else known[35:-35, 50:-45]
    assert inside.all()


def test_the_shadow_of_a_step_is_as_wide_as_its_disparity_and_on_its_right_side() -> None:
    near, far, first, last = 1.0, 2.0, 60, 99
    depth = np.full((HEIGHT, WIDTH), far, np.float32)
    depth[:, first : last + 1] = near
    same = Lens(WIDTH, HEIGHT, DEPTH.intrinsics, ())
    moved = Registration(DEPTH, same, BESIDE).registered(depth)
    # The depth camera is to the left: what is near moves left by f b / z, and bares what the
    # colour camera sees past its right edge.
    shift = {z: DEPTH.intrinsics[0] * BASELINE_M / z for z in (near, far)}
    left, right = first - shift[near] - SPREAD / 2, last - shift[near] + SPREAD / 2
    bared = last + 1 - shift[far] - SPREAD / 2
    row = moved[HEIGHT // 2]
    columns = np.arange(WIDTH)
    np.testing.assert_array_equal(row == near, (columns >= left) & (columns <= right))
    missing = np.flatnonzero(np.isnan(row[: WIDTH - 10]))
    np.testing.assert_array_equal(missing, columns[(columns > right) & (columns < bared)])
    assert len(missing) == pytest.approx(shift[near] - shift[far], abs=1)


def slow_twin(depth: np.ndarray, colour: Lens, T_camera_depth: SE3) -> np.ndarray:
    """As `registered`, pixel by pixel, with the exact lens."""
    moved = np.full((colour.height, colour.width), np.inf)
    half = SPREAD / 2 * np.array(colour.intrinsics[:2]) / DEPTH.intrinsics[:2]
    points = T_camera_depth @ (DEPTH.rays() * depth[..., None]).reshape(-1, 3)
    for point, pixel in zip(points, colour.project(points), strict=True):
        if not np.isfinite(pixel).all():
            continue
        low = np.maximum(np.ceil(pixel - half), 0).astype(int)
        high = np.minimum(np.floor(pixel + half), [WIDTH - 1, HEIGHT - 1]).astype(int)
        for y in range(low[1], high[1] + 1):
            for x in range(low[0], high[0] + 1):
                moved[y, x] = min(moved[y, x], point[2])
    return np.where(np.isfinite(moved), moved, np.nan)


@pytest.mark.parametrize("colour", [COLOUR, BENT, FISHEYE], ids=["pinhole", "radtan", "fisheye"])
def test_like_the_slow_twin(colour: Lens) -> None:
    rng = np.random.default_rng(1)
    depth = rng.choice([0.7, 0.9, 1.5, np.nan], (HEIGHT // 8, WIDTH // 8)).repeat(8, 0).repeat(8, 1)
    depth = (depth + rng.uniform(0, 0.01, depth.shape)).astype(np.float32)
    depth[0, :3] = 0.0, -1.0, np.inf
    with np.errstate(invalid="ignore"):
        expected = slow_twin(np.where(depth > 0, depth, np.nan), colour, TURNED)
    moved = Registration(DEPTH, colour, TURNED).registered(depth)
    # Float32 and the table of the lens move a few pixels over the border of their square.
    same = np.isclose(moved, expected, atol=1e-5, equal_nan=True)
    assert same.mean() > 0.995
    assert np.isnan(moved).mean() > 0.2


def test_a_coarse_depth_camera_fills_a_fine_colour_image() -> None:
    fine = Lens(4 * WIDTH, 4 * HEIGHT, (524.0, 524.0, 319.5, 239.5), ())
    moved = Registration(DEPTH, fine, BESIDE).registered(np.full((HEIGHT, WIDTH), 2, np.float32))
    assert (moved[60:-60, 60:-60] == 2).all()
