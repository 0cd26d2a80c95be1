"""Opens what one or both robots recorded, whatever its layout: ours, EuRoC, TUM RGB-D, 7-Scenes,
ROS bags."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, overload

from airground.core.cloud import Source
from airground.errors import InputError, RecordingError
from airground.io import layout
from airground.io.plain_euroc import euroc_folder, open_euroc
from airground.io.plain_seven_scenes import is_seven_scenes_folder, open_seven_scenes
from airground.io.plain_tum import open_tum
from airground.io.recording import Recording
from airground.io.recording_folder import RecordingFolder
from airground.io.robot_recording import Pair, RobotRecording
from airground.io.tum_lists import is_tum_folder

Layout = Literal["airground", "euroc", "tum", "7scenes", "ros"]
EXPECTED = (
    f"expected {layout.HEADER} (a recording of ours), mav0/cam0 (EuRoC), rgb.txt or "
    "associations.txt (TUM RGB-D), frame-000000.color.png (7-Scenes), a .bag or .mcap file or a "
    "bag's metadata.yaml (ROS)"
)


def layout_of(path: Path) -> Layout | None:
    """The layout of a folder or file, by the names in it; None where it is unknown."""
    if path.is_dir():
        if (path / layout.HEADER).exists():
            return "airground"
        if euroc_folder(path) is not None:
            return "euroc"
        if is_tum_folder(path):
            return "tum"
        if is_seven_scenes_folder(path):
            return "7scenes"
    return "ros" if is_bag(path) else None


def is_bag(path: Path) -> bool:
    """Whether a path leads to a ROS bag, by its name."""
    if path.is_dir():
        return (path / "metadata.yaml").is_file()
    return path.suffix in (".bag", ".mcap", ".db3") and path.is_file()


@overload
def open_recording(path: Path | str) -> Recording: ...
@overload
def open_recording(path: Path | str, ground: Path | str) -> Pair: ...
def open_recording(path: Path | str, ground: Path | str | None = None) -> Pair:
    """Open what both robots recorded.

    Args:
        path: A recording of ours; with `ground`, the MAV's folder or bag of any layout.
        ground: The ground robot's folder or bag, with depth, stamped by the MAV's clock.

    Raises:
        RecordingError: A folder is none of these, holds no such robot, or is damaged.
    """
    path = Path(path)
    if ground is not None:
        return Pair(open_robot(path, Source.MAV), open_robot(Path(ground), Source.GROUND))
    if layout_of(path) not in (None, "airground"):
        raise RecordingError(
            f"{path}: holds one robot only; give the MAV's and the ground robot's folders"
        )
    return Recording.open(path)


def open_robot(
    path: Path | str,
    robot: Source,
    calibration_file: Path | None = None,
    *,
    depth_units_per_m: float | None = None,
    topics: Mapping[str, str] | None = None,
) -> RobotRecording[Any]:
    """Open what one robot recorded.

    Args:
        path: A recording of ours, a folder of EuRoC, TUM RGB-D or 7-Scenes, or a ROS bag.
        robot: MAV (one grey camera) or ground robot (colour and depth).
        calibration_file: Camera calibration, in the form of EuRoC's `sensor.yaml`; not for ours.
        depth_units_per_m: Value of one metre in depth images; None for the layout's usual one.
        topics: Topics of a bag by role ("image", "depth", "info", "imu", "magnetic"), or "none";
            None to find all by their type.

    Raises:
        RecordingError: The layout is unknown, holds no such robot, or the recording is damaged.
        InputError: The layout has no use for an argument.
    """
    path = Path(path)
    if not path.exists():
        raise RecordingError(f"{path}: no such folder")
    kind = layout_of(path)
    _check_options(path, kind, calibration_file, depth_units_per_m, topics)
    match kind:
        case "airground":
            return RecordingFolder.open(path).of(robot)
        case "euroc" if robot == Source.MAV:
            return open_euroc(path, calibration_file)
        case "euroc":
            raise RecordingError(
                f"{path}: an EuRoC folder has no depth images; it can only be read as the MAV's"
            )
        case "tum":
            return open_tum(path, robot, calibration_file, depth_units_per_m)
        case "7scenes":
            return open_seven_scenes(path, robot, calibration_file, depth_units_per_m)
        case "ros":
            # Only who reads bags waits for their reader to load.
            from airground.io.ros.recording import open_bag

            return open_bag(path, robot, calibration_file, depth_units_per_m, topics)
    raise unknown_layout(path)


def unknown_layout(path: Path, also: str = "") -> RecordingError:
    """The error for a path of unknown layout, and what else it could `also` be."""
    if not path.is_dir():
        return RecordingError(f"{path}: is no recording; {EXPECTED}{also}")
    inner = next((folder for folder in sorted(path.iterdir()) if layout_of(folder)), None)
    hint = "" if inner is None else f"; {inner.name} in it is one ({layout_of(inner)})"
    return RecordingError(f"{path}: holds no recording; {EXPECTED}{also}{hint}")


def _check_options(
    path: Path,
    kind: Layout | None,
    calibration_file: Path | None,
    depth_units_per_m: float | None,
    topics: Mapping[str, str] | None,
) -> None:
    """InputError for an option that a layout has no use for: the recording is not at fault."""
    if kind == "airground" and calibration_file is not None:
        raise InputError(
            f"{calibration_file}: {path} has its own calibration in {layout.HEADER}; "
            "a file is only for folders of others"
        )
    if depth_units_per_m is not None and kind in ("airground", "euroc"):
        reason = "states its own depth scale" if kind == "airground" else "has no depth images"
        raise InputError(f"--depth-scale: {path} {reason}")
    if topics and kind != "ros":
        raise InputError(f"--topics: {path} is no ROS bag")
