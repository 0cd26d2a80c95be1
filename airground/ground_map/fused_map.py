"""Keyframes of the ground robot, fused at their estimated poses (Sec. IV).

A truncated signed distance field averages the sensor's noise along its rays. Averaging points in
cubes does not: at 4 m the noise of structured light is wider than a cube. When SLAM corrects
poses, keyframes are fused anew."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import replace

import numpy as np

from airground.config import GroundMapping
from airground.core.arrays import F32, U8
from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud
from airground.core.messages import GroundImage
from airground.core.se3 import SE3, rotation_angle
from airground.core.trajectory import Trajectory
from airground.core.work_ahead import read_ahead
from airground.ground_map.blocked_field import BLOCK, BlockedField, empty_grid
from airground.ground_map.integration import integrate
from airground.ground_map.keyframe import GroundKeyframe
from airground.ground_map.surface_points import surface_points
from airground.ground_map.touched_blocks import touched_blocks

_FIRST_BLOCKS = 10_000


class FixedMap:
    """A given map in the frame `ground` that takes the place of a `GroundMap` and never changes."""

    keyframes = 0

    def __init__(self, cloud: PointCloud) -> None:
        self._cloud = cloud

    def wants(self, T_ground_camera: SE3) -> bool:
        return False

    def add(self, image: GroundImage, T_ground_camera: SE3) -> None:
        raise TypeError("a fixed map takes no keyframes")

    def follow(self, trajectory: Trajectory) -> bool:
        return False

    def cloud(self) -> PointCloud:
        return self._cloud


class GroundMap:
    """Keyframes' depth images, fused in the frame `ground`."""

    def __init__(self, camera: PinholeCamera, config: GroundMapping) -> None:
        self._config = config
        self._camera = camera
        self._keyframes: list[GroundKeyframe] = []
        self._grid = empty_grid(self._config.voxel_m, _FIRST_BLOCKS)
        self._fused = 0
        self._cloud: PointCloud | None = None

    @property
    def keyframes(self) -> int:
        return len(self._keyframes)

    def wants(self, T_ground_camera: SE3) -> bool:
        """Whether the camera moved or turned enough since the last keyframe, to a rare view."""
        if not self._keyframes:
            return True
        if self._is_near(self._keyframes[-1], T_ground_camera):
            return False
        places = np.array([keyframe.T_ground_camera.translation for keyframe in self._keyframes])
        apart = np.linalg.norm(places - T_ground_camera.translation, axis=1)
        here = np.flatnonzero(apart < self._config.keyframe_distance_m)
        alike = sum(self._is_near(self._keyframes[index], T_ground_camera) for index in here)
        return alike < self._config.keyframes_a_view

    def _is_near(self, keyframe: GroundKeyframe, T_ground_camera: SE3) -> bool:
        """Whether a camera there would see what the keyframe does."""
        distance, angle = self._config.keyframe_distance_m, self._config.keyframe_angle_deg
        return not _moved(keyframe.T_ground_camera, T_ground_camera, distance, angle)

    def add(self, image: GroundImage, T_ground_camera: SE3) -> None:
        keyframe = GroundKeyframe.pack(image, T_ground_camera, self._config.max_depth_m)
        self._keyframes.append(keyframe)
        self._cloud = None
        if self._fused == len(self._keyframes) - 1:
            self._fuse(keyframe, *keyframe.unpack())

    def follow(self, trajectory: Trajectory) -> bool:
        """Move the keyframes to their poses `T_ground_camera` in a corrected trajectory.

        Keyframes that it does not hold stay. Returns whether one moved by more than the bounds of
        the configuration, so that the map is fused anew when it is next asked for."""
        corrected = [_corrected(keyframe, trajectory) for keyframe in self._keyframes]
        distance, angle = self._config.follow_distance_m, self._config.follow_angle_deg
        if not any(
            _moved(old.T_ground_camera, new.T_ground_camera, distance, angle)
            for old, new in zip(self._keyframes, corrected, strict=True)
        ):
            return False
        self._keyframes = corrected
        self._grid = empty_grid(self._config.voxel_m, _FIRST_BLOCKS)
        self._fused, self._cloud = 0, None
        return True

    def cloud(self) -> PointCloud:
        """The surface so far, with normals, in the frame `ground`."""
        if self._cloud is None:
            self._catch_up()
            self._cloud = surface_points(self.field(), self._config.min_keyframes - 0.5)
        return self._cloud

    def field(self) -> BlockedField:
        """The distance field so far; fusing further keyframes changes it."""
        return BlockedField.of(self._grid, self._config.voxel_m)

    def _catch_up(self) -> None:
        waiting = self._keyframes[self._fused :]
        # Unpacking takes a core for almost as long as fusing does.
        with (
            ThreadPoolExecutor(1) as pool,
            closing(read_ahead(pool, GroundKeyframe.unpack, waiting)) as unpacked,
        ):
            for keyframe, images in zip(waiting, unpacked, strict=True):
                self._fuse(keyframe, *images)

    def _fuse(self, keyframe: GroundKeyframe, depth: F32, colour: U8) -> None:
        self._fused += 1
        config, pose = self._config, keyframe.T_ground_camera
        camera, voxel_m, truncation_m = self._camera, config.voxel_m, config.truncation_m
        block_m = BLOCK * voxel_m
        blocks = touched_blocks(depth, camera, pose, block_m, truncation_m, config.max_depth_m)
        integrate(self._grid, blocks, depth, colour, camera, pose, voxel_m, truncation_m)


def _corrected(keyframe: GroundKeyframe, trajectory: Trajectory) -> GroundKeyframe:
    index = int(np.searchsorted(trajectory.stamps_ns, keyframe.stamp_ns))
    if index == len(trajectory) or trajectory.stamps_ns[index] != keyframe.stamp_ns:
        return keyframe
    return replace(keyframe, T_ground_camera=trajectory[index])


def _moved(start: SE3, end: SE3, distance_m: float, angle_deg: float) -> bool:
    """Whether a pose is this far from another, or turned this much."""
    distance = math.dist(start.translation, end.translation)
    turn = rotation_angle(start.rotation.T @ end.rotation)
    return distance >= distance_m or math.degrees(turn) >= angle_deg
