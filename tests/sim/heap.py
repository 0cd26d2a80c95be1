"""A small world made by hand, with its true surface, for tests of what cameras see."""

from dataclasses import dataclass

import mujoco
import numpy as np
import open3d as o3d

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from sim.geometry.surface import box_mesh, join, rectangle_mesh

# Unequal focal lengths and a shifted principal point, so that no mix-up goes unseen.
CAMERAS = {
    "mav": PinholeCamera(752, 480, 420.0, 431.0, 370.3, 244.1),
    "ground": PinholeCamera(640, 480, 525.0, 519.0, 325.4, 233.7),
}
POSES = {
    "mav": SE3(np.array([[0.0, -1, 0], [-1, 0, 0], [0, 0, -1]]), np.array([0.1, 0.2, 2.2]))
    @ SE3.from_rotation_vector((0.1, -0.2, 0.3)),
    "ground": SE3(
        np.column_stack(
            [
                [0, -1.0, 0],
                [-np.sin(0.35), 0, -np.cos(0.35)],
                [np.cos(0.35), 0, -np.sin(0.35)],
            ]
        ),
        np.array([-2.5, 0.0, 0.7]),
    ),
}


@dataclass(frozen=True)
class Heap:
    """Boxes on a floor: the MuJoCo world and the same as triangles."""

    spec: mujoco.MjSpec
    vertices: np.ndarray
    triangles: np.ndarray

    def cast(self, camera: PinholeCamera, T_world_camera: SE3) -> np.ndarray:
        """(height, width) depth by Open3D's ray casting."""
        scene = o3d.t.geometry.RaycastingScene(nthreads=1)
        scene.add_triangles(self.vertices.astype(np.float32), self.triangles.astype(np.uint32))
        directions = camera.rays() @ T_world_camera.rotation.T
        origins = np.broadcast_to(T_world_camera.translation, directions.shape)
        rays = np.concatenate([origins, directions], axis=-1).astype(np.float32)
        return scene.cast_rays(o3d.core.Tensor(rays))["t_hit"].numpy()


def empty_spec() -> mujoco.MjSpec:
    spec = mujoco.MjSpec()
    spec.visual.map.znear, spec.visual.map.zfar = 0.005, 20.0
    spec.stat.extent, spec.stat.center = 5.0, [0, 0, 0.5]
    spec.visual.quality.shadowsize = 0
    return spec


def make_heap(boxes: int = 25, seed: int = 0) -> Heap:
    rng = np.random.default_rng(seed)
    spec = empty_spec()
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[4, 4, 0.1])
    meshes = [rectangle_mesh(np.array([-4.0, -4, 0]), [8.0, 0, 0], [0, 8.0, 0])]
    for _ in range(boxes):
        place = np.append(rng.uniform(-1.5, 1.5, 2), rng.uniform(0.0, 0.6))
        T_world_box = SE3.from_rotation_vector(rng.normal(size=3), place)
        size = rng.uniform(0.1, 0.5, 3)
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=size / 2,
            pos=place,
            quat=np.roll(T_world_box.quaternion_xyzw(), 1),
        )
        meshes.append(box_mesh(size, T_world_box))
    return Heap(spec, *join(meshes))
