"""Sensors that fail for a while: which, when, for how long, and what is left of the samples.

What a fault does to images is in `faulty_frames`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from airground.core.messages import ImuSamples, MagneticSamples
from airground.errors import InputError
from sim.sensors.robot_clock import RobotClock

FaultKind = Literal[
    "black",
    "frozen",
    "repeated",
    "dropped",
    "exposure",
    "depth_gone",
    "imu_saturated",
    "imu_silent",
    "imu_gap",
    "clock",
    "carried",
]
SIZES: dict[str, float] = {"exposure": 4.0, "clock": 0.5, "carried": 8.0}
"""Size of a fault that has one, unless it is stated."""
GROUND_ONLY = ("depth_gone", "carried")
START_SHARES = (0.3, 0.55)
"""Range of a start that is drawn, as shares of the recording: both robots have a map, and time is
left to find back into it."""
SATURATED_GYRO = np.deg2rad(250.0)
"""Full scale of the gyro: the smallest range of an MPU-6000 [rad/s]."""
SATURATED_ACCELEROMETER = 2 * 9.81
"""Full scale of the accelerometer: the smallest range of an MPU-6000 [m/s^2]."""


@dataclass(frozen=True)
class Fault:
    """One failure of one robot's sensors.

    | kind | effect |
    |---|---|
    | black | colour or grey image of zeros; depth stays |
    | frozen | the last image before, again and again with new stamps |
    | repeated | every second image is the one before it, with a new stamp |
    | dropped | no images |
    | exposure | light `size` times as bright, and back at the end |
    | depth_gone | depth images without any depth |
    | imu_saturated | inertial samples at full scale, each axis with the sign of its reading |
    | imu_silent | inertial samples of zero |
    | imu_gap | no inertial samples |
    | clock | stamps of all sensors of the robot jump ahead by `size` [s] and stay so |
    | carried | the robot is carried back to where it was `size` [s] before, with black images, no \
depth and a silent IMU, and drives on from there |

    Attributes:
        robot: "mav" or "ground".
        duration_s: How long it lasts [s]; of no meaning for a clock.
        start_s: Time of its start in the recording [s]; drawn by the recording's seed if None.
        size: Size of the fault; None for the usual one in `SIZES`.

    Raises:
        InputError: A kind, duration, start or size that is impossible.
    """

    kind: FaultKind
    robot: Literal["mav", "ground"]
    duration_s: float
    start_s: float | None = None
    size: float | None = None

    def __post_init__(self) -> None:
        if self.kind not in get_args(FaultKind):
            known = ", ".join(get_args(FaultKind))
            raise InputError(f"unknown fault '{self.kind}': known are {known}")
        if self.robot not in (("ground",) if self.kind in GROUND_ONLY else ("mav", "ground")):
            raise InputError(f"fault '{self.kind}': not of a robot '{self.robot}'")
        for name in ("duration_s", "start_s", "size"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value >= 0):
                raise InputError(f"fault '{self.kind}': {name} must be at least 0, got {value}")

    @property
    def start_ns(self) -> int:
        """Start [ns]; of a fault that `placed` returned."""
        assert self.start_s is not None
        return round(self.start_s * 1e9)

    @property
    def end_ns(self) -> int:
        """End [ns]; of a fault that `placed` returned."""
        return self.start_ns + round(self.duration_s * 1e9)

    @property
    def strength(self) -> float:
        """The size, stated or usual; 0 where it has none."""
        return SIZES.get(self.kind, 0.0) if self.size is None else self.size

    def during(self, stamps_ns: NDArray[np.int64]) -> NDArray[np.bool_]:
        """(N,) whether it lasts at these times."""
        return (stamps_ns >= self.start_ns) & (stamps_ns < self.end_ns)


def placed(
    faults: Sequence[Fault], duration_s: float, rng: np.random.Generator
) -> tuple[Fault, ...]:
    """The faults with their starts, drawn where none is stated.

    Raises:
        InputError: A fault starts or ends outside of the recording, or the ground robot would be
            carried back to before it started.
    """
    drawn = rng.uniform(*START_SHARES, len(faults)) * duration_s
    chosen = tuple(
        replace(fault, start_s=round(float(start), 3)) if fault.start_s is None else fault
        for fault, start in zip(faults, drawn, strict=True)
    )
    for fault in chosen:
        if fault.end_ns > duration_s * 1e9:
            raise InputError(
                f"fault '{fault.kind}': lasts until {fault.end_ns * 1e-9:g} s, the recording until "
                f"{duration_s:g} s"
            )
        if fault.kind == "carried" and fault.strength * 1e9 > fault.start_ns:
            raise InputError(
                f"fault 'carried': at {fault.start_s:g} s the robot cannot be carried back by "
                f"{fault.strength:g} s"
            )
    return chosen


def of_robot(faults: Iterable[Fault], robot: str) -> tuple[Fault, ...]:
    """The faults of one robot's sensors."""
    return tuple(fault for fault in faults if fault.robot == robot)


def faulty_imu(samples: ImuSamples, faults: Sequence[Fault]) -> ImuSamples:
    """What one robot's inertial sensor still gives; `faults` are placed, and of that robot."""
    gyro, accelerometer = np.array(samples.gyro), np.array(samples.accelerometer)
    present = np.ones(len(samples.stamps_ns), bool)
    for fault in faults:
        rows = fault.during(samples.stamps_ns)
        if fault.kind == "imu_gap":
            present &= ~rows
        elif fault.kind in ("imu_silent", "carried"):
            gyro[rows] = accelerometer[rows] = 0.0
        elif fault.kind == "imu_saturated":
            gyro[rows] = np.copysign(SATURATED_GYRO, gyro[rows])
            accelerometer[rows] = np.copysign(SATURATED_ACCELEROMETER, accelerometer[rows])
    said, in_time = said_stamps(samples.stamps_ns, faults)
    kept = present & in_time
    return ImuSamples(said[kept], gyro[kept], accelerometer[kept])


def faulty_field(samples: MagneticSamples, faults: Sequence[Fault]) -> MagneticSamples:
    """What one robot's magnetometer still gives, as `faulty_imu`."""
    said, in_time = said_stamps(samples.stamps_ns, faults)
    return MagneticSamples(said[in_time], samples.field[in_time])


def said_stamps(
    stamps_ns: NDArray[np.int64], faults: Sequence[Fault]
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """(N,) stamps by a clock that may have stepped [ns], and whether they lie in the recording."""
    said = clock_of(faults).stamps_ns(stamps_ns)
    return said, said <= stamps_ns[-1]


def clock_of(faults: Iterable[Fault]) -> RobotClock:
    """The clock of the robot with these placed faults."""
    steps = [fault for fault in faults if fault.kind == "clock"]
    return RobotClock.stepping((fault.start_ns, round(fault.strength * 1e9)) for fault in steps)
