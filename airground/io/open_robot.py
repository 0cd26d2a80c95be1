"""One robot's part of any folder that can be read."""

from __future__ import annotations

from pathlib import Path

from airground.core.cloud import Source
from airground.errors import RecordingError
from airground.io import layout
from airground.io.plain_euroc import euroc_folder, open_euroc
from airground.io.plain_tum import is_tum_folder, open_tum
from airground.io.recording import Recording
from airground.io.robot_recording import RobotRecording


def open_robot(path: Path, robot: Source, calibration_file: Path | None = None) -> RobotRecording:
    """Open what one robot recorded: a recording of ours, a plain EuRoC or TUM RGB-D folder.

    Args:
        path: The folder.
        robot: MAV (one grey camera) or ground robot (colour and depth).
        calibration_file: Camera calibration of a plain folder, in the form of EuRoC's
            `sensor.yaml`.

    Raises:
        RecordingError: The folder is none of these, holds no such robot, or is damaged.
    """
    path = Path(path)
    if not path.is_dir():
        raise RecordingError(f"{path}: no such folder")
    if (path / layout.HEADER).exists():
        if calibration_file is not None:
            raise RecordingError(
                f"{calibration_file}: {path} has its own calibration in {layout.HEADER}; "
                "a file is only for plain EuRoC and TUM RGB-D folders"
            )
        return _part(Recording.open(path), robot)
    if euroc_folder(path) is not None:
        if robot != Source.MAV:
            raise RecordingError(
                f"{path}: an EuRoC folder has no depth images; it can only be read as the MAV's"
            )
        return open_euroc(path, calibration_file)
    if is_tum_folder(path):
        return open_tum(path, robot, calibration_file)
    raise RecordingError(
        f"{path}: holds neither {layout.HEADER} (a recording of ours) nor mav0/cam0 (EuRoC) "
        "nor rgb.txt (TUM RGB-D)"
    )


def _part(recording: Recording, robot: Source) -> RobotRecording:
    is_mav = robot == Source.MAV
    calibration = recording.mav if is_mav else recording.ground
    return RobotRecording(
        path=recording.path,
        layout="airground",
        robot=robot,
        calibration=calibration,
        camera_stamps=recording.mav_camera_stamps if is_mav else recording.ground_camera_stamps,
        imu=recording.mav_imu if is_mav else recording.ground_imu,
        magnetic=recording.mav_magnetic if is_mav else recording.ground_magnetic,
        read_image=recording.read_mav_image if is_mav else recording.read_ground_image,
        pose_frame="body",
        T_pose_camera=calibration.T_body_imu @ calibration.T_imu_camera,
    )
