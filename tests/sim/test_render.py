"""MuJoCo's pictures and depth against pyrender, ray casting and projected markers."""

import mujoco
import numpy as np
import pyrender
import pytest
import trimesh

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from sim.recording.render import Renderer, with_cameras
from tests.sim.heap import CAMERAS, POSES, Heap, empty_spec, make_heap


@pytest.fixture(scope="module")
def heap() -> Heap:
    return make_heap()


@pytest.fixture(scope="module")
def depths(heap: Heap) -> dict[str, np.ndarray]:
    with Renderer(with_cameras(heap.spec, CAMERAS)) as renderer:
        return {name: renderer.draw(name, POSES[name])[1] for name in CAMERAS}


def assert_same_depth(one: np.ndarray, other: np.ndarray) -> None:
    """Median under 0.1 mm; no more than silhouettes may differ at all."""
    both = np.isfinite(one) & np.isfinite(other)
    assert both.mean() > 0.5
    assert (np.isfinite(one) == np.isfinite(other)).mean() > 0.998
    error = np.abs(one - other)[both]
    assert np.median(error) < 1e-4
    assert np.quantile(error, 0.99) < 5e-4


@pytest.mark.parametrize("name", CAMERAS)
def test_depth_is_that_of_ray_casting(heap: Heap, depths: dict, name: str) -> None:
    cast = heap.cast(CAMERAS[name], POSES[name])
    assert_same_depth(depths[name], cast)


def test_depth_alone_is_that_of_a_picture(heap: Heap) -> None:
    spec = heap.spec.copy()
    # MuJoCo's sky has a depth.
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        width=16,
        height=96,
    )
    with Renderer(with_cameras(spec, CAMERAS)) as renderer:
        for name, pose in POSES.items():
            picture, depth = renderer.draw(name, pose)
            np.testing.assert_array_equal(renderer.depth(name, pose), depth)
            np.testing.assert_array_equal(renderer.draw(name, pose)[0], picture)


def one_sample_per_pixel(monkeypatch: pytest.MonkeyPatch) -> None:
    """pyrender's antialiasing would move the samples off the pixel centres."""
    allocate = pyrender.renderer.glRenderbufferStorageMultisample
    monkeypatch.setattr(
        pyrender.renderer,
        "glRenderbufferStorageMultisample",
        lambda target, _samples, *rest: allocate(target, 0, *rest),
    )


@pytest.mark.parametrize("name", CAMERAS)
def test_depth_and_pose_are_those_of_pyrender(
    heap: Heap, depths: dict, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    camera, T_world_camera = CAMERAS[name], POSES[name]
    scene = pyrender.Scene()
    mesh = trimesh.Trimesh(heap.vertices, heap.triangles, process=False)
    scene.add(pyrender.Mesh.from_trimesh(mesh, smooth=False))
    # pyrender counts the principal point from the image's edge and looks along -z.
    pinhole = pyrender.IntrinsicsCamera(
        camera.fx, camera.fy, camera.cx + 0.5, camera.cy + 0.5, znear=0.02, zfar=50.0
    )
    scene.add(pinhole, pose=T_world_camera.matrix() @ np.diag([1.0, -1, -1, 1]))
    one_sample_per_pixel(monkeypatch)
    renderer = pyrender.OffscreenRenderer(camera.width, camera.height)
    flags = pyrender.RenderFlags.DEPTH_ONLY | pyrender.RenderFlags.SKIP_CULL_FACES
    depth = renderer.render(scene, flags=flags)
    renderer.delete()
    assert_same_depth(depths[name], np.where(depth > 0, depth, np.nan))


def test_markers_land_on_their_predicted_pixels() -> None:
    """Glowing spheres: the centroid of each one's light is the projection of its centre."""
    camera, T_world_camera = CAMERAS["mav"], POSES["mav"]
    x, y = np.meshgrid(np.linspace(60, 690, 6), np.linspace(50, 430, 4))
    pixels = np.stack([x.ravel(), y.ravel()], axis=1) + np.random.default_rng(0).uniform(
        -5, 5, (24, 2)
    )
    depth = 2.0
    rays = np.stack(
        [(pixels[:, 0] - camera.cx) / camera.fx, (pixels[:, 1] - camera.cy) / camera.fy], axis=1
    )
    points_camera = depth * np.column_stack([rays, np.ones(24)])
    spec = empty_spec()
    spec.visual.headlight.ambient = [1.0, 1, 1]
    spec.visual.headlight.diffuse = [0.0, 0, 0]
    spec.visual.headlight.specular = [0.0, 0, 0]
    radius = 0.02
    for centre in T_world_camera @ points_camera:
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[radius, 0, 0], pos=centre, rgba=[1, 1, 1, 1]
        )
    with Renderer(with_cameras(spec, {"mav": camera})) as renderer:
        picture, _ = renderer.draw("mav", T_world_camera)
    light = picture.astype(float).mean(axis=2)
    light -= np.median(light)
    for pixel in pixels:
        column, row = np.rint(pixel).astype(int)
        window = np.s_[row - 12 : row + 13, column - 12 : column + 13]
        weights = light[window]
        rows, columns = np.mgrid[window]
        assert weights.sum() > 1000
        centroid = np.array([(weights * columns).sum(), (weights * rows).sum()]) / weights.sum()
        # A sphere off the axis is an ellipse whose centre lies a little farther out.
        assert np.abs(centroid - pixel).max() < 0.2


def test_nothing_is_nan_and_the_world_is_left_alone() -> None:
    spec = empty_spec()
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.2, 0, 0])
    camera = PinholeCamera(65, 49, 50.0, 50.0, 32.0, 24.0)
    T_world_camera = SE3(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 2.0]))
    with Renderer(with_cameras(spec, {"small": camera})) as renderer:
        _, depth = renderer.draw("small", T_world_camera)
    assert depth.shape == (49, 65)
    assert np.isnan(depth[0, 0])
    assert depth[24, 32] == pytest.approx(1.8, abs=1e-5)
    assert len(spec.cameras) == 0
