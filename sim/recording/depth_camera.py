"""The ground robot's depth camera: what it sees, measures, and hands on through its driver."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from airground.core.se3 import SE3
from airground.io.calibration import CameraTable, GroundTable
from airground.io.images import depth_units, metric_depth
from sim.recording.robot_view import RobotView
from sim.recording.view_tiles import Tile, tiles_of
from sim.sensors.depth import kinect_depth
from sim.sensors.pixel_rays import PixelRays
from sim.sensors.sensor_errors import DepthNoise

VIEW = "ground_depth"
"""Name of the depth camera's views in a drawn world."""


def depth_tiles(true: GroundTable) -> list[Tile]:
    """The views of a depth camera of its own; none without one."""
    camera = true.depth.camera
    return [] if camera is None else tiles_of(VIEW, camera.lens())


def true_depth_camera(true: GroundTable) -> tuple[CameraTable, SE3]:
    """The camera whose pixels depth is measured in, and its pose in the colour camera."""
    camera, pose = true.depth.camera, true.depth.T_camera_depth
    if camera is None or pose is None:
        return true.camera, SE3.identity()
    return camera, SE3.from_matrix(pose)


class DepthCamera:
    """Makes depth images.

    Args:
        true: True calibration of the ground robot.
        driver: Nominal calibration by which the driver registers depth; None if it does not.
        noise: Faults of the measurement; None for a perfect one.
        view: What the depth camera sees: the colour camera's view if it is no camera of its own.
    """

    def __init__(
        self,
        true: GroundTable,
        driver: GroundTable | None,
        noise: DepthNoise | None,
        view: RobotView,
    ) -> None:
        self._noise, self._units_per_m = noise, true.depth.units_per_m
        self.view, self._delay_ns = view, true.depth.delay_ns
        self._is_colour_camera = true.depth.camera is None and not self._delay_ns
        self.rays = PixelRays.of(true_depth_camera(true)[0].lens())
        self._driver_units_per_m = driver.depth.units_per_m if driver else 0.0
        self._registration = driver.registration() if driver else None

    def units(
        self, time_ns: int, colours_depth: NDArray[np.float32], rng: np.random.Generator
    ) -> NDArray[np.uint16]:
        """(height, width) PNG values of the depth image that belongs to a colour image.

        Args:
            time_ns: When the colour image is taken [ns].
            colours_depth: (height, width) true depth of its pixels [m].
            rng: Source of the noise.
        """
        depth = colours_depth
        if not self._is_colour_camera:
            depth = self.view.depth(time_ns + self._delay_ns)
        if self._noise is not None:
            depth = kinect_depth(depth, self.rays, self._noise, rng)
        units = depth_units(depth, self._units_per_m)
        if self._registration is None:
            return units
        scale = self._driver_units_per_m
        return depth_units(self._registration.registered(metric_depth(units, scale)), scale)
