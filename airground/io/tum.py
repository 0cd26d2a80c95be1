"""TUM text files: trajectories, image lists, associations, accelerometer samples.

Times are in seconds with nine decimals; they are read and written without rounding."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from airground.core.arrays import I64
from airground.core.messages import ImuSamples
from airground.core.se3 import FARTHEST_M, SE3
from airground.core.trajectory import Trajectory
from airground.errors import RecordingError
from airground.io.euroc import check_stamps, read_lines

SECOND_NS = 1_000_000_000
LAST_SECOND = 9_000_000_000
"""No clock shows more seconds than this; more nanoseconds would not fit 64 bits."""


def format_stamp(stamp_ns: int) -> str:
    """`stamp_ns` >= 0 in seconds with nine decimals."""
    return f"{stamp_ns // SECOND_NS}.{stamp_ns % SECOND_NS:09d}"


def parse_stamp(text: str) -> int:
    """Nanoseconds from seconds such as '12', '12.5' or '1305031102.175304'; exact.
    ValueError if the text is no plain decimal number with up to nine decimals, or too large."""
    whole, _, decimals = text.partition(".")
    if not whole.isdecimal() or len(decimals) > 9 or (decimals and not decimals.isdecimal()):
        raise ValueError(f"'{text}' is no time in seconds with at most nine decimals")
    if int(whole) > LAST_SECOND:
        digits = len(whole)
        unit = "milli" if digits < 15 else "micro" if digits < 18 else "nano"
        raise ValueError(f"the time '{text}' looks like {unit}seconds; expected seconds")
    return int(whole) * SECOND_NS + int(decimals.ljust(9, "0"))


def read_tum(path: Path | str) -> Trajectory:
    """Read poses `timestamp tx ty tz qx qy qz qw`; RecordingError names file and line."""
    path = Path(path)
    stamps: list[int] = []
    poses: list[SE3] = []
    for number, line in _entries(path):
        fields = line.split()
        if len(fields) != 8:
            raise RecordingError(
                f"{path}:{number}: expected 'timestamp tx ty tz qx qy qz qw', "
                f"got {len(fields)} fields"
            )
        stamp, pose = parse_pose(fields, f"{path}:{number}")
        if stamps and stamp <= stamps[-1]:
            raise RecordingError(
                f"{path}:{number}: time {fields[0]} s does not follow "
                f"{format_stamp(stamps[-1])} s; times must strictly increase"
            )
        stamps.append(stamp)
        poses.append(pose)
    if not stamps:
        raise RecordingError(f"{path}: holds no pose")
    return Trajectory.from_poses(stamps, poses)


def parse_pose(fields: Sequence[str], where: str) -> tuple[int, SE3]:
    """Stamp [ns] and pose from `timestamp tx ty tz qx qy qz qw`; RecordingError names `where`."""
    try:
        stamp = parse_stamp(fields[0])
        values = np.array([float(field) for field in fields[1:]])
    except ValueError as error:
        raise RecordingError(f"{where}: {error}") from None
    if not (np.abs(values) < FARTHEST_M).all():
        raise RecordingError(
            f"{where}: the pose at {fields[0]} s is not finite, or beyond {FARTHEST_M:g} m"
        )
    if abs(math.hypot(*values[3:]) - 1) > 1e-2:
        raise RecordingError(f"{where}: the quaternion (qx qy qz qw) must have length 1")
    return stamp, SE3.from_quaternion_xyzw(values[3:], values[:3])


def write_tum(path: Path | str, trajectory: Trajectory) -> None:
    """Write poses as `timestamp tx ty tz qx qy qz qw`."""
    rows = np.hstack([trajectory.translations, trajectory.quaternions_xyzw()]).tolist()
    lines = [
        f"{format_stamp(stamp)} " + " ".join(f"{value:.9f}" for value in row)
        for stamp, row in zip(trajectory.stamps_ns.tolist(), rows, strict=True)
    ]
    text = "\n".join(["# timestamp tx ty tz qx qy qz qw", *lines])
    Path(path).write_text(text + "\n", encoding="utf-8")


def read_associations(path: Path) -> tuple[I64, list[str], list[str]]:
    """Colour stamps (N,) [ns], colour files and depth files, relative to the list's folder.
    Where the first file of every line, by its path, is a depth image, it is read as such."""
    stamps, rows = _read_stamped(path, "time colour-file time depth-file")
    first, second = [row[1] for row in rows], [row[3] for row in rows]
    if not all("depth" in a and "depth" not in b for a, b in zip(first, second, strict=True)):
        return stamps, first, second
    try:
        colour_stamps = np.array([parse_stamp(row[2]) for row in rows], np.int64)
    except ValueError as error:
        raise RecordingError(f"{path}: {error}") from None
    check_stamps(colour_stamps, path)
    return colour_stamps, second, first


def read_image_list(path: Path) -> tuple[I64, list[str]]:
    """Stamps (N,) [ns] and file names, relative to the list's folder, as in `rgb.txt`."""
    stamps, rows = _read_stamped(path, "timestamp filename")
    return stamps, [row[1] for row in rows]


def write_image_lists(folder: Path, stamps_ns: I64, names: list[str]) -> None:
    """Write `rgb.txt`, `depth.txt` and `associations.txt` for images of the same names."""
    entries = list(zip([format_stamp(int(t)) for t in stamps_ns], names, strict=True))
    for kind in ("rgb", "depth"):
        lines = [f"# timestamp filename ({kind})", *(f"{t} {kind}/{n}" for t, n in entries)]
        (folder / f"{kind}.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    lines = [f"{t} rgb/{n} {t} depth/{n}" for t, n in entries]
    (folder / "associations.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_accelerometer(path: Path, samples: ImuSamples) -> None:
    """Write `timestamp ax ay az` [m/s^2]."""
    rows = zip(samples.stamps_ns.tolist(), samples.accelerometer.tolist(), strict=True)
    lines = [f"{format_stamp(t)} {x:.6f} {y:.6f} {z:.6f}" for t, (x, y, z) in rows]
    path.write_text("\n".join(["# timestamp ax ay az", *lines]) + "\n", encoding="utf-8")


def _read_stamped(path: Path, columns: str) -> tuple[I64, list[list[str]]]:
    """Stamps (N,) [ns] and the fields of each line, as many as `columns` names.
    RecordingError names the file and the line or stamp that is wrong."""
    stamps, rows = [], []
    for number, line in _entries(path):
        fields = line.split()
        if len(fields) != len(columns.split()):
            raise RecordingError(f"{path}:{number}: expected '{columns}', got '{line[:60]}'")
        try:
            stamps.append(parse_stamp(fields[0]))
        except ValueError as error:
            raise RecordingError(f"{path}:{number}: {error}") from None
        rows.append(fields)
    array = np.array(stamps, np.int64)
    check_stamps(array, path)
    return array, rows


def _entries(path: Path) -> list[tuple[int, str]]:
    """Lines that are neither empty nor comments, with their numbers from 1."""
    numbered = enumerate((line.strip() for line in read_lines(path)), start=1)
    return [(number, line) for number, line in numbered if line and not line.startswith("#")]
