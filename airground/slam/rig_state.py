"""The estimated state of a moving robot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from airground.core.arrays import F64
from airground.core.se3 import SE3, nearest_rotation
from airground.slam.inertial.stationarity import Rest


@dataclass(frozen=True, eq=False)
class RigState:
    """State of the rig: the IMU, or the camera where there is no IMU.

    Attributes:
        rotation, position: (3, 3) and (3,) pose `T_map_rig` [m].
        velocity: (3,) velocity in the map [m/s].
        gyro_bias, accelerometer_bias: (3,) biases [rad/s], [m/s^2].
    """

    rotation: F64
    position: F64
    velocity: F64
    gyro_bias: F64
    accelerometer_bias: F64

    @classmethod
    def at_origin(cls, rotation: F64 | None = None) -> RigState:
        """At rest in the map's origin."""
        rotation = np.eye(3) if rotation is None else rotation
        return cls(rotation, *(np.zeros(3) for _ in range(4)))

    def pose(self) -> SE3:
        """`T_map_rig`."""
        return self._pose

    @cached_property
    def _pose(self) -> SE3:
        return SE3(nearest_rotation(self.rotation), self.position)

    def standing(self, rest: Rest) -> RigState:
        """The same pose, at rest, with the biases that the IMU shows there."""
        return replace(
            self,
            velocity=np.zeros(3),
            gyro_bias=rest.gyro,
            accelerometer_bias=rest.accelerometer_bias,
        )

    def posed(self, T_map_rig: SE3) -> RigState:
        """The same state at another pose."""
        return replace(self, rotation=T_map_rig.rotation, position=T_map_rig.translation)

    def scaled(self, scale: float, rotation: F64, lever: F64) -> RigState:
        """The same state after the map was scaled and then turned about its origin.

        Args:
            scale: Factor on all distances but that between rig and camera, which is metric.
            rotation: (3, 3) rotation after scaling.
            lever: (3,) position of the camera in the rig [m].
        """
        turned = nearest_rotation(rotation @ self.rotation)
        camera = scale * rotation @ (self.position + self.rotation @ lever)
        velocity = scale * rotation @ self.velocity
        return replace(self, rotation=turned, position=camera - turned @ lever, velocity=velocity)

    def shifted(self, by: F64) -> RigState:
        """The same state after the map was shifted by (3,) [m]."""
        return replace(self, position=self.position + by)

    def moved(self, T_new_map: SE3) -> RigState:
        """The same state after the map moved."""
        return replace(
            self,
            rotation=nearest_rotation(T_new_map.rotation @ self.rotation),
            position=T_new_map @ self.position,
            velocity=T_new_map.rotation @ self.velocity,
        )

    def following(self, T_map_before: SE3, newest: RigState) -> RigState:
        """The same state after the newest keyframe moved from a pose to where it is now."""
        return replace(
            self.moved(newest.pose() @ T_map_before.inverse()),
            gyro_bias=newest.gyro_bias,
            accelerometer_bias=newest.accelerometer_bias,
        )
