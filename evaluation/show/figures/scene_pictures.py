"""Pictures of the augmented map (Fig. 5 and 15), rendered offscreen by pyrender.
pyrender's shadows fail with numpy 2, and clouds have no surfaces to light. Every pixel that has a
nearer neighbour is darkened instead, which makes shape visible (eye-dome lighting)."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from evaluation.measure.showcase import Showcase

if TYPE_CHECKING:
    import pyrender

Colour = tuple[int, int, int]
GROUND_COLOUR: Colour = (214, 62, 48)
MAV_COLOUR: Colour = (150, 150, 150)
GROUND_PATH: Colour = (34, 94, 214)
MAV_PATH: Colour = (20, 158, 78)
BACKGROUND: Colour = (250, 250, 248)

SIZE_PX = (1440, 960)
"""Width and height of a picture [px]."""
FIELD_OF_VIEW = np.radians(52.0)
MARKER_M = 0.22
"""Width of a camera's pyramid [m]."""
PATH_RADIUS_M = 0.012
FAR_M = 60.0
"""Far plane [m]: beyond every scene."""
DARKENING = 9.0
"""Strength of eye-dome lighting."""


@dataclass(frozen=True)
class Viewpoint:
    """A camera of a picture: eye and target in `ground` [m], z is up."""

    eye: NDArray[np.float64]
    target: NDArray[np.float64]

    def camera_pose(self) -> NDArray[np.float64]:
        """(4, 4) pose of an OpenGL camera (x right, y up, looking along -z)."""
        back = _unit(self.eye - self.target)
        up = np.array([0.0, 0.0, 1.0]) if abs(back[2]) < 0.99 else np.array([0.0, 1.0, 0.0])
        right = _unit(np.cross(up, back))
        pose = np.eye(4)
        pose[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
        pose[:3, 3] = self.eye
        return pose


def robot_viewpoint(showcase: Showcase) -> Viewpoint:
    """Above and behind the ground robot, towards the points that the MAV added."""
    path = showcase.ground_path
    camera = path[len(path) // 2]
    target = _centre(showcase.aerial_cloud)
    away = camera.translation[:2] - target[:2]
    distance = float(np.linalg.norm(away))
    away = away / distance if distance > 0.3 else -camera.rotation[:2, 2]
    eye = np.append(target[:2] + away * max(distance + 0.9, 2.6), camera.translation[2] + 0.75)
    return Viewpoint(eye, target)


def aerial_viewpoint(showcase: Showcase) -> Viewpoint:
    """High above, from the side opposite to the ground robot, with everything in view."""
    target = _centre(showcase.aerial_cloud)
    away = target[:2] - showcase.ground_path.translations[:, :2].mean(axis=0)
    length = float(np.linalg.norm(away))
    away = away / length if length > 0.3 else np.array([0.0, -1.0])
    view = Viewpoint(target + np.array([0.6 * away[0], 0.6 * away[1], 1.0]), target)
    right, up, back = view.camera_pose()[:3, :3].T
    shown = [showcase.mav_path.translations, showcase.ground_path.translations]
    if len(showcase.aerial_cloud):
        shown.append(np.percentile(showcase.aerial_cloud.points, [1, 99], axis=0))
    points = np.concatenate(shown) - target
    # The middle of everything in the picture's plane, so that no side stays empty.
    for along in (right, up):
        middle = 0.5 * ((points @ along).min() + (points @ along).max())
        points = points - middle * along
        target = target + middle * along
    reach = np.maximum(np.abs(points @ up), np.abs(points @ right) / (SIZE_PX[0] / SIZE_PX[1]))
    distance = (points @ back + 1.06 * reach / np.tan(FIELD_OF_VIEW / 2)).max()
    return Viewpoint(target + distance * back, target)


def render_augmented_map(
    showcase: Showcase, view: Viewpoint, size_px: tuple[int, int] = SIZE_PX
) -> NDArray[np.uint8]:
    """(height, width, 3) picture of both clouds, both paths and the cameras.
    Ground points are red, aerial points grey; the ground robot's path and cameras are blue, the
    MAV's green."""
    os.environ.setdefault("PYOPENGL_PLATFORM", "egl")
    import pyrender

    pose = view.camera_pose()
    scene = pyrender.Scene(ambient_light=(1.0, 1.0, 1.0), bg_color=(*BACKGROUND, 255))
    for cloud, tint in ((showcase.ground_cloud, GROUND_COLOUR), (showcase.aerial_cloud, None)):
        if len(cloud):
            scene.add(_splats(cloud, pose, tint))
    for path, colour, cameras in (
        (showcase.ground_path, GROUND_PATH, 3),
        (showcase.mav_path, MAV_PATH, 4),
    ):
        scene.add(_tubes(_path_segments(path), PATH_RADIUS_M, colour))
        shown = np.linspace(0, len(path) - 1, cameras).astype(int)
        edges = np.concatenate([_camera_edges(path[int(i)]) for i in shown])
        scene.add(_tubes(edges, 0.8 * PATH_RADIUS_M, colour))
    scene.add(pyrender.PerspectiveCamera(yfov=FIELD_OF_VIEW, znear=0.1, zfar=FAR_M), pose=pose)

    renderer = pyrender.OffscreenRenderer(*size_px)
    try:
        colour_image, depth = renderer.render(scene)
    finally:
        renderer.delete()
    return _eye_dome_lighting(colour_image, depth)


def tinted(colours: NDArray[np.uint8], tint: Colour | None) -> NDArray[np.uint8]:
    """Grey values, or shades of one colour that keep the brightness of the original."""
    grey = colours.astype(np.float32).mean(axis=1, keepdims=True)
    if tint is None:
        return np.repeat(grey, 3, axis=1).astype(np.uint8)
    shade = 0.35 + 0.85 * grey / 255
    return np.clip(shade * np.array(tint, np.float32), 0, 255).astype(np.uint8)


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)


def _centre(cloud: PointCloud) -> NDArray[np.float64]:
    if len(cloud) == 0:
        return np.zeros(3)
    return np.median(cloud.points, axis=0).astype(np.float64)


def _splats(cloud: PointCloud, pose: NDArray[np.float64], tint: Colour | None) -> pyrender.Mesh:
    """Every point as a square that faces the camera, as large as the spacing of the points."""
    points = cloud.points
    half = 0.5 * _splat_size(points)
    right, up = pose[:3, 0] * half, pose[:3, 1] * half
    corners = np.stack([-right - up, right - up, right + up, -right + up]).astype(np.float32)
    positions = (points[:, None, :] + corners).reshape(-1, 3)
    first = 4 * np.arange(len(points))[:, None, None]
    triangles = (first + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)
    return _mesh(positions, triangles, np.repeat(tinted(cloud.colours, tint), 4, axis=0))


def _splat_size(points: NDArray[np.float32]) -> float:
    if len(points) < 2:
        return 0.02
    sample = points[:: max(1, len(points) // 2000)]
    spacing = cKDTree(points).query(sample, k=2)[0][:, 1]
    return float(np.clip(1.7 * np.median(spacing), 0.004, 0.05))


def _path_segments(path: Trajectory) -> NDArray[np.float64]:
    """(S, 2, 3) ends of the segments of a thinned path."""
    index = np.unique(np.linspace(0, len(path) - 1, 300).astype(int))
    points = path.translations[index]
    return np.stack([points[:-1], points[1:]], axis=1)


def _camera_edges(T_ground_camera: SE3) -> NDArray[np.float64]:
    """(8, 2, 3) edges of a small pyramid: the camera's centre and its image plane."""
    x, y, z = 0.5 * MARKER_M, 0.35 * MARKER_M, 0.7 * MARKER_M
    base = T_ground_camera @ np.array([[-x, -y, z], [x, -y, z], [x, y, z], [-x, y, z]])
    tip = np.repeat(T_ground_camera.translation[None], 4, axis=0)
    sides = np.stack([tip, base], axis=1)
    return np.concatenate([sides, np.stack([base, np.roll(base, -1, axis=0)], axis=1)])


def _tubes(segments: NDArray[np.float64], radius: float, colour: Colour) -> pyrender.Mesh:
    """Segments (S, 2, 3) as six-sided tubes of one colour; lines would be one pixel wide."""
    along = _unit(segments[:, 1] - segments[:, 0])
    helper = np.where(np.abs(along[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    side = _unit(np.cross(along, helper))
    other = np.cross(along, side)
    angle = np.linspace(0, 2 * np.pi, 6, endpoint=False)[None, :, None]
    ring = radius * (np.cos(angle) * side[:, None] + np.sin(angle) * other[:, None])
    overlap = radius * along[:, None, :] * np.array([-1.0, 1.0])[None, :, None]
    ends = segments + overlap
    positions = (ends[:, :, None, :] + ring[:, None]).reshape(-1, 3)
    k = np.arange(6)
    n = (k + 1) % 6
    sides = np.concatenate([np.stack([k, n, n + 6], 1), np.stack([k, n + 6, k + 6], 1)])
    triangles = (12 * np.arange(len(segments))[:, None, None] + sides).reshape(-1, 3)
    return _mesh(positions, triangles, np.repeat([colour], len(positions), axis=0))


def _mesh(positions: NDArray, triangles: NDArray, colours: NDArray) -> pyrender.Mesh:
    """A mesh that shows its vertex colours (0 to 255) as they are."""
    import pyrender

    # pyrender's shader ends with a gamma of 1/2.2; undo it.
    linear = (colours.astype(np.float32) / 255) ** 2.2
    material = pyrender.MetallicRoughnessMaterial(
        doubleSided=True, metallicFactor=0.0, roughnessFactor=1.0
    )
    primitive = pyrender.Primitive(
        positions=positions.astype(np.float32),
        indices=triangles.astype(np.uint32),
        color_0=np.concatenate([linear, np.ones((len(linear), 1), np.float32)], axis=1),
        material=material,
    )
    return pyrender.Mesh(primitives=[primitive])


def _eye_dome_lighting(colours: NDArray[np.uint8], depth: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Darken pixels behind a nearer neighbour, at two scales; depth [m] is 0 in the background."""
    far = np.log(np.where(depth > 0, depth, FAR_M)).astype(np.float32)
    darkness = np.zeros_like(far)
    for radius in (1, 4):
        for shift in ((0, radius), (0, -radius), (radius, 0), (-radius, 0)):
            nearer = far - np.roll(far, shift, axis=(0, 1))
            darkness += np.clip(nearer, 0, 0.12)
    shade = np.where(depth > 0, np.exp(-DARKENING * darkness / 4), 1.0)
    return (colours * shade[..., None]).round().astype(np.uint8)
