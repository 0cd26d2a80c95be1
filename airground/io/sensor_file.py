"""`sensor.yaml` of plain EuRoC/ASL folders, and a camera's calibration handed in by a user."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import yaml

from airground.core.messages import ImuNoise
from airground.core.se3 import SE3
from airground.errors import RecordingError
from airground.io.calibration import MAX_SIDE_PX
from airground.io.euroc import read_lines
from airground.io.header import shortened
from airground.io.lens import Lens
from airground.io.plausibility import rigid

DISTORTION_MODELS = ("radial-tangential", "radtan")
"""Names of the one distortion model that is known, as EuRoC and Kalibr write it."""


class _PlainLoader(yaml.SafeLoader):  # type: ignore[misc]  # yaml has no types
    """Numbers, text, lists and tables; aliases, of which few can mean millions, are refused."""

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            mark = self.peek_event().start_mark
            raise yaml.YAMLError(f"aliases are not read (line {mark.line + 1})")
        return super().compose_node(parent, index)


def read_mapping(path: Path) -> dict[str, Any]:
    """The keys and values of a YAML file, or of a TOML file by its suffix.

    EuRoC's first line, `%YAML:1.0`, is no YAML and is skipped. RecordingError if the file is
    missing, or is no table of keys and values."""
    lines = read_lines(path)
    try:
        if path.suffix == ".toml":
            return tomllib.loads("\n".join(lines))
        if lines and lines[0].startswith("%YAML"):
            lines[0] = ""
        values = _PlainLoader("\n".join(lines)).get_single_data()
    except (yaml.YAMLError, tomllib.TOMLDecodeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise RecordingError(f"{path}: cannot be read: {reason}") from None
    except RecursionError:
        raise RecordingError(f"{path}: cannot be read: its brackets are nested too deep") from None
    if not isinstance(values, dict):
        raise RecordingError(f"{path}: expected 'key: value' lines, as in EuRoC's sensor.yaml")
    return values


def read_lens(path: Path) -> Lens:
    """Read `resolution`, `intrinsics`, `distortion_model` and `distortion_coefficients`.
    RecordingError names the file, the key and what would be right."""
    values = read_mapping(path)
    model = values.get("camera_model", "pinhole")
    if model != "pinhole":
        raise RecordingError(
            f"{path}: key 'camera_model': {shortened(model)} is unknown; known: pinhole"
        )
    width, height = (round(v) for v in _numbers(values, "resolution", (2,), path))
    fx, fy, cx, cy = _numbers(values, "intrinsics", (4,), path)
    coefficients = _distortion(values, path)
    if min(width, height) < 1 or min(fx, fy) <= 0:
        raise RecordingError(f"{path}: image size and focal lengths (fx, fy) must be positive")
    if max(width, height) > MAX_SIDE_PX:
        raise RecordingError(
            f"{path}: key 'resolution': {width}x{height} is more than {MAX_SIDE_PX} pixels a side"
        )
    if not (0 <= cx < width and 0 <= cy < height):
        raise RecordingError(
            f"{path}: key 'intrinsics': the principal point ({cx:g}, {cy:g}) lies outside the "
            f"{width}x{height} image; expected fx, fy, cx, cy in pixels"
        )
    return Lens(width, height, (fx, fy, cx, cy), coefficients)


def read_pose(path: Path) -> SE3:
    """Read `T_BS`, the sensor in the body; raises like `read_lens`."""
    pose = _value(read_mapping(path), "T_BS", path)
    data = _as_numbers(pose.get("data") if isinstance(pose, dict) else None)
    if data is None:
        raise RecordingError(f"{path}: key 'T_BS': expected 'data' with 16 numbers, row by row")
    return rigid(data, path, "T_BS")


def read_imu_noise(path: Path) -> ImuNoise:
    """Read an IMU's noise densities and random walks; raises like `read_lens`."""
    values = read_mapping(path)
    names = ("gyroscope", "accelerometer")
    keys = [f"{name}_{kind}" for name in names for kind in ("noise_density", "random_walk")]
    numbers = []
    for key in keys:
        value = _value(values, key, path)
        number = _as_numbers([value])
        if number is None or number[0] <= 0:
            raise RecordingError(
                f"{path}: key '{key}': expected a positive number, got {shortened(value)}"
            )
        numbers.append(number[0])
    return ImuNoise(*numbers)


def _distortion(values: dict[str, Any], path: Path) -> tuple[float, ...]:
    model = _value(values, "distortion_model", path)
    if model not in DISTORTION_MODELS:
        raise RecordingError(
            f"{path}: key 'distortion_model': {shortened(model)} is unknown; known: "
            f"{', '.join(DISTORTION_MODELS)} (coefficients k1, k2, p1, p2 and perhaps k3)"
        )
    return _numbers(values, "distortion_coefficients", (4, 5), path)


def _value(values: dict[str, Any], key: str, path: Path) -> Any:
    if key not in values:
        raise RecordingError(f"{path}: key '{key}' is missing")
    return values[key]


def _numbers(
    values: dict[str, Any], key: str, counts: tuple[int, ...], path: Path
) -> tuple[float, ...]:
    value = _value(values, key, path)
    numbers = _as_numbers(value)
    if numbers is None or len(numbers) not in counts:
        wanted = " or ".join(map(str, counts))
        raise RecordingError(
            f"{path}: key '{key}': expected {wanted} numbers, got {shortened(value)}"
        )
    return numbers


def _as_numbers(values: object) -> tuple[float, ...] | None:
    """Finite numbers, or None. YAML 1.1 takes `1e-3`, without a point, for text."""
    if not isinstance(values, list) or any(isinstance(value, bool) for value in values):
        return None
    try:
        numbers = tuple(float(value) for value in values)
    except (TypeError, ValueError):
        return None
    return numbers if all(map(math.isfinite, numbers)) else None
