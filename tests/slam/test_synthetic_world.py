"""The world that SLAM's tests believe in agrees with itself."""

from __future__ import annotations

import itertools

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from airground.core.messages import GroundImage
from tests.slam.synthetic_world import CAMERA, GRAVITY, Sequence, ground_sequence, mav_sequence

SEQUENCES = {"mav": mav_sequence, "ground": ground_sequence}


@pytest.mark.parametrize("name", SEQUENCES)
def test_the_imu_integrates_to_the_true_path(name: str) -> None:
    sequence = SEQUENCES[name]()
    truth, imu = sequence.T_world_camera, sequence.imu
    T_camera_imu = sequence.calibration.T_imu_camera.inverse()
    start = truth[0] @ T_camera_imu
    rotation, position, velocity = start.rotation, start.translation, np.zeros(3)
    inside = (imu.stamps_ns >= truth.stamps_ns[0]) & (imu.stamps_ns <= truth.stamps_ns[-1])
    indices = np.flatnonzero(inside)
    for a, b in itertools.pairwise(indices):
        dt = (imu.stamps_ns[b] - imu.stamps_ns[a]) / 1e9
        turn = Rotation.from_rotvec((imu.gyro[a] + imu.gyro[b]) / 2 * dt).as_matrix()
        force = rotation @ imu.accelerometer[a] + rotation @ turn @ imu.accelerometer[b]
        acceleration = force / 2 - GRAVITY
        position = position + velocity * dt + acceleration * dt**2 / 2
        velocity = velocity + acceleration * dt
        rotation = rotation @ turn
    end = truth.at(int(imu.stamps_ns[indices[-1]])) @ T_camera_imu
    moved = np.linalg.norm(end.translation - start.translation)
    assert moved > 0.2
    np.testing.assert_allclose(position, end.translation, atol=1e-3)
    np.testing.assert_allclose(rotation, end.rotation, atol=1e-3)


def test_depth_carries_one_image_into_another() -> None:
    sequence = ground_sequence()
    first, last = sequence.images[0], sequence.images[-1]
    assert isinstance(first, GroundImage)
    assert isinstance(last, GroundImage)
    T_world_camera = sequence.T_world_camera
    points = CAMERA.back_project(first.depth.astype(np.float64)).reshape(-1, 3)
    moved = (T_world_camera[-1].inverse() @ T_world_camera[0]) @ points
    pixels = CAMERA.project(moved).reshape(*first.depth.shape, 2).astype(np.float32)
    seen = cv2.remap(last.colour, pixels[..., 0], pixels[..., 1], cv2.INTER_LINEAR)
    depth = cv2.remap(last.depth, pixels[..., 0], pixels[..., 1], cv2.INTER_NEAREST)
    visible = np.abs(depth - moved[:, 2].reshape(depth.shape)) < 0.02
    assert visible.mean() > 0.5
    off = np.abs(seen.astype(float) - first.colour.astype(float)).mean(axis=2)[visible]
    assert np.median(off) < 4.0  # the images' noise


@pytest.mark.parametrize("name", SEQUENCES)
def test_each_robot_begins_at_rest_and_then_moves(name: str) -> None:
    sequence: Sequence = SEQUENCES[name]()
    positions = sequence.T_world_camera.translations
    assert np.linalg.norm(positions[8] - positions[0]) < 1e-3
    assert sequence.T_world_camera.path_m() > 0.2
    np.testing.assert_allclose(sequence.imu.accelerometer[:20], [GRAVITY] * 20, atol=0.02)
