"""What a pixel shows is what its own ray hits, through every lens and with a rolling shutter."""

from dataclasses import replace

import cv2
import mujoco
import numpy as np
import open3d as o3d
import pytest

from airground.core.se3 import SE3
from airground.io.calibration import CameraTable
from airground.io.lens import Lens
from sim.geometry.edges import find_edges
from sim.recording.render import Renderer, with_cameras
from sim.recording.robot_view import RobotView
from sim.recording.row_poses import exact_row_poses
from sim.recording.view_tiles import tiles_of
from sim.robots.motion import ROBOTS, Motion, Robot
from sim.robots.robot_motion import Mounting
from sim.sensors.camera import pixel_motion
from sim.sensors.depth import incidence_angles
from sim.sensors.miscalibration import calibrate
from sim.sensors.optics import EUROC_RADTAN, FISHEYE_FIELD_DEG, LensKind, Optics
from sim.sensors.pixel_rays import PixelRays
from sim.sensors.presets import NOMINAL
from tests.sim.heap import POSES, Heap, empty_spec, make_heap

PINHOLE = CameraTable(
    width=376, height=240, fx=210, fy=210, cx=187.5, cy=119.5, rate_hz=30, time_offset_ns=0
)
KINDS: tuple[LensKind, ...] = ("pinhole", "radtan", "equidistant")
TIME_NS = 1_000_000_000
RADIUS_M = 0.04
SPEED, TURN_RATE = np.array([0.4, -0.3, 0.1]), np.array([0.6, 1.0, -0.8])
"""Of the camera in its own axes [m/s], [rad/s]: faster than the robots."""


def lens_of(kind: LensKind, readout_s: float = 0.0) -> Lens:
    return Optics(kind, 1.0, readout_s).applied_to(PINHOLE, EUROC_RADTAN).lens()


class Moving(Motion):
    """A camera that moves evenly from a pose of the heap."""

    def __init__(self) -> None:
        pass

    def camera_pose(self, robot: Robot, stamp_ns: int) -> SE3:
        return POSES[robot] @ SE3.exp([*SPEED, *TURN_RATE] * np.full(6, stamp_ns * 1e-9 - 1.0))


@pytest.fixture(scope="module")
def heap() -> Heap:
    return make_heap()


def renderer(spec: mujoco.MjSpec, lens: Lens) -> Renderer:
    return Renderer(with_cameras(spec, {tile.name: tile.camera for tile in tiles_of("mav", lens)}))


def view(lens: Lens, drawing: Renderer) -> RobotView:
    """Without smooth edges: MuJoCo's spheres have none."""
    nothing = find_edges((np.zeros((3, 3)), np.array([[0, 1, 2]])))
    return RobotView("mav", lens, Moving(), drawing, nothing, grey=True)


def rays_world(lens: Lens) -> o3d.core.Tensor:
    """Every pixel's own ray, from its own row's pose."""
    return exact_row_poses(Moving(), "mav", lens, TIME_NS).rays_world(lens.rays())


LENSES = [
    pytest.param(lens_of(kind, readout_s), id=f"{kind} {1e3 * readout_s:g} ms")
    for kind in KINDS
    for readout_s in (0.0, 0.026)
    if kind != "pinhole" or readout_s
]


@pytest.mark.parametrize("lens", LENSES)
def test_depth_is_that_of_each_pixels_ray(heap: Heap, lens: Lens) -> None:
    scene = o3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(heap.vertices.astype(np.float32), heap.triangles.astype(np.uint32))
    true = scene.cast_rays(rays_world(lens))["t_hit"].numpy()
    true[~np.isfinite(true)] = np.nan
    with renderer(heap.spec, lens) as drawing:
        seen = view(lens, drawing)
        _, depth = seen.draw(TIME_NS)
        np.testing.assert_array_equal(seen.depth(TIME_NS), depth)
    error = np.abs(depth / true - 1)
    assert np.isfinite(error).mean() > 0.6
    assert np.nanmedian(error) < 2e-5
    # The rest lie within half a pixel of an edge: there the nearest pixel may be beyond it.
    assert (error[np.isfinite(error)] < 1e-3).mean() > 0.975


@pytest.mark.parametrize("lens", LENSES)
def test_glowing_spheres_are_where_their_rays_say(lens: Lens) -> None:
    """The picture against one made of 16 rays for each pixel, each from its row's pose."""
    spec, centres = spheres(lens)
    with renderer(spec, lens) as drawing:
        picture, _ = view(lens, drawing).draw(TIME_NS)
    light = picture[..., 0].astype(float)
    light -= np.median(light)
    expected = share_of_spheres(lens, centres)
    offsets = []
    for pixel in lens.project(POSES["mav"].inverse() @ centres):
        column, row = np.rint(pixel).astype(int)
        window = np.s_[row - 14 : row + 15, column - 14 : column + 15]
        offsets.append(centroid(light[window]) - centroid(expected[window]))
    # One sample for each pixel of a view leaves up to 0.2 px of chance in a single sphere.
    assert np.sqrt(np.mean(np.square(offsets))) < 0.1
    assert np.abs(np.mean(offsets, axis=0)).max() < 0.04


def test_a_rolling_shutter_moves_what_is_far_from_the_middle_row() -> None:
    """The test above means something: without the shutter the spheres are elsewhere."""
    rolling, still = lens_of("pinhole", 0.026), lens_of("pinhole")
    _, centres = spheres(still)
    moved = np.abs(share_of_spheres(rolling, centres) - share_of_spheres(still, centres))
    assert moved[:60].max() > 0.9
    assert moved[:60].sum() > 3 * moved[100:140].sum()


def spheres(lens: Lens) -> tuple[mujoco.MjSpec, np.ndarray]:
    """Glowing spheres in a dark world, and their centres (N, 3)."""
    spec = empty_spec()
    spec.visual.headlight.ambient = [1.0, 1, 1]
    spec.visual.headlight.diffuse = [0.0, 0, 0]
    spec.visual.headlight.specular = [0.0, 0, 0]
    x, y = np.meshgrid(np.linspace(50, 325, 6), np.linspace(35, 205, 4))
    columns, rows = np.rint(x).astype(int).ravel(), np.rint(y).astype(int).ravel()
    rays = lens.rays()[rows, columns]
    centres = POSES["mav"] @ (2.0 * rays / np.linalg.norm(rays, axis=1, keepdims=True))
    for centre in centres:
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[RADIUS_M, 0, 0], pos=centre, rgba=[1, 1, 1, 1]
        )
    return spec, centres


def share_of_spheres(lens: Lens, centres: np.ndarray) -> np.ndarray:
    """(height, width) share of 4 x 4 rays of each pixel that meet a sphere."""
    poses = exact_row_poses(Moving(), "mav", lens, TIME_NS)
    rays = lens.rays()
    sizes = (4 * lens.width, 4 * lens.height)
    fine = np.dstack(
        [cv2.resize(rays[..., k], sizes, interpolation=cv2.INTER_LINEAR) for k in (0, 1, 2)]
    )
    rows = np.repeat(np.arange(lens.height), 4)
    directions = fine @ poses.rotations[rows].transpose(0, 2, 1)
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    met = np.zeros(fine.shape[:2], bool)
    for centre in centres:
        to_centre = (centre - poses.translations[rows])[:, None]
        along = (directions * to_centre).sum(-1)
        met |= (to_centre**2).sum(-1) - along**2 < RADIUS_M**2
    return met.reshape(lens.height, 4, lens.width, 4).mean((1, 3))


def centroid(weights: np.ndarray) -> np.ndarray:
    rows, columns = np.mgrid[: weights.shape[0], : weights.shape[1]]
    assert weights.sum() > 5
    return np.array([(weights * columns).sum(), (weights * rows).sum()]) / weights.sum()


@pytest.mark.parametrize("kind", KINDS[1:])
def test_blur_follows_the_lens(kind: LensKind) -> None:
    lens = lens_of(kind)
    depth = np.full((lens.height, lens.width), 2.0, np.float32)
    T_start_end = SE3.exp([2e-3, -1e-3, 3e-3, 2e-3, 3e-3, -4e-3])
    points = (lens.rays() * 2.0).reshape(-1, 3)
    moved = lens.project(T_start_end.inverse() @ points) - lens.project(points)
    motion = pixel_motion(depth, PixelRays.of(lens), T_start_end).reshape(2, -1).T
    error = np.abs(motion - moved).reshape(lens.height, lens.width, 2)[1:-1, 1:-1]
    assert np.nanmax(np.abs(moved)) > 1
    assert np.nanmax(error) < 0.03 * np.nanmax(np.abs(moved))


@pytest.mark.parametrize("kind", KINDS)
def test_incidence_on_a_wall_that_is_faced_is_the_angle_off_the_axis(kind: LensKind) -> None:
    lens = lens_of(kind)
    angles = incidence_angles(
        np.full((lens.height, lens.width), 2.0, np.float32), PixelRays.of(lens)
    )
    expected = np.arctan(np.hypot(*np.moveaxis(lens.rays()[..., :2], -1, 0)))
    assert np.abs(angles - expected).max() < 2e-3


def test_a_pinhole_camera_is_drawn_as_it_is() -> None:
    (tile,) = tiles_of("mav", lens_of("pinhole"))
    assert tile.camera == lens_of("pinhole").pinhole()
    assert tile.name == "mav"


def test_views_cover_their_tiles_and_are_finer_than_the_image() -> None:
    for kind in KINDS[1:]:
        lens = lens_of(kind)
        covered = np.zeros((lens.height, lens.width), int)
        for tile in tiles_of("mav", lens):
            covered[tile.rows, tile.columns] += 1
            rays = lens.rays()[tile.rows, tile.columns] @ tile.T_camera_view.rotation
            pixels = tile.camera.project(rays.reshape(-1, 3)).reshape(*rays.shape[:2], 2)
            assert pixels.min() >= 2
            assert (pixels.max((0, 1)) <= [tile.camera.width - 3, tile.camera.height - 3]).all()
            for axis in (0, 1):
                assert np.linalg.norm(np.diff(pixels, axis=axis), axis=-1).min() > 1.2
        assert (covered == 1).all()


def test_the_fisheye_has_its_field_from_corner_to_corner() -> None:
    lens = lens_of("equidistant")
    rays = lens.rays()[[0, -1], [0, -1]]
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    assert np.degrees(np.arccos(rays[0] @ rays[1])) == pytest.approx(FISHEYE_FIELD_DEG, abs=0.6)


@pytest.mark.parametrize("factor", [0.0, 0.5, 1.0, 1.5])
@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("kind", KINDS)
def test_every_pixel_of_every_strength_has_a_ray_of_its_own(
    kind: LensKind, robot: Robot, factor: float
) -> None:
    mounting = Mounting(SE3.identity(), SE3.identity())
    optics = Optics(kind, factor)
    preset = replace(NOMINAL, mav_optics=optics, ground_optics=optics)
    drawn = calibrate(420.0, mounting, mounting, preset, np.random.default_rng(0))
    for table in (drawn.true, drawn.nominal):
        lens = (table.mav if robot == "mav" else table.ground).camera.lens()
        pixels = lens.project(lens.rays()[::7, ::9].reshape(-1, 3))
        rows, columns = np.mgrid[0 : lens.height : 7, 0 : lens.width : 9].reshape(2, -1)
        assert np.abs(pixels - np.stack([columns, rows], axis=1)).max() < 1e-4
