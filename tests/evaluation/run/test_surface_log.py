"""What is logged of a surface: its error against measured depth, its outcome, what is kept."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from airground.core.belief import Alignment
from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud
from airground.core.events import Aligned, BeliefUpdated, NotLocated, SurfaceCast
from airground.core.messages import MavImage
from airground.core.se3 import SE3
from airground.core.surface import AerialSurface
from evaluation.run.onlooker import Seen
from evaluation.run.surface_log import KEPT, AgainstMeasured, SurfaceLog
from evaluation.show.report.pair_page import pair_figures
from tests.evaluation.run.test_pair_events import BELIEF
from tests.evaluation.show.scripted_run import mav_frame

CAMERA = PinholeCamera(64, 48, 60.0, 60.0, 31.5, 23.5)


def recording(depth_m: float | None) -> Any:
    """Images at stamps 0 to 9, with a wall at a measured depth whose left quarter is unknown."""
    wall = np.full((48, 64), depth_m or 0.0, np.float32)
    wall[:, :16] = np.nan
    return SimpleNamespace(
        camera_stamps=np.arange(10),
        calibration=SimpleNamespace(camera=CAMERA),
        image_at=lambda stamp: MavImage(stamp, np.zeros((48, 64), np.uint8)),
        read_depth=None if depth_m is None else lambda index: wall + np.float32(0.1 * index),
    )


def surface(stamp_ns: int, depth_m: float = 2.0) -> AerialSurface:
    """A wall at half resolution, of which the upper half was fused."""
    camera = CAMERA.halved()
    depth = np.full((24, 32), depth_m, np.float32)
    depth[12:] = np.nan
    cloud = PointCloud(np.ones((5, 3), np.float32), np.zeros((5, 3), np.uint8))
    return AerialSurface(stamp_ns, stamp_ns, camera, SE3.identity(), depth, cloud, 3)


def logged(log: SurfaceLog, *events: Any) -> SurfaceLog:
    for event in events:
        log.see(Seen(event, 0.0, mav_frame(0), None))
    return log


def alignment(accepted: bool) -> Aligned:
    reason = "" if accepted else "clouds disagree: 10% of the aerial points"
    return Aligned(0, Alignment(0, SE3.from_heading(0.1), 0.9, 0.01, accepted, reason))


def test_the_error_is_that_to_the_depth_of_the_reference_view() -> None:
    log = logged(
        SurfaceLog(recording(1.97)), SurfaceCast(0, surface(0)), SurfaceCast(3, surface(3))
    )
    first, second = log.errors
    assert first.median_m == pytest.approx(0.03, abs=1e-5)
    assert second.p90_m == pytest.approx(0.27, abs=1e-5)  # measured 0.3 m farther in image 3
    assert first.completeness == pytest.approx(0.5)
    made = log.summary()
    assert made is not None
    assert made["compared"] == 2
    assert made["error_median_m"] == pytest.approx(0.15, abs=1e-5)


def test_without_measured_depth_there_is_no_error() -> None:
    log = logged(SurfaceLog(recording(None)), SurfaceCast(0, surface(0)))
    assert log.summary() is None
    (only,) = log.shown()
    assert only.error is None
    assert AgainstMeasured.of(only) is None


def test_a_surface_without_a_common_pixel_has_no_error() -> None:
    nothing = replace(surface(0), depth=np.full((24, 32), np.nan, np.float32))
    assert logged(SurfaceLog(recording(2.0)), SurfaceCast(0, nothing)).errors == []


def test_outcomes_are_those_of_the_last_stage() -> None:
    log = logged(
        SurfaceLog(recording(2.0)),
        SurfaceCast(0, surface(0)), NotLocated(0, "no pose: lost"),
        SurfaceCast(1, surface(1)), BeliefUpdated(1, BELIEF), alignment(False),
        SurfaceCast(2, surface(2)), BeliefUpdated(2, BELIEF), alignment(True),
    )  # fmt: skip
    outcomes = [one.outcome.partition(":")[0] for one in log.shown()]
    assert outcomes == ["no pose", "clouds disagree", "aligned"]
    assert log.shown()[0].T_ground_mav is None


def test_aligned_surfaces_are_kept_before_others() -> None:
    log = SurfaceLog(recording(2.0))
    for stamp in range(8):
        logged(log, SurfaceCast(stamp, surface(stamp)), BeliefUpdated(stamp, BELIEF))
        logged(log, alignment(stamp in (1, 6, 7)))
    kept = log.shown()
    assert len(kept) == KEPT
    assert [one.surface.stamp_ns for one in kept] == [1, 6, 7]


@pytest.mark.parametrize("depth_m", [2.0, None])
def test_pictures_are_drawn_with_and_without_measured_depth(depth_m: float | None) -> None:
    log = logged(SurfaceLog(recording(depth_m)), SurfaceCast(0, surface(0)), alignment(True))
    assert [one.name for one in pair_figures(log.shown())] == ["surfaces", "places"]
    assert list(pair_figures([])) == []
