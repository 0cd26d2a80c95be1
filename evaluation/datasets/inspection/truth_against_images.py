"""Comparison of a dataset's truth with its images."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from airground.core.cloud import Source
from airground.core.messages import GroundImage, RobotCalibration
from airground.core.se3 import SE3
from airground.io.robot_recording import RobotRecording
from evaluation.datasets.inspection.findings import Finding, Verdict
from evaluation.datasets.inspection.photometric import SHIFT_PX, Fit, Posed, fits
from evaluation.table.tracked_share import TruePose
from sim.recording.row_poses import RowPoses
from sim.recording.truth import Truth

PAIRS = 12
APART = 8
"""Distance of the two images of a pair, in images."""
ROW_POSES = 9
"""Poses that are looked up of a rolling shutter's image: one each 4 ms at 30 ms."""
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
        stamp_ns = int(recording.camera_stamps[index])
        T_world_camera = true_pose(stamp_ns)
        rows = _row_poses(recording.calibration, true_pose, stamp_ns)
        if T_world_camera is None or (recording.calibration.readout_s and rows is None):
            return None
        grey, depth = depth_of(index, T_world_camera, rows)
        return Posed(grey, depth, T_world_camera, rows)

    return fits(posed, pairs, recording.calibration.camera)


def _row_poses(
    calibration: RobotCalibration, true_pose: TruePose, stamp_ns: int
) -> RowPoses | None:
    """Poses of a rolling shutter's rows in the frame of the middle one; None with a global shutter,
    or where one is unknown. Between `ROW_POSES` of them the camera moves evenly."""
    if not calibration.readout_s:
        return None
    share = np.linspace(-0.5, 0.5, ROW_POSES)
    times = stamp_ns + np.rint(share * calibration.readout_s * 1e9).astype(int)
    poses = [true_pose(int(time_ns)) for time_ns in times]
    middle = true_pose(stamp_ns)
    if middle is None:
        return None
    moved = []
    for pose in poses:
        if pose is None:
            return None
        T_middle_row = middle.inverse() @ pose
        moved.append([*T_middle_row.translation, *T_middle_row.rotation_vector()])
    rows = np.linspace(-0.5, 0.5, calibration.camera.height)
    each = np.array([np.interp(rows, share, of_axis) for of_axis in np.array(moved).T]).T
    return RowPoses(Rotation.from_rotvec(each[:, 3:]).as_matrix(), each[:, :3])


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


def _depth(
    recording: RobotRecording,
) -> Callable[[int, SE3, RowPoses | None], Seen]:
    """Reader of grey image and depth: measured, or of the true surface if the robot has none."""
    truth = None if recording.robot == Source.GROUND else Truth.open(recording.path)
    camera = recording.calibration.camera

    def seen(index: int, T_world_camera: SE3, rows: RowPoses | None) -> Seen:
        image = recording.read_image(index)
        if isinstance(image, GroundImage):
            grey = cv2.cvtColor(image.colour, cv2.COLOR_RGB2GRAY)
            return np.asarray(grey, np.uint8), image.depth
        assert truth is not None
        surface = truth.surface("mav")
        if rows is None:
            return image.image, surface.cast(camera, T_world_camera)
        rays = rows.seen_from(T_world_camera.inverse()).rays_world(camera.rays())
        hit = surface.scene.cast_rays(rays)["t_hit"].numpy()
        return image.image, np.where(np.isfinite(hit), hit, np.float32(np.nan))

    return seen
