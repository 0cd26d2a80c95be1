"""The corners that a front end shows are those that its pose rests on."""

from __future__ import annotations

import numpy as np
import pytest

from airground.config import Config
from airground.slam.front_end import TrackedCorners, Tracking
from airground.slam.rgbd import RgbdSlam
from tests.slam.synthetic_world import CAMERA, ground_sequence


def test_map_points_project_onto_the_corners_shown() -> None:
    sequence = ground_sequence(12)
    front_end = RgbdSlam(sequence.calibration, Config(), np.random.default_rng(0))
    newest = sequence.feed(front_end)[-1]
    corners, slam = newest.corners, front_end._slam
    assert newest.T_map_camera is not None
    assert corners is not None
    assert np.shares_memory(corners.pixels, slam.tracker.pixels)  # looking costs no copy
    seen = slam.map.positions[slam.tracker.ids[corners.mapped]]
    projected = CAMERA.project(newest.T_map_camera.inverse() @ seen)
    off_px = np.linalg.norm(projected - corners.pixels[corners.mapped], axis=1)
    assert len(off_px) >= Config().rgbd_slam.min_points
    assert np.median(off_px) < 1.0


def test_an_image_without_a_pose_shows_none() -> None:
    sequence = ground_sequence(24).darkened(12, 24)
    tracked = sequence.feed(RgbdSlam(sequence.calibration, Config(), np.random.default_rng(0)))
    lost = [pose for pose in tracked if pose.tracking is Tracking.LOST]
    assert lost
    assert all(pose.corners is None for pose in lost)


def test_corners_are_checked_and_stay_as_they_are() -> None:
    corners = TrackedCorners(np.zeros((2, 2), np.float32), np.array([True, False]))
    with pytest.raises(ValueError, match="read-only"):
        corners.pixels[0] = 1
    with pytest.raises(ValueError, match="mapped"):
        TrackedCorners(np.zeros((2, 2), np.float32), np.array([True]))
