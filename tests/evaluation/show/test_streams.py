"""Every stream of a run, read back from its file and compared with the events."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image

from airground.core.se3 import SE3
from evaluation.show.rerun_view.localization import on_costs
from evaluation.show.rerun_view.maps import GLIDE_NS
from evaluation.show.rerun_view.run_view import layout
from evaluation.show.rerun_view.sensor_stream import LEVELS
from tests.evaluation.show.scripted_run import (
    BELIEF,
    CLOUD,
    CORNERS,
    COSTS,
    DEPTH,
    DOWN,
    MAPPED,
    SECOND,
    T_BELIEVED,
    T_GROUND_MAV,
    TIMES_NS,
    ReadBack,
    seen_events,
    written,
)

SHOWN = {
    *(f"/{robot}/{part}" for robot in ("mav", "ground") for part in ("camera", "path", "map")),
    *(f"/{robot}/camera/image{part}" for robot in ("mav", "ground") for part in ("", "/corners")),
    *("/mav/alignment", "/mav/surface", "/mav/surface/alignment", "/mav/depth_map"),
    *("/localization/aerial_heights", "/localization/ground_heights", "/localization/costs"),
    *(f"/localization/costs/{part}" for part in ("particles", "covariance", "estimate")),
    *(f"/curves/corners/{robot}" for robot in ("mav", "ground")),
    *(f"/curves/sigma_mm/{robot}" for robot in ("mav", "ground")),
    *("/curves/spread_m", "/curves/stage_ms/track_mav", "/curves/stage_ms/icp", "/events"),
}
TRUE = {
    *(f"/truth/{robot}/{part}" for robot in ("mav", "ground") for part in ("camera/pose", "path")),
    *("/truth/world", "/truth/scene", "/truth/depth_error", "/truth/position"),
    *(f"/truth/error/{what}/refined" for what in ("translation_m", "rotation_deg")),
}


@pytest.fixture(scope="module")
def read(tmp_path_factory: pytest.TempPathFactory) -> ReadBack:
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # rerun only warns of values that it cannot store
        return ReadBack(written(tmp_path_factory.mktemp("run") / "run.rrd"))


def picture(blob: Any) -> np.ndarray:
    with Image.open(io.BytesIO(np.array(blob, np.uint8).tobytes())) as opened:
        return np.asarray(opened.convert("RGB") if opened.mode == "P" else opened)


def pose(read: ReadBack, entity: str, row: int = -1) -> SE3:
    translation = read.values(entity, "Transform3D:translation")[row][0]
    quaternion = read.values(entity, "Transform3D:quaternion")[row][0]
    return SE3.from_quaternion_xyzw(quaternion, translation)


def assert_same(one: SE3, other: SE3) -> None:
    np.testing.assert_allclose(one.matrix(), other.matrix(), atol=1e-6)


def test_all_streams_are_there(read: ReadBack) -> None:
    assert read.entities >= SHOWN | TRUE


def test_there_is_one_timeline_and_it_is_sensor_time(read: ReadBack) -> None:
    assert read.timelines == {"sensor_time"}
    assert read.stamps_ns("/ground/camera") == [SECOND]
    assert read.stamps_ns("/mav/camera") == [2 * SECOND, 3 * SECOND]


def test_without_truth_there_is_no_panel_for_it() -> None:
    every, rest = set(origins(layout(True, TIMES_NS))), set(origins(layout(False, TIMES_NS)))
    assert rest == {origin for origin in every if not origin.startswith("/truth")}
    assert "/truth/depth_error" in every


def origins(shown: Any) -> Iterator[str]:
    """What the panels of a layout show."""
    part = getattr(shown, "root_container", shown)
    for inner in getattr(part, "contents", None) or ():
        if hasattr(inner, "origin"):
            yield str(inner.origin)
        elif not isinstance(inner, str):
            yield from origins(inner)


def test_without_truth_the_rest_is_the_same(read: ReadBack, tmp_path: Path) -> None:
    plain = ReadBack(written(tmp_path / "run.rrd", truth=None))
    assert plain.entities == {name for name in read.entities if not name.startswith("/truth")}
    assert plain.values("/events", "TextLog:text") == read.values("/events", "TextLog:text")


def test_cameras_have_the_poses_of_the_front_ends(read: ReadBack) -> None:
    assert_same(pose(read, "/mav/camera"), DOWN)
    assert read.values("/mav/camera", "Transform3D:parent_frame")[-1] == ["mav"]
    assert read.values("/mav/camera", "Transform3D:child_frame")[-1] == ["mav_camera"]
    assert_same(pose(read, "/truth/mav/camera/pose"), T_GROUND_MAV @ DOWN)
    strip = read.values("/mav/path", "LineStrips3D:strips")[-1][0]
    np.testing.assert_allclose(strip, [DOWN.translation] * 2, atol=1e-6)


def test_images_and_corners_are_as_seen(read: ReadBack) -> None:
    assert (
        np.abs(picture(read.values("/mav/camera/image", "EncodedImage:blob")[0][0]) - 90.0).max()
        < 3
    )
    colour = picture(read.values("/ground/camera/image", "EncodedImage:blob")[-1][0])
    assert np.abs(colour.reshape(-1, 3).mean(axis=0) - (200, 40, 40)).max() < 3
    drawn = read.values("/mav/camera/image/corners", "Points2D:positions")
    np.testing.assert_allclose(drawn[0], CORNERS + 0.5)
    assert drawn[-1] == []  # lost: no corners are tracked
    colours = read.values("/mav/camera/image/corners", "Points2D:colors")[0]
    assert colours[0] == colours[2] != colours[1]
    assert read.values("/curves/corners/mav", "Scalars:scalars")[0] == [MAPPED.sum()]


def test_depth_is_kept_to_half_a_millimetre(read: ReadBack) -> None:
    blob = read.values("/mav/depth_map", "EncodedDepthImage:blob")[0][0]
    steps = cv2.imdecode(np.array(blob, np.uint8), cv2.IMREAD_UNCHANGED)
    per_m = read.values("/mav/depth_map", "EncodedDepthImage:meter")[0][0]
    assert steps.dtype == np.uint16
    np.testing.assert_allclose(steps / per_m, np.nan_to_num(DEPTH), atol=5.1e-4)


def test_depth_that_is_too_far_is_red_and_a_hole_is_dark(read: ReadBack) -> None:
    error = picture(read.values("/truth/depth_error", "EncodedImage:blob")[0][0]).astype(int)
    red, green, blue = error[20, 20]
    assert red > green + 40 > blue
    assert error[0, 0].max() < 70


def test_costs_are_low_where_dark_with_y_up(read: ReadBack) -> None:
    costs = picture(read.values("/localization/costs", "EncodedImage:blob")[0][0])[..., 0]
    assert costs.shape == (20, 30)
    assert costs[-1, 0] == costs.min() == 0  # cell [0, 0]
    assert (np.diff(costs[0].astype(int)) >= 0).all()  # x to the right: costs rise


def test_particles_lie_on_the_cost_map(read: ReadBack) -> None:
    drawn = np.array(read.values("/localization/costs/particles", "Points2D:positions")[0])
    # From the corner of cell [0, 0]: x to the right, y up from the lower edge.
    expected_x = (BELIEF.particles[:, 0] + 0.5) * 10 + 0.5
    expected_y = 20 - ((BELIEF.particles[:, 1] + 1.0) * 10 + 0.5)
    np.testing.assert_allclose(drawn, np.stack([expected_x, expected_y], axis=1), atol=1e-4)
    ellipse = np.array(read.values("/localization/costs/covariance", "LineStrips2D:strips")[0][0])
    assert np.ptp(ellipse[:, 0]) == pytest.approx(2 * 2 * 0.2 * 10, rel=1e-3)
    assert np.ptp(ellipse[:, 1]) == pytest.approx(2 * 2 * 0.1 * 10, rel=1e-2)


def test_the_true_position_is_that_of_fig_8(read: ReadBack) -> None:
    strips = np.array(read.values("/truth/position", "LineStrips2D:strips")[0])
    true_u = (T_GROUND_MAV @ DOWN.translation)[:2]
    np.testing.assert_allclose(
        strips.mean(axis=(0, 1)), on_costs(true_u[None], COSTS)[0], atol=1e-4
    )


def test_the_surface_lands_where_it_was_aligned(read: ReadBack) -> None:
    stamps = read.stamps_ns("/mav/surface/alignment")
    assert stamps[0] == 3 * SECOND
    assert stamps[-1] == 3 * SECOND + GLIDE_NS
    assert_same(pose(read, "/mav/surface/alignment", 0), T_BELIEVED)
    assert_same(pose(read, "/mav/surface/alignment"), T_GROUND_MAV)
    assert_same(pose(read, "/mav/alignment"), T_GROUND_MAV)
    for entity, stamp in (("/mav/surface", 3 * SECOND), ("/mav/map", 3 * SECOND + GLIDE_NS)):
        points = np.array(read.values(entity, "Points3D:positions")[-1])
        expected = CLOUD.points[np.lexsort(CLOUD.points.T)]
        np.testing.assert_allclose(points[np.lexsort(points.T)], expected, atol=1e-6)
        assert read.stamps_ns(entity)[-1] == stamp


def test_a_refused_alignment_moves_nothing(tmp_path: Path) -> None:
    refused = ReadBack(written(tmp_path / "run.rrd", events=seen_events(accepted=False)))
    assert "/mav/alignment" not in refused.entities
    assert len(refused.values("/mav/surface/alignment", "Transform3D:translation")) == 1
    said = [text[0] for text in refused.values("/events", "TextLog:text")]
    assert "alignment: refused, too few inliers" in said


def test_curves_hold_what_was_measured(read: ReadBack) -> None:
    def last(entity: str) -> float:
        return read.values(entity, "Scalars:scalars")[-1][0]

    assert last("/curves/spread_m") == pytest.approx(BELIEF.spread_m)
    assert last("/curves/stage_ms/icp") == 12.5
    assert last("/curves/sigma_mm/mav") == pytest.approx(1e3 * np.sqrt(3e-4))
    assert last("/truth/error/translation_m/particles") == pytest.approx(0.1)
    assert last("/truth/error/translation_m/refined") == pytest.approx(0.0, abs=1e-9)
    assert last("/truth/error/rotation_deg/refined") == pytest.approx(0.0, abs=1e-5)


def test_each_message_appears_once(read: ReadBack) -> None:
    said = [text[0] for text in read.values("/events", "TextLog:text")]
    assert said == [
        "ground robot: has no map yet",
        "ground robot: tracked",
        "MAV: tracked",
        "particles: converged, spread 0.14 m",
        "alignment: accepted, 90% inliers, 6 mm",
        "map: 3 aerial points added",
        "MAV: lost",
    ]
    assert read.values("/events", "TextLog:level")[-1] == ["WARN"]


@pytest.mark.parametrize("level", LEVELS)
def test_every_level_holds_every_stream(level: str, tmp_path: Path) -> None:
    assert ReadBack(written(tmp_path / "run.rrd", level)).entities >= SHOWN | TRUE  # type: ignore[arg-type]


def test_a_level_thins_images(tmp_path: Path) -> None:
    images = {}
    for level in ("summary", "all"):
        read = ReadBack(written(tmp_path / f"{level}.rrd", level))  # type: ignore[arg-type]
        images[level] = picture(read.values("/mav/camera/image", "EncodedImage:blob")[0][0])
    assert images["all"].shape[:2] == (48, 64)
    assert images["summary"].shape[:2] == (24, 32)
