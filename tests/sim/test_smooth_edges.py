"""Smoothed edges against exact areas, and against a drawing of many samples a pixel."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from sim.geometry.edges import Edges, find_edges
from sim.recording.render import Renderer, with_cameras
from sim.recording.smooth_edges import share_beyond, smooth_edges
from tests.sim.heap import CAMERAS, POSES, make_heap

CAMERA = PinholeCamera(40, 30, 100.0, 100.0, 19.5, 14.5)
HERE = SE3.identity()
DEPTH_M = 2.0
DARK, BRIGHT = 20, 220


def one_edge(ends_px: np.ndarray, depth_m: float = DEPTH_M) -> Edges:
    """A rim seen from in front, from pixel to pixel (2, 2)."""
    rays = np.column_stack([(ends_px - [CAMERA.cx, CAMERA.cy]) / CAMERA.fx, np.ones(2)])
    planes = np.array([[0, 0, -1, -depth_m]], np.float32)
    return Edges(depth_m * rays[None], np.zeros((1, 2), np.int64), np.ones(1, bool), planes)


def beyond(angle: float, offset_px: float, samples: int) -> np.ndarray:
    """(height, width) how much of each pixel lies beyond a line through the image's middle.

    By counting samples x samples of each; 1 is what its centre says.
    """
    fine = (np.arange(samples) + 0.5) / samples - 0.5
    x = (np.arange(CAMERA.width)[:, None] + fine).ravel() - CAMERA.cx
    y = (np.arange(CAMERA.height)[:, None] + fine).ravel() - CAMERA.cy
    side = x[None] * -np.sin(angle) + y[:, None] * np.cos(angle) > offset_px
    return side.reshape(CAMERA.height, samples, CAMERA.width, samples).mean((1, 3))


@settings(deadline=None)
@given(distance=st.floats(0, 1.2), rise=st.floats(0, 1))
def test_a_share_is_an_area(distance: float, rise: float) -> None:
    """Height of a pixel that is left beyond the line, summed over its width."""
    x = (np.arange(4000) + 0.5) / 4000 - 0.5
    counted = np.clip(0.5 - distance - rise * x, 0, 1).mean()
    assert share_beyond(distance, rise) == pytest.approx(counted, abs=1e-6)


@pytest.mark.kernel
@settings(deadline=None, max_examples=60)
@given(
    angle=st.floats(0, np.pi),
    offset_px=st.floats(-5, 5),
    channels=st.sampled_from([1, 3]),
    sky=st.booleans(),
)
def test_a_straight_edge_gets_its_exact_shades(
    angle: float, offset_px: float, channels: int, sky: bool
) -> None:
    side = beyond(angle, offset_px, 1)
    sharp = np.where(side, BRIGHT, DARK).astype(np.uint8)
    picture = np.repeat(sharp[..., None], channels, axis=2)
    along = np.array([np.cos(angle), np.sin(angle)])
    middle = np.array([CAMERA.cx, CAMERA.cy]) + offset_px * np.array([-along[1], along[0]])
    edges = one_edge(middle + np.outer([-60, 60], along))
    depth = np.where(side, np.nan if sky else DEPTH_M, DEPTH_M).astype(np.float32)
    smooth = smooth_edges(picture, depth, CAMERA, HERE, edges)
    exact = DARK + (BRIGHT - DARK) * beyond(angle, offset_px, 64)
    inside = np.s_[1:-1, 1:-1]  # beyond the image there is nothing to mix with
    for channel in range(channels):
        assert np.abs(smooth[..., channel] - exact)[inside].max() < 0.02 * (BRIGHT - DARK) + 1
    assert (picture[..., 0] == sharp).all()  # left as it was


@pytest.mark.kernel
def test_a_hidden_edge_changes_nothing() -> None:
    picture = np.where(beyond(0.3, 0.2, 1), BRIGHT, DARK).astype(np.uint8)[..., None]
    edges = one_edge(np.array([[-5.0, 9.0], [45.0, 19.0]]))
    nearer = np.full(picture.shape[:2], 0.8 * DEPTH_M, np.float32)
    np.testing.assert_array_equal(smooth_edges(picture, nearer, CAMERA, HERE, edges), picture)
    at_it = np.full(picture.shape[:2], DEPTH_M, np.float32)
    assert (smooth_edges(picture, at_it, CAMERA, HERE, edges) != picture).any()


@pytest.mark.kernel
def test_an_edge_that_comes_from_behind_the_camera_is_cut() -> None:
    """A floor's rim that runs beneath the camera, and one that lies all behind it."""
    picture = np.full((30, 40, 1), DARK, np.uint8)
    picture[:, 20:] = BRIGHT
    x = 0.0  # between the columns 19 and 20
    ends = np.array([[[x, 0.1, -3.0], [x, 0.1, 3.0]], [[x, 0.1, -3.0], [x, 0.1, -1.0]]])
    edges = Edges(
        ends,
        np.zeros((2, 2), np.int64),
        np.ones(2, bool),
        np.array([[0, -1, 0, -0.1]], np.float32),
    )
    rows = np.arange(30)
    with np.errstate(divide="ignore"):
        depth = np.where(rows > 14.5, 0.1 * CAMERA.fy / (rows - 14.5), np.inf)
    depth = np.repeat(depth[:, None], 40, axis=1).astype(np.float32)
    smooth = smooth_edges(picture, depth, CAMERA, HERE, edges)
    np.testing.assert_array_equal(smooth, picture)  # exactly between two pixels: no share
    moved = Edges(edges.ends + np.array([0.004, 0, 0]), edges.faces, edges.creased, edges.planes)
    smooth = smooth_edges(picture, depth, CAMERA, HERE, moved)
    seen = rows > 14.5 + 0.1 * CAMERA.fy / 3.0  # nearer than the far end
    assert (smooth[seen, 18:22] != picture[seen, 18:22]).any(axis=(1, 2)).sum() > 5
    assert (smooth[~seen] == picture[~seen]).all()


@pytest.mark.parametrize("name", CAMERAS)
def test_a_heap_looks_as_with_many_samples_a_pixel(name: str) -> None:
    heap, pose, camera, fine = make_heap(), POSES[name], CAMERAS[name], 6
    finer = PinholeCamera(
        camera.width * fine,
        camera.height * fine,
        camera.fx * fine,
        camera.fy * fine,
        (camera.cx + 0.5) * fine - 0.5,
        (camera.cy + 0.5) * fine - 0.5,
    )
    with Renderer(with_cameras(heap.spec, {name: finer})) as renderer:
        many, _ = renderer.draw(name, pose)
    exact = many.reshape(camera.height, fine, camera.width, fine, 3).mean((1, 3))
    with Renderer(with_cameras(heap.spec, {name: camera})) as renderer:
        sharp, depth = renderer.draw(name, pose)
    edges = find_edges((heap.vertices, heap.triangles))
    smooth = smooth_edges(sharp, depth, camera, pose, edges)
    before, after = (np.abs(one - exact).max(axis=2) for one in (sharp, smooth))
    jagged = before > 10
    assert 0.002 < jagged.mean() < 0.1
    # Boxes that pierce each other leave lines that are no box's edge.
    assert np.median(after[jagged]) < 0.2 * np.median(before[jagged])
    assert (after[~jagged] > 10).mean() < 2e-3
