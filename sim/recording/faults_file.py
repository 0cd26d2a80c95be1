"""`faults.csv` of a recording's truth: which sensors failed, from when to when."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from airground.errors import RecordingError
from airground.io.input_files import TEXT_LIMIT, read_text
from sim.robots.motion import ROBOTS, Robot
from sim.sensors.faults import Fault
from sim.sensors.robot_clock import RobotClock

FILE = "faults.csv"
_COLUMNS = ["kind", "robot", "start [s]", "end [s]", "size"]
_LATEST_S = 1e9
"""Largest time and step that is read [s]: nanoseconds then fit 64 bits."""


def write_faults(folder: Path, faults: Sequence[Fault]) -> None:
    """Write the faults, with their starts, into the truth; nothing if there are none."""
    if not faults:
        return
    with (folder / FILE).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(_COLUMNS)
        for fault in faults:
            times = (fault.start_ns * 1e-9, fault.end_ns * 1e-9, fault.strength)
            writer.writerow([fault.kind, fault.robot, *(f"{value:.9f}" for value in times)])


def read_clocks(folder: Path) -> dict[Robot, RobotClock]:
    """Both robots' clocks, with the steps that the faults list; RecordingError if it is damaged."""
    path = folder / FILE
    steps: dict[Robot, list[tuple[int, int]]] = {robot: [] for robot in ROBOTS}
    if path.exists():
        rows = list(csv.reader(_text(path).splitlines()))
        if not rows or rows[0] != _COLUMNS:
            raise RecordingError(f"{path}:1: must be the columns {','.join(_COLUMNS)}")
        for line, row in enumerate(rows[1:], start=2):
            if row[:1] == ["clock"]:
                robot, step = _step(row, f"{path}:{line}")
                steps[robot].append(step)
    return {robot: RobotClock.stepping(steps[robot]) for robot in ROBOTS}


def _text(path: Path) -> str:
    try:
        return read_text(path, TEXT_LIMIT)
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise RecordingError(f"{path}: cannot be read: {reason}") from None


def _step(row: list[str], where: str) -> tuple[Robot, tuple[int, int]]:
    """Robot, time and size [ns] of a step."""
    try:
        _, name, start, _, size = row
        (robot,) = (one for one in ROBOTS if one == name)
        values = np.array([float(start), float(size)])
        if not ((values >= 0) & (values <= _LATEST_S)).all():
            raise ValueError
    except ValueError:
        raise RecordingError(
            f"{where}: must be clock, mav or ground, and three numbers that are at least 0"
        ) from None
    start_ns, size_ns = np.rint(values * 1e9).astype(np.int64).tolist()
    return robot, (start_ns, size_ns)
