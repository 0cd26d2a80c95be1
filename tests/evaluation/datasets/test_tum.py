"""The TUM export in the hands of others: evo, Open3D's and OpenCV's RGB-D odometry."""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import open3d as o3d
import pytest
from evo.core import metrics, sync
from evo.tools import file_interface

from airground.core.cloud import Source
from airground.core.messages import GroundImage
from airground.core.se3 import SE3
from airground.io.open_recording import open_robot
from airground.io.tum import read_tum
from evaluation.datasets.simulated import Simulated
from evaluation.table.true_camera import true_camera

Exported = Callable[[str], Path]
APART = 10
"""Images between which odometry is tried."""


@pytest.fixture(scope="module")
def folder(exported: Exported) -> Path:
    return exported("tum")


def test_evo_finds_no_error_of_the_truth_against_itself(folder: Path) -> None:
    truth = file_interface.read_tum_trajectory_file(str(folder / "groundtruth.txt"))
    pair = sync.associate_trajectories(truth, truth, max_diff=1e-4)
    error = metrics.APE(metrics.PoseRelation.full_transformation)
    error.process_data(pair)
    assert truth.num_poses == 21
    assert error.get_statistic(metrics.StatisticsType.max) == pytest.approx(0.0, abs=1e-9)


def test_the_truth_is_of_the_camera_when_the_image_was_really_taken(
    folder: Path, simulated: Simulated
) -> None:
    poses = read_tum(folder / "groundtruth.txt")
    for index, stamp in enumerate(simulated.stamps_ns("ground")):
        true = simulated.truth.T_world_ground_camera(stamp)
        off = true.inverse() @ poses[index]
        assert poses.stamps_ns[index] == stamp
        assert np.abs(off.log()).max() < 1e-7


def test_every_list_names_its_files(folder: Path) -> None:
    for kind in ("rgb", "depth"):
        lines = (folder / f"{kind}.txt").read_text().splitlines()
        names = [line.split()[1] for line in lines if not line.startswith("#")]
        assert len(names) == 21
        assert {f"{kind}/{file.name}" for file in (folder / kind).iterdir()} == set(names)


def _open3d(first: GroundImage, second: GroundImage, matrix: np.ndarray) -> SE3:
    """T_second_first."""
    height, width = first.depth.shape
    camera = o3d.camera.PinholeCameraIntrinsic(width, height, matrix)
    source, target = (
        o3d.geometry.RGBDImage.create_from_color_and_depth(
            o3d.geometry.Image(np.array(image.colour)),
            o3d.geometry.Image(np.nan_to_num(image.depth)),
            depth_scale=1.0,
            depth_trunc=6.0,
        )
        for image in (first, second)
    )
    method = o3d.pipelines.odometry.RGBDOdometryJacobianFromHybridTerm()
    success, pose, _ = o3d.pipelines.odometry.compute_rgbd_odometry(
        source, target, camera, np.eye(4), method
    )
    assert success
    return SE3.from_matrix(pose)


def _opencv(first: GroundImage, second: GroundImage, matrix: np.ndarray) -> SE3:
    """T_second_first."""
    settings = cv2.OdometrySettings()
    settings.setCameraMatrix(matrix.astype(np.float32))
    odometry = cv2.Odometry(cv2.OdometryType_RGB_DEPTH, settings, cv2.OdometryAlgoType_COMMON)
    frames = [
        cv2.OdometryFrame(np.array(image.depth), cv2.cvtColor(image.colour, cv2.COLOR_RGB2GRAY))
        for image in (first, second)
    ]
    for frame in frames:
        odometry.prepareFrame(frame)
    success, pose = odometry.compute(*frames)
    assert success
    return SE3.from_matrix(pose)


@pytest.mark.parametrize("odometry", [_open3d, _opencv])
def test_odometry_of_others_follows_the_truth(
    folder: Path, odometry: Callable[[GroundImage, GroundImage, np.ndarray], SE3]
) -> None:
    """Depth, colour, calibration and truth fit together, or these would be lost."""
    recording = open_robot(folder, Source.GROUND)
    true_pose = true_camera(recording)
    assert true_pose is not None
    first, second = (recording.read_image(i) for i in (0, APART))
    assert isinstance(first, GroundImage)
    assert isinstance(second, GroundImage)
    T_world_first, T_world_second = true_pose(first.stamp_ns), true_pose(second.stamp_ns)
    assert T_world_first is not None
    assert T_world_second is not None
    true = T_world_second.inverse() @ T_world_first
    moved = np.linalg.norm(true.translation)
    off = true.inverse() @ odometry(first, second, recording.calibration.camera.matrix())
    assert moved > 0.05
    assert np.linalg.norm(off.translation) < moved / 3
    assert np.rad2deg(off.angle()) < 0.5
