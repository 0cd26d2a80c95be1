"""Inspection of a dataset: simulated recordings, a folder of others, or a ROS bag."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from airground.core.cloud import Source
from airground.errors import InputError, RecordingError
from airground.io.depth_scale import plausible
from airground.io.layout import HEADER
from airground.io.open_recording import layout_of, open_robot, unknown_layout
from airground.io.recording_folder import RecordingFolder
from airground.io.robot_recording import RobotRecording
from airground.io.silence import silence_note
from evaluation.datasets.inspection.exposure import look_at_exposure
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
MIXED_UP = {5.0: (1000, 5000), 0.2: (5000, 1000)}
"""Factors that mend depth whose common scales were mixed up: true one, and one it was read with."""


Opener = Callable[[Path, Source], RobotRecording[Any]]
"""Opens one robot's recording, with what the user says of it."""


def inspect_dataset(path: Path, opener: Opener = open_robot) -> tuple[str, list[Finding]]:
    """Inspect a dataset; what keeps it from being read is a finding, too.

    Returns:
        Its layout ("airground", "dataset" of many of ours, "folder" of many of any layout, "euroc",
        "tum", "7scenes" or "ros"), and the findings.

    Raises:
        InputError: The path has no known layout, or no use for an option of the opener.
    """
    if not path.exists():
        raise InputError(f"{path}: no such folder")
    layout = layout_of(path)
    if layout == "airground":
        return layout, _ours(path, opener)
    if path.is_dir() and (path / PLAN).exists():
        return "dataset", _many(path, opener)
    match layout:
        case "euroc":
            return layout, _robot(path, Source.MAV, opener)
        case "tum" | "7scenes":
            return layout, _robot(path, Source.GROUND, opener)
        case "ros":
            return layout, _bag(path, opener)
    if found := recordings_in(path):
        each = [(name, inspect_dataset(folder, opener)[1]) for name, folder in found.items()]
        return "folder", [under(name, one) for name, findings in each for one in findings]
    raise unknown_layout(path, f", {PLAN} (a dataset of ours)")


def recordings_in(path: Path) -> dict[str, Path]:
    """Recordings of any layout by name: the path itself, or those in its folders, two deep."""
    if layout_of(path) is not None:
        return {path.resolve().name: path}
    found: dict[str, Path] = {}
    for pattern in ("*", "*/*"):
        for one in sorted(path.glob(pattern)):
            inside = any(one.is_relative_to(other) for other in found.values())
            if not inside and not one.name.startswith(".") and layout_of(one) is not None:
                found[str(one.relative_to(path))] = one
    return found


def under(name: str, finding: Finding) -> Finding:
    """A finding of one recording among many."""
    return replace(finding, part=f"{name} {finding.part}".strip())


def _bag(path: Path, opener: Opener) -> list[Finding]:
    """Both robots that a bag may hold; one that is not in it is no fault."""
    found = {robot: _robot(path, robot, opener) for robot in (Source.MAV, Source.GROUND)}
    readable = [robot for robot, findings in found.items() if len(findings) > 1]
    for robot, findings in found.items():
        if robot not in readable and readable:
            found[robot] = [replace(one, verdict=Verdict.NOTED) for one in findings]
    return [one for findings in found.values() for one in findings]


def _many(path: Path, opener: Opener) -> list[Finding]:
    """Findings of each recording of a dataset, and whether all planned ones exist."""
    plan = read_checked(Plan, path / PLAN, "plan of a dataset")
    planned = {world.folder for world in plan.worlds}
    there = {str(file.parent.relative_to(path)) for file in path.glob(f"*/*/{HEADER}")}
    found = f"{len(there & planned)} of {len(planned)} planned"
    findings = [Finding("", "recordings", found)]
    for names, defect in ((planned - there, "is missing"), (there - planned, "was not planned")):
        findings += [Finding(n, "recording", defect, Verdict.WRONG) for n in sorted(names)]
    for name in sorted(there & planned):
        findings += [under(name, one) for one in _ours(path / name, opener)]
    return findings


def _ours(path: Path, opener: Opener) -> list[Finding]:
    try:
        recording = RecordingFolder.open(path)
    except RecordingError as error:
        return [_unreadable("", error)]
    findings = [Finding("", "recording", recording.header.facts())]
    try:
        recording.verify()
    except RecordingError as error:
        findings.append(Finding("", "digests", str(error), Verdict.WRONG))
    else:
        count = len(recording.header.digests)
        findings.append(Finding("", "digests", f"all {count} are right"))
    return [
        *findings,
        *(one for robot in recording.robots for one in _robot(path, robot, opener)),
    ]


def _robot(path: Path, robot: Source, opener: Opener) -> list[Finding]:
    part = robot.name.lower()
    try:
        recording = opener(path, robot)
        findings = [
            *(Finding(part, "assumed", words, Verdict.NOTED) for words in recording.assumed),
            look_at_stamps(part, "images", recording.camera_stamps),
            _camera(part, recording),
            *_samples(part, recording),
        ]
        if robot == Source.GROUND:
            findings.append(_depth(part, recording))
        true_pose = true_camera(recording)
        findings.append(look_at_truth(part, recording, true_pose))
        findings += look_at_exposure(part, recording)
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
    if note := silence_note(recording):
        findings.append(Finding(part, "clock", note, Verdict.WRONG))
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
    known, depths = [], []
    for index in np.unique(np.linspace(0, last, DEPTH_SAMPLES).astype(int)):
        image = recording.read_image(int(index))
        depth = image.depth  # type: ignore[union-attr]
        known.append(np.isfinite(depth).mean())
        depths.append(depth[np.isfinite(depth)])
    share, depth_m = float(np.mean(known)), np.concatenate(depths)
    if share < MIN_DEPTH:
        return Finding(part, "depth", f"known for {100 * share:.0f} % of the pixels", Verdict.WRONG)
    found = f"known for {100 * share:.0f} % of the pixels, median {np.median(depth_m):.2f} m"
    if not plausible(depth_m):
        for factor, scales in MIXED_UP.items():
            if plausible(depth_m * factor):
                found += f"; it looks like {scales[0]} per metre read as {scales[1]}"
                return Finding(part, "depth", found, Verdict.WRONG)
    return Finding(part, "depth", found)
