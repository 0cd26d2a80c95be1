"""What rays hit of bodies that move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from sim.geometry.body_shapes import body_mesh, body_pieces
from sim.geometry.parts import Part
from sim.robots.motion import Robot
from sim.robots.moving_bodies import MovingBody


@dataclass(frozen=True, eq=False)
class BodyHits:
    """What rays hit of the bodies alone.

    Attributes:
        distance: (...) float32 in lengths of the rays, infinite where they hit nothing.
        triangle: (...) int64 triangle among those of all bodies in turn, -1 for none.
        normals: (..., 3) float32 outward unit normals in `world`; 0 for none.
    """

    distance: NDArray[np.float32]
    triangle: NDArray[np.int64]
    normals: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class BodySurfaces:
    """Surfaces of all bodies of a recording.

    Attributes:
        bodies: The bodies.
    """

    bodies: Sequence[MovingBody]

    @cached_property
    def _scenes(self) -> list[o3d.t.geometry.RaycastingScene]:
        scenes = []
        for body in self.bodies:
            vertices, triangles = body_mesh(body_pieces(body.shape, body.height_m))
            scene = o3d.t.geometry.RaycastingScene()
            scene.add_triangles(
                o3d.core.Tensor.from_numpy(vertices.astype(np.float32)),
                o3d.core.Tensor.from_numpy(triangles.astype(np.uint32)),
            )
            scenes.append(scene)
        return scenes

    @cached_property
    def parts(self) -> list[Part]:
        """The bodies as parts of a surface, in the order of the triangles."""
        return [
            Part(body.name, "body", len(body_mesh(body_pieces(body.shape, body.height_m))[1]))
            for body in self.bodies
        ]

    def hits(self, robot: Robot, rays: NDArray[np.float32], time_ns: int) -> BodyHits:
        """What rays (..., 6) in `world` hit of the bodies that a robot sees at a time [ns]."""
        shape = rays.shape[:-1]
        distance = np.full(shape, np.inf, np.float32)
        triangle = np.full(shape, -1, np.int64)
        normals = np.zeros((*shape, 3), np.float32)
        first = 0
        for body, scene, part in zip(self.bodies, self._scenes, self.parts, strict=True):
            if body.seen_by(robot):
                pose = body.pose(time_ns)
                own = np.empty(rays.shape, np.float32)
                own[..., :3] = (rays[..., :3] - pose.translation) @ pose.rotation
                own[..., 3:] = rays[..., 3:] @ pose.rotation
                answer = scene.cast_rays(o3d.core.Tensor.from_numpy(own))
                found = answer["t_hit"].numpy()
                nearer = found < distance
                distance[nearer] = found[nearer]
                triangle[nearer] = first + answer["primitive_ids"].numpy()[nearer]
                turned = answer["primitive_normals"].numpy() @ pose.rotation.T
                normals[nearer] = turned[nearer]
            first += part.triangles
        return BodyHits(distance, triangle, normals)

    def carried(
        self,
        points: NDArray[np.float64],
        triangle: NDArray[np.int64],
        before_ns: int,
        after_ns: int,
    ) -> NDArray[np.float64]:
        """(N, 3) where points (N, 3) on triangles (N,) of the bodies go from one time to another;
        those with a negative triangle stay."""
        moved, first = points.copy(), 0
        for body, part in zip(self.bodies, self.parts, strict=True):
            on = (triangle >= first) & (triangle < first + part.triangles)
            motion = body.pose(after_ns) @ body.pose(before_ns).inverse()
            moved[on] = motion @ points[on]
            first += part.triangles
        return moved
