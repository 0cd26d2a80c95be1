"""Inspection of a dataset: simulated recordings, a plain EuRoC or a plain TUM RGB-D folder."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from airground.core.cloud import Source
from airground.errors import InputError, RecordingError
from airground.io.layout import HEADER
from airground.io.open_recording import open_robot
from airground.io.plain_euroc import euroc_folder
from airground.io.plain_tum import is_tum_folder
from airground.io.recording import Recording
from airground.io.robot_recording import RobotRecording
from evaluation.datasets.inspection.findings import Finding, Verdict, look_at_stamps
from evaluation.datasets.inspection.truth_against_images import (
    hold_truth_against_images,
    look_at_truth,
)
from evaluation.datasets.plan import PLAN, Plan
from evaluation.setup.checked_json import read_checked
from evaluation.table.true_camera import true_camera

FIELD_OF_VIEW_DEG = (20.0, 150.0)
"""Horizontal; beyond it the focal length is probably in another unit."""
MIN_DEPTH = 0.05
"""Share of pixels with depth; below it depth images are probably misread."""
DEPTH_SAMPLES = 10
"""Images in which depth is inspected, spread evenly."""


def inspect_dataset(path: Path, calibration_file: Path | None = None) -> tuple[str, list[Finding]]:
    """Inspect a dataset; what keeps it from being read is a finding, too.

    Returns:
        Its layout ("airground", "dataset" of many, "euroc" or "tum"), and the findings.

    Raises:
        InputError: The folder has no known layout.
    """
    if not path.is_dir():
        raise InputError(f"{path}: no such folder")
    if (path / HEADER).exists():
        return "airground", _ours(path)
    if (path / PLAN).exists():
        return "dataset", _many(path)
    if euroc_folder(path) is not None:
        return "euroc", _robot(path, Source.MAV, calibration_file)
    if is_tum_folder(path):
        return "tum", _robot(path, Source.GROUND, calibration_file)
    raise InputError(
        f"{path}: holds neither {HEADER} (a recording of ours) nor {PLAN} (a dataset of ours) nor "
        "mav0/cam0 (EuRoC) nor rgb.txt (TUM RGB-D)"
    )


def _many(path: Path) -> list[Finding]:
    """Findings of each recording of a dataset, and whether all planned ones exist."""
    plan = read_checked(Plan, path / PLAN, "plan of a dataset")
    planned = {world.folder for world in plan.worlds}
    there = {str(file.parent.relative_to(path)) for file in path.glob(f"*/*/{HEADER}")}
    found = f"{len(there & planned)} of {len(planned)} planned"
    findings = [Finding("", "recordings", found)]
    for names, defect in ((planned - there, "is missing"), (there - planned, "was not planned")):
        findings += [Finding(n, "recording", defect, Verdict.WRONG) for n in sorted(names)]
    for name in sorted(there & planned):
        findings += [replace(one, part=f"{name} {one.part}") for one in _ours(path / name)]
    return findings


def _ours(path: Path) -> list[Finding]:
    try:
        recording = Recording.open(path)
    except RecordingError as error:
        return [_unreadable("", error)]
    made = f"{recording.scene}, seed {recording.seed}, flight {recording.flight}"
    found = f"{made}, {recording.sensors} sensors, {recording.duration_s:g} s"
    findings = [Finding("", "recording", found)]
    try:
        recording.verify()
    except RecordingError as error:
        findings.append(Finding("", "digests", str(error), Verdict.WRONG))
    else:
        count = len(recording.header.digests)
        findings.append(Finding("", "digests", f"all {count} are right"))
    return findings + _robot(path, Source.MAV, None) + _robot(path, Source.GROUND, None)


def _robot(path: Path, robot: Source, calibration_file: Path | None) -> list[Finding]:
    part = robot.name.lower()
    try:
        recording = open_robot(path, robot, calibration_file)
        findings = [
            look_at_stamps(part, "images", recording.camera_stamps),
            _camera(part, recording),
            *_samples(part, recording),
        ]
        if robot == Source.GROUND:
            findings.append(_depth(part, recording))
        true_pose = true_camera(recording)
        findings.append(look_at_truth(part, recording, true_pose))
        if true_pose is not None:
            findings.append(hold_truth_against_images(part, recording, true_pose))
    except RecordingError as error:
        return [_unreadable(part, error)]
    return findings


def _unreadable(part: str, error: RecordingError) -> Finding:
    return Finding(part, "readable", str(error), Verdict.WRONG)


def _samples(part: str, recording: RobotRecording) -> list[Finding]:
    findings = []
    for subject, samples in (("IMU", recording.imu), ("magnetometer", recording.magnetic)):
        if samples is None:
            findings.append(Finding(part, subject, "none", Verdict.NOTED))
        else:
            findings.append(look_at_stamps(part, subject, samples.stamps_ns))
    return findings


def _camera(part: str, recording: RobotRecording) -> Finding:
    """Without distortion, which is removed when images are read."""
    camera = recording.calibration.camera
    view_deg = float(np.rad2deg(2 * np.arctan(camera.width / 2 / camera.fx)))
    found = f"{camera.width}x{camera.height}, f {camera.fx:.1f} px, {view_deg:.0f} deg wide"
    low, high = FIELD_OF_VIEW_DEG
    verdict = Verdict.FINE if low <= view_deg <= high else Verdict.WRONG
    return Finding(part, "calibration", found, verdict)


def _depth(part: str, recording: RobotRecording) -> Finding:
    last = len(recording.camera_stamps) - 1
    known, middle = [], []
    for index in np.unique(np.linspace(0, last, DEPTH_SAMPLES).astype(int)):
        image = recording.read_image(int(index))
        depth = image.depth  # type: ignore[union-attr]
        known.append(np.isfinite(depth).mean())
        middle += [float(np.nanmedian(depth))] if known[-1] > 0 else []
    share = float(np.mean(known))
    if share < MIN_DEPTH:
        return Finding(part, "depth", f"known for {100 * share:.0f} % of the pixels", Verdict.WRONG)
    found = f"known for {100 * share:.0f} % of the pixels, median {np.median(middle):.2f} m"
    return Finding(part, "depth", found)
