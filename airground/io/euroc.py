"""EuRoC/ASL tables: inertial and magnetic samples, and the list of a camera's images."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from airground.core.arrays import F64, I64
from airground.core.messages import ImuSamples, MagneticSamples
from airground.core.se3 import SE3
from airground.errors import RecordingError
from airground.io.calibration import CameraTable
from airground.io.input_files import TEXT_LIMIT, read_text
from airground.io.plausibility import check_field

IMU_COLUMNS = (
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
    "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]"
)
MAGNETIC_COLUMNS = "#timestamp [ns],B_S_x [T],B_S_y [T],B_S_z [T]"
CAMERA_COLUMNS = "#timestamp [ns],filename"


def read_imu(path: Path) -> ImuSamples:
    """Read gyro [rad/s] and accelerometer [m/s^2] samples; RecordingError where one is wrong."""
    stamps, values = _read_samples(path, 6)
    return ImuSamples(stamps, values[:, :3], values[:, 3:])


def write_imu(path: Path, samples: ImuSamples) -> None:
    values = np.hstack([samples.gyro, samples.accelerometer])
    _write_samples(path, IMU_COLUMNS, samples.stamps_ns, values)


def read_magnetic(path: Path) -> MagneticSamples:
    """Read magnetic field samples [T]; raises like `read_imu`."""
    stamps, values = _read_samples(path, 3)
    samples = MagneticSamples(stamps, values)
    check_field(samples, path)
    return samples


def write_magnetic(path: Path, samples: MagneticSamples) -> None:
    _write_samples(path, MAGNETIC_COLUMNS, samples.stamps_ns, samples.field)


def read_image_list(path: Path) -> tuple[I64, list[str]]:
    """Stamps (N,) [ns] and file names of a camera's images; RecordingError where one is wrong."""
    stamps, names = [], []
    for number, line in enumerate(read_lines(path), start=1):
        if not line or line.startswith("#"):
            continue
        _check_whole_stamp(line, number, path)
        try:
            stamp, name = line.split(",")
            stamps.append(np.int64(int(stamp)))
        except (ValueError, OverflowError):
            raise RecordingError(
                f"{path}:{number}: expected 'timestamp [ns],filename', got '{line[:60]}'"
            ) from None
        names.append(name.strip())
    array = np.array(stamps, np.int64)
    check_stamps(array, path)
    return array, names


def write_image_list(path: Path, stamps_ns: I64, names: list[str]) -> None:
    lines = [f"{stamp},{name}" for stamp, name in zip(stamps_ns, names, strict=True)]
    path.write_text("\n".join([CAMERA_COLUMNS, *lines]) + "\n", encoding="utf-8")


def camera_yaml(camera: CameraTable, T_body_camera: SE3) -> str:
    """`sensor.yaml` of a camera for tools of the field; the body of EuRoC is the IMU here."""
    model = camera.distortion_model or "radial-tangential"
    numbers = ", ".join(map(repr, camera.distortion_coefficients or (0.0,) * 4))
    shutter = f"readout_s: {camera.readout_s!r}\n" if camera.readout_s else ""
    return (
        f"sensor_type: camera\ncomment: pinhole\n{_pose_yaml(T_body_camera)}"
        f"rate_hz: {camera.rate_hz}\nresolution: [{camera.width}, {camera.height}]\n"
        f"camera_model: pinhole\n"
        f"intrinsics: [{camera.fx!r}, {camera.fy!r}, {camera.cx!r}, {camera.cy!r}]\n"
        f"distortion_model: {model}\ndistortion_coefficients: [{numbers}]\n{shutter}"
    )


def sensor_yaml(kind: str, T_body_sensor: SE3, numbers: dict[str, float]) -> str:
    """`sensor.yaml` of an IMU or a magnetometer."""
    lines = "".join(f"{name}: {value!r}\n" for name, value in numbers.items())
    return f"sensor_type: {kind}\ncomment: simulated\n{_pose_yaml(T_body_sensor)}{lines}"


def _pose_yaml(pose: SE3) -> str:
    numbers = ", ".join(repr(float(v)) for v in pose.matrix().ravel())
    return f"T_BS:\n  cols: 4\n  rows: 4\n  data: [{numbers}]\n"


def _read_samples(path: Path, columns: int) -> tuple[I64, F64]:
    """(N,) stamps and (N, columns) values, all finite, in strict order of time."""
    lines = read_lines(path)
    numbered = enumerate((line.strip() for line in lines), start=1)
    first = next(((k, line) for k, line in numbered if line and line[0] != "#"), None)
    if first is None:
        raise RecordingError(f"{path}: holds no entry")
    _check_whole_stamp(first[1], first[0], path)
    dtype = np.dtype([("stamp", np.int64), ("values", np.float64, (columns,))])
    try:
        table = np.loadtxt(lines, dtype=dtype, delimiter=",", comments="#", ndmin=1)
    except (ValueError, OverflowError) as error:
        raise RecordingError(
            f"{path}: expected 'timestamp [ns]' and {columns} numbers a line: {error}"
        ) from None
    stamps, values = table["stamp"], table["values"]
    check_stamps(stamps, path)
    bad = ~np.isfinite(values).all(axis=1)
    if bad.any():
        stamp = stamps[np.argmax(bad)]
        raise RecordingError(f"{path}: the sample at stamp {stamp} is not finite")
    return np.ascontiguousarray(stamps), np.ascontiguousarray(values)


def _check_whole_stamp(line: str, number: int, path: Path) -> None:
    """RecordingError if the line's stamp has decimals: it would be in seconds."""
    stamp = line.partition(",")[0].strip()
    if stamp.replace(".", "", 1).isdecimal() and not stamp.isdecimal():
        raise RecordingError(
            f"{path}:{number}: the stamp '{stamp}' has decimals, it looks like seconds; "
            "expected whole nanoseconds"
        )


def _write_samples(path: Path, columns: str, stamps: I64, values: F64) -> None:
    rows = zip(stamps.tolist(), values.tolist(), strict=True)
    lines = [f"{stamp}," + ",".join(map(repr, row)) for stamp, row in rows]
    path.write_text("\n".join([columns, *lines]) + "\n", encoding="utf-8")


def read_lines(path: Path, limit: int = TEXT_LIMIT) -> list[str]:
    """The lines of a text file of at most `limit` bytes; RecordingError where it cannot be read."""
    try:
        return read_text(path, limit).splitlines()
    except FileNotFoundError:
        raise RecordingError(f"{path}: this file is missing from the recording") from None
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise RecordingError(f"{path}: cannot be read as text: {reason}") from None


def check_stamps(stamps: I64, path: Path) -> None:
    """RecordingError unless there is a stamp and all strictly increase."""
    if len(stamps) == 0:
        raise RecordingError(f"{path}: holds no entry")
    back = stamps[1:] <= stamps[:-1]  # a difference could overflow
    if back.any():
        after = int(np.argmax(back)) + 1
        before = stamps[after - 1]
        problem = "is there twice" if stamps[after] == before else f"follows {before}"
        raise RecordingError(
            f"{path}: stamp {stamps[after]} (entry {after + 1}) {problem}; "
            "stamps must strictly increase"
        )
