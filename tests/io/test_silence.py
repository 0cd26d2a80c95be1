"""A clock that steps shows as a gap in all streams at once; a sensor that fails does not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from airground.core.cloud import Source
from airground.core.messages import ImuSamples, MagneticSamples
from airground.core.se3 import SE3
from airground.io.robot_recording import RobotRecording
from airground.io.silence import silence_note, silences
from sim.sensors.faults import Fault, faulty_field, faulty_imu
from sim.sensors.faulty_frames import FaultyFrames

SECONDS = 10.0
FIRST_NS = 1_000_000_000


def every(period_ns: int) -> np.ndarray:
    return np.arange(0, round(SECONDS * 1e9), period_ns, dtype=np.int64)


def recorded(*faults: Fault, magnetic: bool = True, camera_ns: int = 33_333_333) -> Any:
    """Stamps of a robot with images, an IMU at 200 Hz and a magnetometer at 50 Hz."""
    camera, inertial, field = every(camera_ns) + FIRST_NS, every(5_000_000), every(20_000_000)
    imu = ImuSamples(inertial, np.zeros((len(inertial), 3)), np.ones((len(inertial), 3)))
    return RobotRecording(
        path=Path("recording"),
        layout="airground",
        robot=Source.MAV,
        calibration=None,  # type: ignore[arg-type]
        camera_stamps=FaultyFrames.of(camera, faults).stamps_ns,
        imu=faulty_imu(imu, faults),
        magnetic=faulty_field(MagneticSamples(field, np.ones((len(field), 3))), faults)
        if magnetic
        else None,
        read_image=lambda index: None,
        pose_frame="body",
        T_pose_camera=SE3.identity(),
    )


def step(seconds: float, at_s: float = 4.0) -> Fault:
    return Fault("clock", "mav", 0.0, at_s, seconds)


def test_a_whole_recording_is_not_silent() -> None:
    assert silences(recorded()) == ()
    assert silence_note(recorded()) == ""


@pytest.mark.parametrize("seconds", [0.08, 0.5, 3.0])
@pytest.mark.parametrize("magnetic", [True, False])
def test_a_step_of_the_clock_is_a_silence(seconds: float, magnetic: bool) -> None:
    (found,) = silences(recorded(step(seconds), magnetic=magnetic))
    assert found.start_ns == pytest.approx(4e9, abs=5e6)
    assert found.duration_s == pytest.approx(seconds, abs=6e-3)


def test_the_note_has_times_after_the_first_image() -> None:
    note = silence_note(recorded(step(0.5), step(0.2, 6.0)))
    assert "silent from 3.00 to 3.50 s after the first image (the longest of 2 such times)" in note
    assert "stamps are ahead by about 0.50 s" in note


def test_what_is_silent_for_less_than_two_periods_is_no_silence() -> None:
    assert silences(recorded(step(0.05))) == ()
    assert silences(recorded(step(0.2), camera_ns=200_000_000)) == ()
    assert len(silences(recorded(step(0.5), camera_ns=200_000_000))) == 1


def test_sensors_that_fail_alone_are_no_silence() -> None:
    images, samples = (Fault(kind, "mav", 2.0, 4.0) for kind in ("dropped", "imu_gap"))
    assert silences(recorded(images)) == ()
    assert silences(recorded(samples)) == ()
    assert silences(recorded(images, samples)) == ()  # the magnetometer goes on
    (found,) = silences(recorded(images, samples, magnetic=False))
    assert found.duration_s == pytest.approx(2.0, abs=0.04)


def test_before_and_after_the_images_nothing_is_said() -> None:
    gap = Fault("imu_gap", "mav", 2.0, 4.0)
    whole = recorded(gap, magnetic=False)
    stamps = whole.camera_stamps
    assert silences(replace(whole, camera_stamps=stamps[stamps < 5_000_000_000])) == ()
    assert silences(replace(whole, camera_stamps=stamps[stamps > 5_000_000_000])) == ()


def test_without_an_imu_nothing_is_said() -> None:
    one = recorded(step(0.5))
    assert len(silences(one)) == 1
    assert silences(replace(one, imu=None)) == ()
