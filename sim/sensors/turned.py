"""Presets with one thing turned: more noise, another lens, another shutter, a failing sensor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from airground.errors import InputError
from sim.robots.motion import Robot
from sim.sensors.auto_exposure import CONSUMER_EXPOSURE
from sim.sensors.faults import GROUND_ONLY, Fault, FaultKind
from sim.sensors.presets import CAMERA_RATE_HZ, SensorPreset
from sim.sensors.sensor_errors import MagneticNoise
from sim.world.magnetic_field import EARTH_FIELD_WORLD


def with_noise(preset: SensorPreset, factor: float) -> SensorPreset:
    """The preset with `factor` times the noise of images, depth and inertial sensors.

    What is no noise stays: the optics, steps of disparity, limits of depth, the magnetometers
    and the errors of the calibration.
    """
    image, depth, imu = preset.image, preset.depth, preset.imu
    return replace(
        preset,
        image=image
        and replace(
            image,
            read_noise=factor * image.read_noise,
            shot_noise=factor**2 * image.shot_noise,  # a variance
        ),
        depth=depth
        and replace(
            depth, axial_scale=factor * depth.axial_scale, lateral_px=factor * depth.lateral_px
        ),
        imu=imu.scaled(factor) if imu and factor > 0 else None,
    )


def with_rate(preset: SensorPreset, rate_hz: float) -> SensorPreset:
    """The preset with images of both cameras at this rate [Hz].

    Raises:
        InputError: It is no whole part of `CAMERA_RATE_HZ`.
    """
    every = round(CAMERA_RATE_HZ / rate_hz)
    if abs(every * rate_hz - CAMERA_RATE_HZ) > 1e-6 * CAMERA_RATE_HZ:
        raise InputError(
            f"sensors.camera_hz: {rate_hz:g} Hz is no {CAMERA_RATE_HZ:g} Hz divided by a whole "
            "number, as 15, 10, 7.5, 6 and 5 are"
        )
    return replace(preset, every=every)


def with_readout(preset: SensorPreset, readout_s: float) -> SensorPreset:
    """The preset with rolling shutters of this readout time [s]; 0 for global ones."""
    return replace(
        preset,
        mav_optics=replace(preset.mav_optics, readout_s=readout_s),
        ground_optics=replace(preset.ground_optics, readout_s=readout_s),
    )


def with_depth_camera(preset: SensorPreset, **change: float | bool) -> SensorPreset:
    """The preset with another `depth_baseline_m` or `depth_registered`."""
    return replace(preset, **change)  # type: ignore[arg-type]


def with_distortion(preset: SensorPreset, factor: float) -> SensorPreset:
    """The preset with radial-tangential lenses of `factor` times the measured distortion."""
    return replace(
        preset,
        mav_optics=replace(preset.mav_optics, lens="radtan", distortion=factor),
        ground_optics=replace(preset.ground_optics, lens="radtan", distortion=factor),
    )


def with_auto_exposure(preset: SensorPreset, strength: float) -> SensorPreset:
    """The preset with automatic exposure that makes this share of the corrections, in stops, that
    `real` makes; 0 is a fixed exposure."""
    exposure = replace(CONSUMER_EXPOSURE, strength=strength) if strength > 0 else None
    return replace(preset, exposure=exposure)


def with_gamma(preset: SensorPreset, gamma: float) -> SensorPreset:
    """The preset with this gamma of both cameras; InputError if their images are perfect."""
    if preset.image is None:
        if gamma == 1:
            return preset
        raise InputError(f"sensors '{preset.name}' cannot have a gamma: images are perfect")
    return replace(preset, image=replace(preset.image, gamma=gamma))


def with_fault(preset: SensorPreset, kind: FaultKind, seconds: float) -> SensorPreset:
    """The preset with a fault of each robot that can have it, for so long [s], each at a time drawn
    by the seed; the preset itself for 0 s."""
    robots: tuple[Robot, ...] = ("ground",) if kind in GROUND_ONLY else ("mav", "ground")
    lasting = [Fault(kind, robot, seconds) for robot in robots if seconds > 0]
    return replace(preset, faults=(*preset.faults, *lasting))


def with_clock_step(preset: SensorPreset, seconds: float) -> SensorPreset:
    """The preset with a clock of the MAV that jumps ahead by so much [s], at a time drawn by the
    seed; the preset itself for 0 s."""
    step = [Fault("clock", "mav", 0.0, size=seconds)] if seconds > 0 else []
    return replace(preset, faults=(*preset.faults, *step))


def with_fisheye(preset: SensorPreset, factor: float) -> SensorPreset:
    """The preset with fisheyes of 150 deg of `factor` times the measured distortion; 0 is an
    ideal equidistant lens."""
    return replace(
        preset,
        mav_optics=replace(preset.mav_optics, lens="equidistant", distortion=factor),
        ground_optics=replace(preset.ground_optics, lens="equidistant", distortion=factor),
    )


def with_heading_error(preset: SensorPreset, deviation_deg: float) -> SensorPreset:
    """The preset with headings of each robot's magnetometer that are off by this deviation.

    All of it is hard iron, which turns with the robot; the room's own anomaly is left out, so
    that the error is what is asked for.
    """
    horizontal_t = float(np.hypot(*EARTH_FIELD_WORLD[:2]))
    noise_t = preset.magnetic.noise_t if preset.magnetic else 0.0
    iron_t = horizontal_t * float(np.tan(np.deg2rad(deviation_deg)))
    return replace(preset, magnetic=MagneticNoise(noise_t, iron_t, 0.0))
