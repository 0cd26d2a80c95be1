"""Bodies that move, put into a still world and moved to where they are in each image."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from airground.core.se3 import SE3
from sim.appearance.bake_light import DISPLAY_GAMMA
from sim.appearance.pictures import add_picture
from sim.geometry.body_shapes import Piece, body_mesh, body_pieces
from sim.geometry.edges import Edges, find_edges
from sim.geometry.surface import Mesh
from sim.recording.render import Renderer
from sim.robots.motion import Robot
from sim.robots.moving_bodies import MovingBody
from sim.scene import Light

_OUT_OF_SIGHT = SE3(np.eye(3), np.array([0.0, 0.0, -50.0]))
"""Below the ground, which hides it."""
_SHADES = 64
_FACING_SIDES = 0.35
"""Share of the main light that upright surfaces receive in the mean over directions."""


def add_bodies(spec: mujoco.MjSpec, bodies: Sequence[MovingBody], light: Light | None) -> None:
    """Add bodies to a world, out of sight; without a light they are drawn in their colours."""
    for body in bodies:
        frame = spec.worldbody.add_body(name=body.name, mocap=True, pos=_OUT_OF_SIGHT.translation)
        for number, piece in enumerate(body_pieces(body.shape, body.height_m)):
            name = f"{body.name}_{number}"
            vertices, triangles = _flat(piece.mesh)
            add_picture(spec, name, _shades(piece, light), cube=False)
            spec.add_mesh(
                name=name,
                uservert=vertices.ravel(),
                userface=triangles.ravel().astype(np.int32),
                usertexcoord=_shade_places((vertices, triangles)).ravel(),
                inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
            )
            frame.add_geom(
                name=name,
                type=mujoco.mjtGeom.mjGEOM_MESH,
                meshname=name,
                material=name,
                contype=0,
                conaffinity=0,
            )


class BodiesInView:
    """The bodies that one robot sees.

    Args:
        robot: Robot that looks.
        bodies: All bodies of the recording.
    """

    def __init__(self, robot: Robot, bodies: Sequence[MovingBody]) -> None:
        self._all = bodies
        self._seen = [body for body in bodies if body.seen_by(robot)]
        self._edges = [
            find_edges(body_mesh(body_pieces(body.shape, body.height_m))) for body in self._seen
        ]

    def place(self, renderer: Renderer, time_ns: int) -> None:
        """Move all bodies to where they are at a time of the motion [ns], or out of sight."""
        if self._all:
            seen = {body.name: body.pose(time_ns) for body in self._seen}
            renderer.place({body.name: seen.get(body.name, _OUT_OF_SIGHT) for body in self._all})

    def edges(self, time_ns: int) -> list[Edges]:
        """Edges of the bodies that are seen, where they are then."""
        return [
            _moved(edges, body.pose(time_ns))
            for body, edges in zip(self._seen, self._edges, strict=True)
        ]


def _moved(edges: Edges, pose: SE3) -> Edges:
    normals = edges.planes[:, :3].astype(np.float64) @ pose.rotation.T
    ends = (pose @ edges.ends.reshape(-1, 3)).reshape(-1, 2, 3)
    offsets = edges.planes[:, 3] + normals @ pose.translation
    planes = np.column_stack([normals, offsets]).astype(np.float32)
    return replace(edges, ends=ends, planes=planes)


def _flat(mesh: Mesh) -> Mesh:
    """Corners of its own for every triangle, so that each has one shade."""
    vertices, triangles = mesh
    return vertices[triangles.ravel()], np.arange(triangles.size).reshape(-1, 3)


def _shade_places(mesh: Mesh) -> NDArray[np.float64]:
    """(V, 2) coordinates in the picture of shades: from facing down, on the left, to facing up."""
    vertices, triangles = mesh
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    up = normals[:, 2] / np.maximum(np.linalg.norm(normals, axis=1), 1e-12)
    across = (0.5 + (_SHADES - 1) * (up + 1) / 2) / _SHADES
    return np.repeat(np.stack([across, np.full(len(up), 0.5)], axis=1), 3, axis=0)


def _shades(piece: Piece, light: Light | None) -> NDArray[np.uint8]:
    """(4, shades, 3) colour of the piece by how far its surface faces up, from -1 to 1.

    The light is that of open ground. A body turns, so its sides all receive the mean over
    directions, and it throws no shadow.
    """
    up = np.linspace(-1, 1, _SHADES)
    irradiance = np.ones(_SHADES)
    if light is not None:
        sides = _FACING_SIDES
        faces_lamp = np.where(up > 0, sides + (1 - sides) * up, sides * (1 + up))
        irradiance = (light.main + light.fill) * faces_lamp + light.ambient * (0.6 + 0.4 * up)
    shown = np.array(piece.colour) * irradiance[:, None] ** (1 / DISPLAY_GAMMA)
    row = np.clip(shown + 0.5, 0, 255).astype(np.uint8)
    return np.ascontiguousarray(np.broadcast_to(row, (4, _SHADES, 3)))
