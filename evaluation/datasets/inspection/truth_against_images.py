"""Comparison of a dataset's truth with its images."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.core.cloud import Source
from airground.core.messages import GroundImage
from airground.core.se3 import SE3
from airground.io.robot_recording import RobotRecording
from evaluation.datasets.inspection.findings import Finding, Verdict
from evaluation.datasets.inspection.photometric import SHIFT_PX, Fit, Posed, fits
from evaluation.table.tracked_share import TruePose
from sim.recording.truth import Truth

PAIRS = 12
APART = 8
"""Distance of the two images of a pair, in images."""
MIN_FITS = 3
MAX_OFFSET_PX = 1.0
MAX_MEASURED_OFFSET_PX = 10.0
"""Measured truth has a clock and a mounting of its own: 20 ms, while a camera turns by 50 deg/s,
are 10 px. Truth of a simulator has neither."""
MIN_RISE = 1.05
"""Least rise of the difference over two pixels; with less, the images decide nothing."""
MIN_KNOWN = 0.5
MIRROR = np.diag([1.0, -1.0, 1.0])


def look_at_truth(part: str, recording: RobotRecording, true_pose: TruePose | None) -> Finding:
    """Share of the images whose true pose is known."""
    if true_pose is None:
        return Finding(part, "truth", "none", Verdict.NOTED)
    known = [true_pose(int(stamp)) is not None for stamp in recording.camera_stamps]
    share = float(np.mean(known))
    verdict = Verdict.FINE if share == 1 else Verdict.NOTED
    found = f"known for {100 * share:.0f} % of the images"
    return Finding(part, "truth", found, Verdict.WRONG if share < MIN_KNOWN else verdict)


def hold_truth_against_images(part: str, recording: RobotRecording, true_pose: TruePose) -> Finding:
    """Error of the true poses against the images, in pixels."""
    subject = "truth against images"
    if recording.robot == Source.MAV and recording.layout != "airground":
        return Finding(part, subject, "not checked: there is no depth", Verdict.NOTED)
    found = _fits(recording, true_pose)
    if len(found) < MIN_FITS:
        words = f"not checked: {len(found)} pairs of images show the same and move enough"
        return Finding(part, subject, words, Verdict.NOTED)
    offset = _offset_px(found)
    verdict, hint = _verdict(offset, recording.layout), ""
    if recording.layout != "airground" and verdict is not Verdict.FINE:
        hint = _mirrored_hint(recording, true_pose)
        verdict = Verdict.WRONG if hint else verdict
    if np.isinf(offset):
        words = f"the truth maps most of each image out of that {APART} images later"
        return Finding(part, subject, words + hint, Verdict.WRONG)
    rise = float(np.nanmedian([one.rise for one in found]))
    if rise < MIN_RISE and offset <= MAX_OFFSET_PX:
        return Finding(part, subject, "not checked: too little structure", Verdict.NOTED)
    words = (
        f"{offset:.2f} px off (median of {len(found)} pairs {APART} images apart); "
        f"{SHIFT_PX:g} px beside, they fit {100 * (rise - 1):.0f} % worse"
    )
    return Finding(part, subject, words + hint, verdict)


def _fits(recording: RobotRecording, true_pose: TruePose) -> list[Fit]:
    """Fits of pairs of images, spread evenly over the recording."""
    last = len(recording.camera_stamps) - 1 - APART
    starts = np.unique(np.linspace(0, max(last, 0), PAIRS).astype(int)).tolist()
    pairs = [(i, i + APART) for i in starts if i + APART < len(recording.camera_stamps)]
    depth_of = _depth(recording)

    def posed(index: int) -> Posed | None:
        T_world_camera = true_pose(int(recording.camera_stamps[index]))
        if T_world_camera is None:
            return None
        grey, depth = depth_of(index, T_world_camera)
        return Posed(grey, depth, T_world_camera)

    return fits(posed, pairs, recording.calibration.camera)


def _offset_px(found: list[Fit]) -> float:
    return float(np.median([np.linalg.norm(one.offset_px) for one in found]))


def _mirrored_hint(recording: RobotRecording, true_pose: TruePose) -> str:
    """Words for a truth that fits once its y axis points the other way; else nothing."""

    def mirrored(stamp_ns: int) -> SE3 | None:
        pose = true_pose(stamp_ns)
        return pose and SE3(MIRROR @ pose.rotation @ MIRROR, MIRROR @ pose.translation)

    found = _fits(recording, mirrored)
    if len(found) < MIN_FITS or _offset_px(found) > MAX_OFFSET_PX:
        return ""
    return (
        f"; mirrored it is {_offset_px(found):.2f} px off: its y axis points up, as ICL-NUIM's; "
        "negate ty, qx and qz"
    )


def _verdict(offset_px: float, layout: str) -> Verdict:
    if offset_px <= MAX_OFFSET_PX:
        return Verdict.FINE
    measured = layout != "airground" and offset_px <= MAX_MEASURED_OFFSET_PX
    return Verdict.NOTED if measured else Verdict.WRONG


Seen = tuple[NDArray[np.uint8], NDArray[np.float32]]


def _depth(recording: RobotRecording) -> Callable[[int, SE3], Seen]:
    """Reader of grey image and depth: measured, or of the true surface if the robot has none."""
    truth = None if recording.robot == Source.GROUND else Truth.open(recording.path)
    camera = recording.calibration.camera

    def seen(index: int, T_world_camera: SE3) -> Seen:
        image = recording.read_image(index)
        if isinstance(image, GroundImage):
            grey = cv2.cvtColor(image.colour, cv2.COLOR_RGB2GRAY)
            return np.asarray(grey, np.uint8), image.depth
        assert truth is not None
        return image.image, truth.surface("mav").cast(camera, T_world_camera)

    return seen
