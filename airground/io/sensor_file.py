"""`sensor.yaml` of plain EuRoC/ASL folders, and a camera's calibration handed in by a user."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import yaml

from airground.core.messages import ImuNoise
from airground.core.se3 import SE3
from airground.errors import RecordingError
from airground.io import calibration_ranges as ranges
from airground.io.calibration import MAX_SIDE_PX
from airground.io.euroc import read_lines
from airground.io.header import shortened
from airground.io.input_files import SETTINGS_LIMIT, read_toml_text
from airground.io.lens import COEFFICIENTS, MAX_READOUT_S, Lens, Model
from airground.io.plausibility import rigid

DISTORTION_MODELS: dict[str, Model] = {
    "radial-tangential": "radial-tangential",
    "radtan": "radial-tangential",
    "plumb_bob": "radial-tangential",
    "rational_polynomial": "radial-tangential",
    "equidistant": "equidistant",
    "fisheye": "equidistant",
}
"""Names of distortion models, as EuRoC, Kalibr, ROS and OpenCV write them."""
NO_DISTORTION = (None, "", "none")
"""How files say that images are free of distortion."""
SYNONYMS = {"distortion_coefficients": "distortion_coeffs"}
"""Keys of EuRoC's `sensor.yaml` that Kalibr writes otherwise."""
POSE = "T_BS"
NOISE_KEYS = tuple(
    f"{sensor}_{kind}"
    for sensor in ("gyroscope", "accelerometer")
    for kind in ("noise_density", "random_walk")
)
BIAS = "accelerometer_bias_sigma"
"""Key of an IMU for how large the accelerometer's bias may be [m/s^2]; not of EuRoC."""
DEPTH_UNITS, RATE = "depth_units_per_m", "rate_hz"
"""Keys of a calibration for the value of one metre of depth, and for folders without stamps."""
_RANGES = {
    **dict.fromkeys(NOISE_KEYS, (ranges.MIN_NOISE, ranges.MAX_NOISE)),
    BIAS: (ranges.MIN_BIAS_MPS2, ranges.MAX_BIAS_MPS2),
    DEPTH_UNITS: (ranges.MIN_UNITS_PER_M, ranges.MAX_UNITS_PER_M),
    RATE: (ranges.MIN_RATE_HZ, ranges.MAX_RATE_HZ),
}
READOUT = "readout_s"
"""Key of a camera that takes its rows one after the other."""


_OF_WRONG_VALUES = (ValueError, LookupError, AttributeError, TypeError, OverflowError)
"""What PyYAML raises where a tag and its value do not fit, as in `!!bool maybe`."""


class _PlainLoader(yaml.SafeLoader):  # type: ignore[misc]  # yaml has no types
    """Numbers, text, lists and tables; aliases, of which few can mean millions, are refused."""

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            mark = self.peek_event().start_mark
            raise yaml.YAMLError(f"aliases are not read (line {mark.line + 1})")
        return super().compose_node(parent, index)

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        try:
            return super().construct_object(node, deep)
        except _OF_WRONG_VALUES:
            kind = node.tag.rpartition(":")[2]
            raise yaml.YAMLError(
                f"{shortened(node.value)} is no {kind} (line {node.start_mark.line + 1})"
            ) from None


def read_mapping(path: Path) -> dict[str, Any]:
    """The keys and values of a YAML file, or of a TOML file by its suffix.

    EuRoC's first line, `%YAML:1.0`, is no YAML and is skipped. RecordingError if the file is
    missing, or is no table of keys and values."""
    try:
        if path.suffix == ".toml":
            return read_toml_text(path)
        lines = read_lines(path, SETTINGS_LIMIT)
        if lines and lines[0].startswith("%YAML"):
            lines[0] = ""
        values = _PlainLoader("\n".join(lines)).get_single_data()
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror}") from None
    except (yaml.YAMLError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise RecordingError(f"{path}: cannot be read: {reason}") from None
    except RecursionError:
        raise RecordingError(f"{path}: cannot be read: its brackets are nested too deep") from None
    if not isinstance(values, dict):
        raise RecordingError(f"{path}: expected 'key: value' lines, as in EuRoC's sensor.yaml")
    return values


def read_lens(path: Path) -> Lens:
    """Read `resolution`, `intrinsics`, `distortion_model`, `distortion_coefficients` and, where it
    is stated, `readout_s`. RecordingError names the file, the key and what would be right."""
    values = read_mapping(path)
    model = values.get("camera_model", "pinhole")
    if model != "pinhole":
        raise RecordingError(
            f"{path}: key 'camera_model': {shortened(model)} is unknown; known: pinhole (fisheye "
            "lenses: pinhole with the distortion_model equidistant)"
        )
    width, height = (round(v) for v in _numbers(values, "resolution", (2,), path))
    intrinsics = _numbers(values, "intrinsics", (4,), path)
    bent, coefficients = _distortion(values, path)
    lens = checked_lens(width, height, intrinsics, bent, coefficients, path)
    return replace(lens, readout_s=_readout(values, path))


def checked_lens(
    width: int,
    height: int,
    intrinsics: tuple[float, ...],
    model: str,
    coefficients: tuple[float, ...],
    path: Path,
) -> Lens:
    """A lens whose numbers can be right; RecordingError names `path`, the key and the rule."""
    fx, fy, cx, cy = intrinsics
    if fx > 0 > fy:
        raise RecordingError(
            f"{path}: key 'intrinsics': fy is negative ({fy:g}), as ICL-NUIM states it for a y "
            f"axis that points up; here y points down, for the same images: give {-fy:g}, and "
            "mirror published poses that do not fit then (docs/bring_your_own.md)"
        )
    if min(width, height) < 1 or min(fx, fy) <= 0:
        raise RecordingError(f"{path}: image size and focal lengths (fx, fy) must be positive")
    if min(fx, fy) < ranges.MIN_FOCAL_PX or max(fx, fy) > ranges.MAX_FOCAL_PX:
        raise RecordingError(
            f"{path}: key 'intrinsics': expected focal lengths from {ranges.MIN_FOCAL_PX:g} to "
            f"{ranges.MAX_FOCAL_PX:g} pixels, got {fx:g} and {fy:g}"
        )
    if max(width, height) > MAX_SIDE_PX:
        raise RecordingError(
            f"{path}: key 'resolution': {width}x{height} is more than {MAX_SIDE_PX} pixels a side"
        )
    if not (0 <= cx < width and 0 <= cy < height):
        raise RecordingError(
            f"{path}: key 'intrinsics': the principal point ({cx:g}, {cy:g}) lies outside the "
            f"{width}x{height} image; expected fx, fy, cx, cy in pixels"
        )
    if model not in DISTORTION_MODELS:
        raise RecordingError(
            f"{path}: key 'distortion_model': {shortened(model)} is unknown; known: "
            f"{', '.join(DISTORTION_MODELS)}, none"
        )
    kind = DISTORTION_MODELS[model]
    if len(coefficients) not in COEFFICIENTS[kind]:
        wanted = " or ".join(map(str, COEFFICIENTS[kind]))
        raise RecordingError(
            f"{path}: key 'distortion_coefficients': expected {wanted} numbers for "
            f"{model}, got {len(coefficients)}"
        )
    lens = Lens(width, height, (fx, fy, cx, cy), coefficients, kind)
    if lens.folds():
        raise RecordingError(
            f"{path}: key 'distortion_coefficients': with {list(coefficients)} the image folds "
            f"back within its {width}x{height} pixels; are model and order of the numbers right?"
        )
    return lens


def _readout(values: dict[str, Any], path: Path) -> float:
    if READOUT not in values:
        return 0.0
    seconds = _positive(values[READOUT], READOUT, path)
    if seconds > MAX_READOUT_S:
        raise RecordingError(
            f"{path}: key '{READOUT}': {seconds:g} s is longer than {MAX_READOUT_S:g} s; expected "
            "seconds from the first to the last row of an image"
        )
    return seconds


def read_positive(path: Path, key: str) -> float | None:
    """A positive number; None where the file has no such key. Raises like `read_lens`."""
    values = read_mapping(path)
    return _in_range(values[key], key, path) if key in values else None


def read_pose(path: Path) -> SE3:
    """Read `T_BS`, the sensor in the body; raises like `read_lens`."""
    pose = _value(read_mapping(path), POSE, path)
    data = _as_numbers(pose.get("data") if isinstance(pose, dict) else None)
    if data is None:
        raise RecordingError(f"{path}: key 'T_BS': expected 'data' with 16 numbers, row by row")
    return rigid(data, path, "T_BS")


def read_imu_noise(path: Path) -> ImuNoise:
    """Read an IMU's noise densities and random walks, and how large its accelerometer's bias may
    be, where that is stated; raises like `read_lens`."""
    values = read_mapping(path)
    noise = (_in_range(_value(values, key, path), key, path) for key in NOISE_KEYS)
    return replace(ImuNoise(*noise), stated_bias_sigma=read_positive(path, BIAS))


def _positive(value: object, key: str, path: Path) -> float:
    number = _as_numbers([value])
    if number is None or number[0] <= 0:
        raise RecordingError(
            f"{path}: key '{key}': expected a positive number, got {shortened(value)}"
        )
    return number[0]


def _in_range(value: object, key: str, path: Path) -> float:
    number = _positive(value, key, path)
    low, high = _RANGES[key]
    if not low <= number <= high:
        raise RecordingError(
            f"{path}: key '{key}': expected a number from {low:g} to {high:g}, got {number:g}"
        )
    return number


def _distortion(values: dict[str, Any], path: Path) -> tuple[str, tuple[float, ...]]:
    model = _value(values, "distortion_model", path)
    if model in NO_DISTORTION:
        return "radial-tangential", (0.0,) * 4
    # How many there must be depends on the model, which is checked with them.
    return str(model), _numbers(values, "distortion_coefficients", None, path)


def _value(values: dict[str, Any], key: str, path: Path) -> Any:
    for name in (key, SYNONYMS.get(key)):
        if name in values:
            return values[name]
    raise RecordingError(f"{path}: key '{key}' is missing")


def _numbers(
    values: dict[str, Any], key: str, counts: tuple[int, ...] | None, path: Path
) -> tuple[float, ...]:
    """Finite numbers, as many as one of `counts` says; None for any number of them."""
    value = _value(values, key, path)
    numbers = _as_numbers(value)
    if numbers is None or (counts and len(numbers) not in counts):
        wanted = " or ".join(map(str, counts or ())) or "a list of"
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
    except (TypeError, ValueError, OverflowError):
        return None
    return numbers if all(map(math.isfinite, numbers)) else None
