"""Opens what one or both robots recorded: a recording of ours, plain EuRoC or TUM RGB-D folders."""

from __future__ import annotations

from pathlib import Path
from typing import Any, overload

from airground.core.cloud import Source
from airground.errors import RecordingError
from airground.io import layout
from airground.io.plain_euroc import euroc_folder, open_euroc
from airground.io.plain_tum import is_tum_folder, open_tum
from airground.io.recording import Recording
from airground.io.robot_recording import Pair, RobotRecording


@overload
def open_recording(path: Path | str) -> Recording: ...
@overload
def open_recording(path: Path | str, ground: Path | str) -> Pair: ...
def open_recording(path: Path | str, ground: Path | str | None = None) -> Pair:
    """Open what both robots recorded.

    Args:
        path: A recording of ours; with `ground`, the folder of the MAV: ours, EuRoC or TUM RGB-D.
        ground: The folder of the ground robot: ours or TUM RGB-D, stamped by the MAV's clock.

    Raises:
        RecordingError: A folder is none of these, holds no such robot, or is damaged.
    """
    path = Path(path)
    if ground is not None:
        return Pair(open_robot(path, Source.MAV), open_robot(Path(ground), Source.GROUND))
    one_robot = euroc_folder(path) is not None or is_tum_folder(path)
    if one_robot and not (path / layout.HEADER).exists():
        raise RecordingError(
            f"{path}: holds one robot only; give the MAV's and the ground robot's folders"
        )
    return Recording.open(path)


def open_robot(
    path: Path | str, robot: Source, calibration_file: Path | None = None
) -> RobotRecording[Any]:
    """Open what one robot recorded.

    Args:
        path: A recording of ours, or a plain EuRoC or TUM RGB-D folder.
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
        return Recording.open(path).of(robot)
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
