"""The true exposure of a simulated recording, held against its images."""

from __future__ import annotations

import numpy as np

from airground.core.cloud import Source
from airground.io.robot_recording import RobotRecording
from evaluation.datasets.inspection.findings import Finding, Verdict
from sim.recording.exposure_truth import read_exposure
from sim.robots.motion import Robot


def look_at_exposure(part: str, recording: RobotRecording) -> list[Finding]:
    """Range of exposure time and gain, and whether each image has one; nothing where exposure is
    fixed.

    Raises:
        RecordingError: The table of exposures is damaged.
    """
    if recording.layout != "airground":
        return []
    exposures = read_exposure(recording.path)
    if exposures is None:
        return []
    robot: Robot = "mav" if recording.robot == Source.MAV else "ground"
    one = exposures[robot]
    if not np.array_equal(one.stamps_ns, recording.camera_stamps):
        count = len(np.setxor1d(one.stamps_ns, recording.camera_stamps))
        words = f"its stamps are not those of the images: {count} are of one alone"
        return [Finding(part, "true exposure", words, Verdict.WRONG)]
    low_ms, high_ms = 1e3 * one.exposure_s.min(), 1e3 * one.exposure_s.max()
    found = (
        f"automatic, {low_ms:.1f} to {high_ms:.1f} ms, "
        f"gain {one.gain.min():.1f} to {one.gain.max():.1f}"
    )
    return [Finding(part, "true exposure", found)]
