"""Motions and mishaps that SLAM has to survive, in the synthetic room.

A motion is a list of what the robot does one after the other; a mishap takes a sequence and
gives back the same one with something wrong in it.

    sequence = flight(Leg(4.0, speed_mps=0.5), Leg(10.0))  # flies on, then hovers for 10 s
    tracked = darkened(sequence, 2.0, 3.0).feed(front_end)
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline
from scipy.ndimage import gaussian_filter1d

from airground.core.cloud import Source
from airground.core.messages import GroundImage, ImuSamples, MavImage
from airground.core.trajectory import Trajectory
from tests.slam.synthetic_world import (
    GROUND_HEIGHT_M,
    MAV_HEIGHT_M,
    RADIUS_M,
    START_NS,
    T_GROUND_IMU_CAMERA,
    T_MAV_IMU_CAMERA,
    Sequence,
    along,
)

STEP_S = 0.01
SMOOTHING_S = 0.15
"""Speeds change over about four times this long: robots do not jerk."""
BEFORE_S, AFTER_S = 0.6, 0.6
HZ = 20.0


@dataclass(frozen=True)
class Leg:
    """What a robot does for a while.

    Attributes:
        seconds: How long.
        speed_mps: Along the circle.
        turn_deg_s: About the vertical; the ground robot's heading follows its way besides.
        climb_mps: Upwards.
        sway: How much it sways and rolls in the air, or shakes on the floor; 0 is still.
    """

    seconds: float
    speed_mps: float = 0.0
    turn_deg_s: float = 0.0
    climb_mps: float = 0.0
    sway: float = 0.0


@cache
def flight(*legs: Leg, height_m: float = MAV_HEIGHT_M) -> Sequence:
    """The MAV; a first leg that moves is begun in motion."""
    t, way, turn, climb, sway = _profile(legs)
    angle = way / RADIUS_M
    path = np.column_stack(
        [
            RADIUS_M * np.cos(angle) + sway * 0.05 * np.sin(2 * np.pi * 0.45 * t),
            RADIUS_M * np.sin(angle) + sway * 0.05 * np.sin(2 * np.pi * 0.55 * t + 2),
            height_m + climb + sway * 0.08 * np.sin(2 * np.pi * 0.7 * t),
            sway * 0.05 * np.sin(2 * np.pi * 0.9 * t),
            sway * 0.06 * np.sin(2 * np.pi * 0.6 * t + 1),
            turn + sway * 0.3 * np.sin(2 * np.pi * 0.25 * t),
        ]
    )
    frames = round(sum(leg.seconds for leg in legs) * HZ)
    return along(Source.MAV, T_MAV_IMU_CAMERA, _through(t, path), frames, HZ, imu_noise=1.0)


@cache
def drive(*legs: Leg) -> Sequence:
    """The ground robot."""
    t, way, turn, _, shake = _profile(legs)
    angle = way / RADIUS_M
    path = np.column_stack(
        [
            RADIUS_M * np.cos(angle),
            RADIUS_M * np.sin(angle),
            GROUND_HEIGHT_M + shake * 0.003 * np.sin(2 * np.pi * 3.0 * t),
            shake * 0.005 * np.sin(2 * np.pi * 2.0 * t),
            shake * 0.006 * np.sin(2 * np.pi * 2.5 * t + 1),
            angle + np.pi / 2 + turn,
        ]
    )
    frames = round(sum(leg.seconds for leg in legs) * HZ)
    spline = _through(t, path)
    return along(Source.GROUND, T_GROUND_IMU_CAMERA, spline, frames, HZ, imu_noise=1.0)


def _profile(legs: tuple[Leg, ...]) -> NDArray[np.float64]:
    """(5, n) time [s], way [m], heading [rad], height gained [m] and sway [-]."""
    ends = np.cumsum([leg.seconds for leg in legs])
    t = np.arange(-BEFORE_S, ends[-1] + AFTER_S, STEP_S)
    which = np.minimum(np.searchsorted(ends, t, side="right"), len(legs) - 1)
    speeds = np.array(
        [[leg.speed_mps, np.radians(leg.turn_deg_s), leg.climb_mps, leg.sway] for leg in legs]
    )[which]
    speeds = gaussian_filter1d(speeds, SMOOTHING_S / STEP_S, axis=0, mode="nearest")
    gone = np.cumsum(speeds[:, :3], axis=0) * STEP_S
    gone -= gone[np.searchsorted(t, -STEP_S / 2)]
    return np.column_stack([t, gone, speeds[:, 3]]).T


def _through(t: NDArray[np.float64], path: NDArray[np.float64]) -> BSpline:
    return make_interp_spline(t[::5], path[::5], k=5)


def image_range(sequence: Sequence, start_s: float, end_s: float) -> range:
    """Which images were taken from `start_s` up to `end_s` after the first."""
    stamps = [image.stamp_ns for image in sequence.images]
    seconds = (np.array(stamps) - START_NS) * 1e-9 + 1e-6
    first, last = np.searchsorted(seconds, [start_s, end_s])
    return range(int(first), int(last))


def darkened(sequence: Sequence, start_s: float, end_s: float) -> Sequence:
    """Black images for a while, without depth."""
    dark = image_range(sequence, start_s, end_s)
    return sequence.darkened(dark.start, dark.stop)


def without_images(sequence: Sequence, start_s: float, end_s: float) -> Sequence:
    """Some images never arrive."""
    gone = image_range(sequence, start_s, end_s)
    kept = [k for k in range(len(sequence.images)) if k not in gone]
    truth = sequence.T_world_camera
    return replace(
        sequence,
        images=tuple(sequence.images[k] for k in kept),
        T_world_camera=Trajectory.from_poses(
            [int(truth.stamps_ns[k]) for k in kept], [truth[k] for k in kept]
        ),
    )


def without_imu(sequence: Sequence, start_s: float, end_s: float, as_nan: bool = False) -> Sequence:
    """Inertial samples are missing for a while, or are NaN."""
    imu = sequence.imu
    seconds = (imu.stamps_ns - START_NS) * 1e-9
    gone = (seconds >= start_s) & (seconds < end_s)
    if as_nan:
        gyro, force = imu.gyro.copy(), imu.accelerometer.copy()
        gyro[gone], force[gone] = np.nan, np.nan
        return replace(sequence, imu=ImuSamples(imu.stamps_ns, gyro, force))
    kept = ImuSamples(imu.stamps_ns[~gone], imu.gyro[~gone], imu.accelerometer[~gone])
    return replace(sequence, imu=kept)


def exposed(sequence: Sequence, start_s: float, end_s: float, gain: float) -> Sequence:
    """Images `gain` times as bright, saturated, for a while."""
    jump = image_range(sequence, start_s, end_s)
    images = [
        _brighter(image, gain) if k in jump else image for k, image in enumerate(sequence.images)
    ]
    return replace(sequence, images=tuple(images))


def _brighter(image: MavImage | GroundImage, gain: float) -> MavImage | GroundImage:
    name = "image" if isinstance(image, MavImage) else "colour"
    levels = np.rint(getattr(image, name) * gain).clip(0, 255).astype(np.uint8)
    return replace(image, **{name: levels})


def carried_away(sequence: Sequence, start_s: float, end_s: float, dark_s: float) -> Sequence:
    """The robot is set down elsewhere, and neither camera nor IMU felt how it got there.

    What was between `start_s` and `end_s` is cut out, the rest follows at once, and the first
    images after that are black for `dark_s`.
    """
    gone = image_range(sequence, start_s, end_s)
    cut = sequence.images[gone.stop].stamp_ns - sequence.images[gone.start].stamp_ns
    from_ns = sequence.images[gone.start].stamp_ns
    truth, imu = sequence.T_world_camera, sequence.imu
    kept = [k for k in range(len(sequence.images)) if k not in gone]
    images = [sequence.images[k] for k in kept]
    images = [
        replace(image, stamp_ns=image.stamp_ns - cut) if image.stamp_ns > from_ns else image
        for image in images
    ]
    rows = (imu.stamps_ns < from_ns) | (imu.stamps_ns >= from_ns + cut)
    stamps = imu.stamps_ns[rows]
    spliced = replace(
        sequence,
        images=tuple(images),
        imu=ImuSamples(
            np.where(stamps < from_ns, stamps, stamps - cut),
            imu.gyro[rows],
            imu.accelerometer[rows],
        ),
        T_world_camera=Trajectory.from_poses(
            [image.stamp_ns for image in images], [truth[k] for k in kept]
        ),
    )
    return darkened(spliced, start_s, start_s + dark_s)
