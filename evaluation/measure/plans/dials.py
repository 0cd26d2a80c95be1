"""What a sweep can turn: scenes and sensors by the table below, the pipeline by its parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from airground.config import Config
from airground.errors import InputError
from evaluation.setup.settings import with_value
from sim.appearance.other_light import later_light, light_between
from sim.scene import MAX_HEAP_HEIGHT_M, Light, Scene
from sim.sensors.faults import FaultKind
from sim.sensors.presets import SensorPreset
from sim.sensors.turned import (
    with_auto_exposure,
    with_clock_step,
    with_depth_camera,
    with_distortion,
    with_fault,
    with_fisheye,
    with_gamma,
    with_heading_error,
    with_noise,
    with_rate,
    with_readout,
)

Value = float | int | str | bool | list[Any]
Point = Mapping[str, Value]
"""Dials by name, and where each stands."""


@dataclass(frozen=True)
class Subject:
    """All that dials act on."""

    scene: Scene
    sensors: SensorPreset
    config: Config


@dataclass(frozen=True)
class Dial:
    """A number that a sweep can vary, by its name in `--vary`.

    Attributes:
        unit: Unit of its values; empty for a share or a factor.
        low, high: Range of its values.
        does: Its effect, in words.
        turn: Function that sets the dial to a value in a subject.
    """

    name: str
    unit: str
    low: float
    high: float
    does: str
    turn: Callable[[Subject, float], Subject]


def _failing(name: str, kind: FaultKind, does: str) -> Dial:
    """A dial for how long a sensor fails."""
    return Dial(
        f"sensors.{name}",
        "s",
        0.0,
        5.0,
        f"time for which {does}, once, at a time drawn by the seed",
        lambda subject, value: replace(subject, sensors=with_fault(subject.sensors, kind, value)),
    )


LOWEST_FLIGHT_M = round(MAX_HEAP_HEIGHT_M + 0.1, 3)  # the sum of the two floats is above 1.2

DIALS = (
    Dial(
        "scene.overlap", "", 0.05, 1.0,
        "median share of what the MAV flies over that the ground robot has seen before: the robot "
        "stops when it has; the heap and the flight stay the same",
        lambda subject, value: _part(subject, "ground", stop_at_overlap=value),
    ),
    Dial(
        "scene.self_similarity", "", 0.0, 1.0,
        "share of the boxes that are of one make",
        lambda subject, value: _part(subject, "rubble", self_similarity=value),
    ),
    Dial(
        "scene.changed", "", 0.0, 0.5,
        "share of the boxes that have moved, fallen or gone when the MAV sees them",
        lambda subject, value: _part(subject, "rubble", changed=value),
    ),
    Dial(
        "scene.light", "", 0.0, 1.0,
        "how far the light that the MAV sees is from that of the ground robot: 1 is "
        "[flight_light], or else a low, warm sun from another side",
        lambda subject, value: _scene(subject, flight_light=_flight_light(subject.scene, value)),
    ),
    Dial(
        "scene.lamp", "", 0.0, 10.0,
        "lamp at the ground robot's camera: its irradiance of what faces it at 1 m",
        lambda subject, value: _part(subject, "ground", lamp=value),
    ),
    Dial(
        "scene.heap_height", "", 0.1, 1.5,
        "all boxes so many times as large, and so the heap about so much higher",
        lambda subject, value: _part(subject, "rubble", size_scale=value),
    ),
    Dial(
        "scene.flight_height", "m", LOWEST_FLIGHT_M, 10.0,
        "height of the MAV's flight above the ground",
        lambda subject, value: _part(subject, "mav", height_m=value),
    ),
    Dial(
        "scene.camera_height", "m", 0.15, 2.0,
        "height of the ground robot's camera above the ground",
        lambda subject, value: _part(subject, "ground", camera_height_m=value),
    ),
    Dial(
        "scene.texture", "", 0.0, 1.0,
        "contrast of what is printed and painted on all surfaces; the light stays",
        lambda subject, value: _scene(subject, texture=value),
    ),
    Dial(
        "scene.printed", "", 0.0, 1.0,
        "share of the boxes with print, labels and stickers; the others are plain board",
        lambda subject, value: _part(subject, "rubble", printed=value),
    ),
    Dial(
        "scene.plants", "1/m²", 0.0, 60.0,
        "low plants per square metre of natural ground",
        lambda subject, value: _part(subject, "terrain", plants_per_m2=value),
    ),
    Dial(
        "scene.stones", "1/m²", 0.0, 400.0,
        "small stones per square metre of natural ground",
        lambda subject, value: _part(subject, "terrain", stones_per_m2=value),
    ),
    Dial(
        "scene.clods", "m", 0.0, 0.1,
        "height of clods on natural ground",
        lambda subject, value: _part(subject, "terrain", clods_m=value),
    ),
    Dial(
        "scene.rock_roughness", "m", 0.0, 0.03,
        "standard deviation of steps and hollows on rocks",
        lambda subject, value: _part(subject, "terrain", rock_roughness_m=value),
    ),
    Dial(
        "sensors.noise", "", 0.0, 10.0,
        "factor of the noise of images, depth and inertial sensors",
        lambda subject, value: replace(subject, sensors=with_noise(subject.sensors, value)),
    ),
    Dial(
        "sensors.readout_ms", "ms", 0.0, 30.0,
        "time from the first to the last row of both cameras' images; 0 is a global shutter",
        lambda subject, value: replace(subject, sensors=with_readout(subject.sensors, value / 1e3)),
    ),
    Dial(
        "sensors.distortion", "", 0.0, 1.5,
        "factor of the measured radial-tangential distortion of both cameras' lenses",
        lambda subject, value: replace(subject, sensors=with_distortion(subject.sensors, value)),
    ),
    Dial(
        "sensors.depth_baseline_mm", "mm", 0.0, 100.0,
        "distance of the Kinect's depth camera from its colour camera; 0 is depth measured in the "
        "colour camera's own pixels",
        lambda subject, value: _depth_camera(subject, depth_baseline_m=value / 1e3),
    ),
    Dial(
        "sensors.depth_registered", "", 0.0, 1.0,
        "1 if the Kinect's driver moves depth to the colour camera's pixels, 0 if depth is stored "
        "as the depth camera measures it",
        lambda subject, value: _depth_camera(subject, depth_registered=value >= 0.5),
    ),
    Dial(
        "sensors.auto_exposure", "", 0.0, 1.0,
        "automatic exposure of both cameras: share of the corrections of exposure and gain, in "
        "stops, that `real` makes, with its delay and overshoot; 0 is a fixed exposure",
        lambda subject, value: replace(
            subject, sensors=with_auto_exposure(subject.sensors, value)
        ),
    ),
    Dial(
        "sensors.gamma", "", 0.4, 2.5,
        "gamma of both cameras' response, beside the 2.2 of pictures; 1 shows light as it is, more "
        "brightens what is dark",
        lambda subject, value: replace(subject, sensors=with_gamma(subject.sensors, value)),
    ),
    Dial(
        "sensors.camera_hz", "Hz", 5.0, 30.0,
        "rate of both cameras' images: 30, or that divided by a whole number",
        lambda subject, value: replace(subject, sensors=with_rate(subject.sensors, value)),
    ),
    _failing("dropped_s", "dropped", "each robot's camera drops its images"),
    _failing("black_s", "black", "each robot's camera gives black images"),
    _failing("frozen_s", "frozen", "each robot's camera repeats its last image with new stamps"),
    _failing("repeated_s", "repeated", "each robot's camera gives every second image twice"),
    _failing("overexposed_s", "exposure", "light is four times as bright for each robot's camera"),
    _failing("depth_gone_s", "depth_gone", "the ground robot's depth images have no depth"),
    _failing("imu_gap_s", "imu_gap", "each robot's IMU misses its samples"),
    _failing("imu_saturated_s", "imu_saturated", "each robot's IMU reads full scale on all axes"),
    _failing("imu_silent_s", "imu_silent", "each robot's IMU reads zero on all axes"),
    Dial(
        "sensors.clock_step_s", "s", 0.0, 5.0,
        "time by which all later stamps of the MAV jump ahead, once, at a time drawn by the seed",
        lambda subject, value: replace(subject, sensors=with_clock_step(subject.sensors, value)),
    ),
    Dial(
        "sensors.fisheye", "", 0.0, 1.5,
        "fisheyes of 150° on both cameras, with this factor of a measured distortion; 0 is an "
        "ideal equidistant lens",
        lambda subject, value: replace(subject, sensors=with_fisheye(subject.sensors, value)),
    ),
    Dial(
        "sensors.heading_error_deg", "deg", 0.0, 45.0,
        "standard deviation of each robot's magnetic heading, which replaces the preset's",
        lambda subject, value: replace(subject, sensors=with_heading_error(subject.sensors, value)),
    ),
)  # fmt: skip
"""Those that are no parameters of the pipeline."""


def dial_named(name: str) -> Dial | None:
    """The dial of the table, or None for a parameter of the pipeline.

    Raises:
        InputError: It would have to be in the table, and is not.
    """
    known = {dial.name: dial for dial in DIALS}
    if name not in known and name.startswith(("scene.", "sensors.")):
        raise InputError(f"{name}: unknown dial; known: {', '.join(known)}")
    return known.get(name)


def unit_of(name: str) -> str:
    """The unit of a dial's values, as far as it has one."""
    dial = dial_named(name)
    return dial.unit if dial is not None else ""


def parse_dials(words: Sequence[str]) -> dict[str, float]:
    """What `NAME=VALUE` words say; InputError names one that is no dial, or comes twice."""
    point: dict[str, float] = {}
    for word in words:
        name, equals, text = (part.strip() for part in word.partition("="))
        if not equals or dial_named(name) is None:
            known = ", ".join(dial.name for dial in DIALS)
            raise InputError(f"--dial {word}: expected NAME=VALUE; dials: {known}")
        if name in point:
            raise InputError(f"--dial {name}: given twice")
        try:
            point[name] = float(text)
        except ValueError:
            raise InputError(f"--dial {word}: {text!r} is no number") from None
    return point


def turned(subject: Subject, point: Point) -> Subject:
    """The subject with every dial where the point has it; their order does not matter.

    Raises:
        InputError: A dial is unknown, its value is out of its range, or the scene has no such
            thing.
    """
    for name in sorted(point):
        subject = _turned(subject, name, point[name])
    return subject


def _turned(subject: Subject, name: str, value: Value) -> Subject:
    dial = dial_named(name)
    if dial is None:
        section, _, key = name.partition(".")
        origin = f"--vary {name}"
        return replace(subject, config=with_value(subject.config, section, key, value, origin))
    if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
        raise InputError(f"{name}: {value!r} is no number")
    if not dial.low <= value <= dial.high:
        unit = f" {dial.unit}" if dial.unit else ""
        raise InputError(
            f"{name}: {value!r:.20} is out of its range, {dial.low:g} to {dial.high:g}{unit}"
        )
    return dial.turn(subject, float(value))


def _part(subject: Subject, part: str, **change: float) -> Subject:
    table = getattr(subject.scene, part)
    if table is None:
        raise InputError(f"scene '{subject.scene.name}' has no [{part}] to change")
    return _scene(subject, **{part: table.model_copy(update=change)})


def _depth_camera(subject: Subject, **change: float | bool) -> Subject:
    return replace(subject, sensors=with_depth_camera(subject.sensors, **change))


def _flight_light(scene: Scene, share: float) -> Light | None:
    """None at 0: both robots see one world."""
    far = later_light(scene.light) if scene.flight_light is None else scene.flight_light
    return light_between(scene.light, far, share) if share > 0 else None


def _scene(subject: Subject, **change: object) -> Subject:
    return replace(subject, scene=subject.scene.model_copy(update=change))
