"""Trajectory files of a run: poses of the body, live and final; no file without poses."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from airground.core.messages import GroundImage, ImuSamples, MavImage
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.io.tum import read_tum
from airground.slam.front_end import TrackedPose, Tracking
from evaluation.run.tracking import write_paths
from evaluation.table.tracking_log import WatchedFrontEnd

STAMPS = (1_000_000_000, 1_033_333_333, 1_066_666_667)
T_IMU_CAMERA = SE3.from_rotation_vector([np.pi, 0, 0], [0.05, 0.0, -0.02])
T_BODY_IMU = SE3.from_rotation_vector([0, 0, 0.3], [0.0, 0.1, 0.04])


class Corrected:
    """Tracks every image; its final poses are one metre higher."""

    def add_imu(self, samples: ImuSamples) -> None:
        """Ignored."""

    def track(self, image: MavImage | GroundImage) -> TrackedPose:
        return TrackedPose(image.stamp_ns, Tracking.TRACKED, camera(image.stamp_ns))

    def finish(self) -> None:
        """Nothing to do."""

    def trajectory(self) -> Trajectory | None:
        lift = SE3.from_heading(0.0, [0, 0, 1.0])
        return Trajectory.from_poses(list(STAMPS), [lift @ camera(stamp) for stamp in STAMPS])


def camera(stamp_ns: int) -> SE3:
    seconds = stamp_ns * 1e-9
    return SE3.from_rotation_vector([3.0, 0.1, seconds], [seconds, 0.2, 2.0])


def test_files_have_live_and_final_poses_of_the_body(tmp_path: Path) -> None:
    mav: WatchedFrontEnd = WatchedFrontEnd(Corrected())
    for stamp in STAMPS:
        mav.track(MavImage(stamp, np.zeros((4, 4), np.uint8)))
    recording: Any = SimpleNamespace(
        T_pose_camera=T_BODY_IMU @ T_IMU_CAMERA, published_stamps=lambda stamps_ns: stamps_ns
    )
    write_paths(tmp_path, "mav", recording, mav, mav.trajectory())
    write_paths(tmp_path, "ground", recording, WatchedFrontEnd(Corrected()), None)
    assert {file.name for file in tmp_path.iterdir()} == {"mav.tum", "mav_live.tum"}
    live, final = read_tum(tmp_path / "mav_live.tum"), read_tum(tmp_path / "mav.tum")
    T_camera_body = (T_BODY_IMU @ T_IMU_CAMERA).inverse()
    for index, stamp in enumerate(STAMPS):
        body = camera(stamp) @ T_camera_body
        assert int(live.stamps_ns[index]) == stamp
        assert np.allclose(live[index].matrix(), body.matrix(), atol=1e-6)
        lifted = body.translation + np.array([0, 0, 1])
        assert np.allclose(final[index].translation, lifted, atol=1e-6)
