"""Single images of a world from any place, with the faults of a robot's camera at rest."""

from __future__ import annotations

from dataclasses import dataclass
from types import TracebackType

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from sim.geometry.edges import find_edges
from sim.recording.render import Renderer, with_cameras
from sim.recording.smooth_edges import smooth_edges
from sim.robots.motion import ROBOTS, Robot
from sim.sensors.camera import ImageSensor
from sim.sensors.depth import kinect_depth
from sim.sensors.miscalibration import GROUND_FOCAL_PX, GROUND_IMAGE_PX, MAV_IMAGE_PX
from sim.sensors.pixel_rays import PixelRays
from sim.sensors.presets import SensorPreset
from sim.world.world import World


@dataclass(frozen=True, eq=False)
class Still:
    """An image, and the camera that took it.

    Attributes:
        camera: True intrinsics.
        T_world_camera: True pose.
        grey: (height, width) uint8 image.
        depth: (height, width) float32 depth as a Kinect measures it [m], NaN where missing.
    """

    camera: PinholeCamera
    T_world_camera: SE3
    grey: NDArray[np.uint8]
    depth: NDArray[np.float32]


class Stills:
    """Draws a world with the cameras of both robots; a context manager.

    Args:
        world: World with pictures.
        sensors: Faults of the cameras; there is no motion and so no motion blur.
        rng: Source of the faults.
    """

    def __init__(self, world: World, sensors: SensorPreset, rng: np.random.Generator) -> None:
        focal_px = {"mav": world.scene.mav.camera_f_px, "ground": GROUND_FOCAL_PX}
        sizes_px = {"mav": MAV_IMAGE_PX, "ground": GROUND_IMAGE_PX}
        self._cameras: dict[str, PinholeCamera] = {
            robot: _centred(sizes_px[robot], focal_px[robot]) for robot in ROBOTS
        }
        self._sensors, self._rng = sensors, rng
        self._faults = {
            robot: None
            if sensors.image is None
            else ImageSensor.of(PixelRays(camera), sensors.image, rng)
            for robot, camera in self._cameras.items()
        }
        self._edges = find_edges((world.vertices, world.triangles), world.terrain)
        self._renderer = Renderer(with_cameras(world.spec, self._cameras))

    def __enter__(self) -> Stills:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._renderer.close()

    def take(self, robot: Robot, T_world_camera: SE3) -> Still:
        """The image of one robot's camera at a pose."""
        camera = self._cameras[robot]
        colour, depth = self._renderer.draw(robot, T_world_camera)
        grey = np.asarray(cv2.cvtColor(colour, cv2.COLOR_RGB2GRAY), np.uint8)[..., None]
        grey = smooth_edges(grey, depth, camera, T_world_camera, self._edges)
        faults = self._faults[robot]
        if faults is not None:
            grey = faults.expose(grey, depth, SE3.identity(), 0.0, self._rng)
        if self._sensors.depth is not None:
            depth = kinect_depth(depth, PixelRays(camera), self._sensors.depth, self._rng)
        return Still(camera, T_world_camera, grey[..., 0], depth)


def _centred(size_px: tuple[int, int], focal_px: float) -> PinholeCamera:
    width, height = size_px
    return PinholeCamera(width, height, focal_px, focal_px, (width - 1) / 2, (height - 1) / 2)
