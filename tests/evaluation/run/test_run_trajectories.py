"""The trajectories that a run leaves: of the bodies, live and final, absent where never tracked."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np

from airground.core.camera import PinholeCamera
from airground.core.messages import GroundImage, ImuSamples, MavImage, RobotCalibration
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.io.recording import Recording
from airground.io.tum import read_tum
from airground.slam.front_end import TrackedPose, Tracking
from evaluation.run.recording import write_trajectories
from evaluation.table.tracking_log import Tracked, WatchedFrontEnd

STAMPS = (1_000_000_000, 1_033_333_333, 1_066_666_667)
T_IMU_CAMERA = SE3.from_rotation_vector([np.pi, 0, 0], [0.05, 0.0, -0.02])
T_BODY_IMU = SE3.from_rotation_vector([0, 0, 0.3], [0.0, 0.1, 0.04])
CALIBRATION = RobotCalibration(PinholeCamera(4, 4, 2, 2, 1.5, 1.5), T_IMU_CAMERA, T_BODY_IMU)


class Corrected:
    """Tracks every image, and moves all poses up by a metre in the end."""

    def add_imu(self, samples: ImuSamples) -> None:
        """Nothing to learn from them."""

    def track(self, image: MavImage | GroundImage) -> TrackedPose:
        return TrackedPose(image.stamp_ns, Tracking.TRACKED, camera(image.stamp_ns))

    def finish(self) -> None:
        """Nothing was put off."""

    def trajectory(self) -> Trajectory | None:
        lift = SE3.from_heading(0.0, [0, 0, 1.0])
        return Trajectory.from_poses(list(STAMPS), [lift @ camera(stamp) for stamp in STAMPS])


def camera(stamp_ns: int) -> SE3:
    seconds = stamp_ns * 1e-9
    return SE3.from_rotation_vector([3.0, 0.1, seconds], [seconds, 0.2, 2.0])


def test_files_hold_the_body_live_and_final(tmp_path: Path) -> None:
    mav: WatchedFrontEnd = WatchedFrontEnd(Corrected())
    for stamp in STAMPS:
        mav.track(MavImage(stamp, np.zeros((4, 4), np.uint8)))
    tracked = {
        "mav": Tracked("mav", mav, mav.trajectory(), True),
        "ground": Tracked("ground", WatchedFrontEnd(Corrected()), None, True),
    }
    recording: Any = SimpleNamespace(mav=CALIBRATION, ground=CALIBRATION)
    write_trajectories(tmp_path, cast(Recording, recording), tracked)
    assert {file.name for file in tmp_path.iterdir()} == {"mav.tum", "mav_live.tum"}
    live, final = read_tum(tmp_path / "mav_live.tum"), read_tum(tmp_path / "mav.tum")
    T_camera_body = (T_BODY_IMU @ T_IMU_CAMERA).inverse()
    for index, stamp in enumerate(STAMPS):
        body = camera(stamp) @ T_camera_body
        assert int(live.stamps_ns[index]) == stamp
        assert np.allclose(live[index].matrix(), body.matrix(), atol=1e-6)
        lifted = body.translation + np.array([0, 0, 1])
        assert np.allclose(final[index].translation, lifted, atol=1e-6)
