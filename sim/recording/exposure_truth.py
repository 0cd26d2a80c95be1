"""`truth/exposure.csv`: exposure time and gain of every image, where exposure is automatic."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from airground.errors import RecordingError
from airground.io.input_files import TEXT_LIMIT, read_text
from airground.io.layout import TRUTH
from sim.robots.motion import ROBOTS, Robot
from sim.sensors.auto_exposure import Exposure

_COLUMNS = ["robot", "stamp [ns]", "exposure [s]", "gain"]


@dataclass(frozen=True, eq=False)
class TrueExposure:
    """The exposures of one robot's images.

    Attributes:
        stamps_ns: (N,) stamps of the images [ns].
        exposure_s: (N,) exposure times [s].
        gain: (N,) gains.
    """

    stamps_ns: NDArray[np.int64]
    exposure_s: NDArray[np.float64]
    gain: NDArray[np.float64]


def write_exposure(recording: Path, images: Mapping[Robot, Sequence[tuple[int, Exposure]]]) -> None:
    """Write the table into the truth of a recording, from stamps [ns] and exposures."""
    rows = [
        [robot, stamp_ns, f"{exposure.exposure_s:.9f}", f"{exposure.gain:.6f}"]
        for robot in ROBOTS
        for stamp_ns, exposure in images.get(robot, ())
    ]
    with _file(recording).open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([_COLUMNS, *rows])


def read_exposure(recording: Path) -> dict[Robot, TrueExposure] | None:
    """Read what `write_exposure` wrote; None if exposure was fixed.

    Raises:
        RecordingError: The table is damaged.
    """
    path = _file(recording)
    if not path.exists():
        return None
    rows = list(csv.reader(read_text(path, TEXT_LIMIT).splitlines()))
    if not rows or rows[0] != _COLUMNS:
        raise RecordingError(f"{path}:1: must be the columns {','.join(_COLUMNS)}")
    images: dict[Robot, list[tuple[int, float, float]]] = {robot: [] for robot in ROBOTS}
    for line, row in enumerate(rows[1:], start=2):
        robot, image = _image(row, f"{path}:{line}")
        images[robot].append(image)
    return {robot: _true_exposure(images[robot]) for robot in ROBOTS}


def _image(row: list[str], where: str) -> tuple[Robot, tuple[int, float, float]]:
    try:
        name, stamp, exposure, gain = row
        robot = next(known for known in ROBOTS if known == name)
        values = int(stamp), float(exposure), float(gain)
        if not (0 < values[1] < np.inf and 1 <= values[2] < np.inf):
            raise ValueError
    except (ValueError, StopIteration):
        raise RecordingError(
            f"{where}: must be mav or ground, a stamp [ns], an exposure above 0 s, and a gain of "
            "at least 1"
        ) from None
    return robot, values


def _true_exposure(images: Sequence[tuple[int, float, float]]) -> TrueExposure:
    stamps, exposures, gains = zip(*images, strict=True) if images else ((), (), ())
    return TrueExposure(np.array(stamps, np.int64), np.array(exposures), np.array(gains))


def _file(recording: Path) -> Path:
    return recording / TRUTH / "exposure.csv"
