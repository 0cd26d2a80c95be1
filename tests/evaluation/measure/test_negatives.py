"""Negative cases: the overlap is removed, and no position is claimed."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from airground.config import Config
from airground.core.cloud import PointCloud
from airground.core.height_map import lattice_index, make_height_map
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from evaluation.measure.protocol.mapping_pass import GroundPass, Maps
from evaluation.measure.protocol.negatives import (
    OVERLAP_LEFT,
    add_negatives,
    over_another_map,
    refine_best_guess,
    without_overlap,
)
from evaluation.measure.protocol.trials import Protocol, localize_sequence
from evaluation.table.row_writer import RowWriter
from evaluation.table.rows import ResultTable
from evaluation.table.truth_errors import true_T_ground_mav
from tests.evaluation.synthetic_results import BEST
from tests.localization.synthetic import aerial_points, box_heap, ground_points

HEADING = 2.0
T_MAV_WORLD = SE3.from_heading(-HEADING, (1.0, 2.0, 0.3))
T_GROUND_CAMERA = SE3(np.eye(3), np.array([0.3, 0.0, 0.7]))
PATH = [(-0.6, 0.2), (-0.2, 0.3), (0.2, 0.3), (0.6, 0.2)]


def cloud(points: np.ndarray) -> PointCloud:
    return PointCloud(points.astype(np.float32), np.zeros((len(points), 3), np.uint8))


@pytest.fixture(scope="module")
def sightings() -> list[Sighting]:
    """The world is the frame `ground`; the MAV's map is turned and shifted."""
    rng = np.random.default_rng(3)
    heap = box_heap(1)
    ground = cloud(ground_points(heap, rng, frames=40))
    made = []
    for stamp, (x, y) in enumerate(PATH):
        aerial = cloud(T_MAV_WORLD @ aerial_points(heap, x, y, rng, 0.1))
        T_mav_camera = T_MAV_WORLD @ SE3.from_rotation_vector((np.pi, 0, 0), (x, y, 2.2))
        surface: Any = SimpleNamespace(stamp_ns=stamp, cloud_mav=aerial, T_mav_camera=T_mav_camera)
        made.append(Sighting(surface, ground, stamp, T_mav_camera, 0, T_GROUND_CAMERA, HEADING))
    return made


@pytest.fixture(scope="module")
def stranger() -> GroundPass:
    rng = np.random.default_rng(4)
    return GroundPass(cloud(ground_points(box_heap(2), rng, frames=40)), T_GROUND_CAMERA)


@pytest.fixture(scope="module")
def truth() -> Any:
    def T_world_mav_camera(stamp_ns: int) -> SE3:
        return SE3.from_rotation_vector((np.pi, 0, 0), (*PATH[stamp_ns], 2.2))

    return SimpleNamespace(
        T_world_mav_camera=T_world_mav_camera, T_world_ground_camera=lambda _: T_GROUND_CAMERA
    )


def overlap(sighting: Sighting, truth: Any) -> float:
    """Share of the aerial cells that the ground map has, by the truth."""
    T_ground_mav = true_T_ground_mav(sighting, truth)
    aerial = make_height_map(T_ground_mav @ sighting.surface.cloud_mav.points, 25.0)
    seen = make_height_map(sighting.ground_cloud.points, 25.0, dilate_holes=False)
    cells = np.argwhere(np.isfinite(aerial.heights)) + lattice_index(aerial) - lattice_index(seen)
    inside = ((cells >= 0) & (cells < seen.heights.shape)).all(axis=1)
    x, y = cells[inside].T
    return float(np.isfinite(seen.heights[x, y]).sum() / len(cells))


def test_a_tenth_of_the_overlap_and_most_of_the_map_are_left(
    sightings: Sequence[Sighting], truth: Any
) -> None:
    for sighting in sightings:
        assert overlap(sighting, truth) > 0.5
        lost = without_overlap([sighting], truth)
        # Cells at the edge are cut through.
        assert 0.02 < overlap(lost, truth) < OVERLAP_LEFT + 0.03
        assert len(lost.ground_cloud) > 1000
        kept = {tuple(point) for point in sighting.ground_cloud.points.tolist()}
        assert {tuple(point) for point in lost.ground_cloud.points.tolist()} < kept
        assert lost.surface is sighting.surface


@pytest.mark.parametrize("which", ["surface", "ground"])
def test_maps_without_points_are_unchanged(
    sightings: Sequence[Sighting], truth: Any, which: str
) -> None:
    one, empty = sightings[0], PointCloud.empty()
    surface: Any = SimpleNamespace(**{**vars(one.surface), "cloud_mav": empty})
    ground = empty if which == "ground" else one.ground_cloud
    bare = Sighting(
        surface if which == "surface" else one.surface, ground, 0, one.T_mav_camera, 0,
        T_GROUND_CAMERA, HEADING,
    )  # fmt: skip
    assert without_overlap([bare], truth) is bare


def test_no_position_is_claimed_in_a_negative_case(
    sightings: list[Sighting], stranger: GroundPass, truth: Any
) -> None:
    out = RowWriter("heap", 1, 0, BEST)
    protocol = Protocol(sequences=1, trials=2, sequence_length=4)
    add_negatives(out, Maps(sightings), stranger, truth, Config(), (1, 0), protocol)
    table = ResultTable.from_rows(out.rows)
    for stage in ("no_overlap", "wrong_map"):
        claimed, accepted = table.rows(stage, "converged"), table.rows(stage, "accepted")
        assert (len(claimed), len(accepted)) == (4, 2)
        assert claimed["value"].sum() == accepted["value"].sum() == 0
        assert (claimed["note"] != "").all()
        assert (accepted["note"] != "").all()
    assert set(table.frame["stage"]) == {"no_overlap", "wrong_map"}
    assert len(table.rows("no_overlap", "error_m")) == 4
    assert len(table.rows("wrong_map", "error_m")) == 0


def test_a_position_is_claimed_with_the_right_map(sightings: list[Sighting], truth: Any) -> None:
    """Else nothing would follow from claiming nothing."""
    rng = np.random.default_rng(1)
    steps = [step for *_, step in localize_sequence(sightings, truth, Config(), rng) if step]
    assert steps[-1].belief.converged, steps[-1].belief.refusal
    assert steps[-1].error.horizontal_m < 0.1
    alignment = refine_best_guess(sightings[-1], Config(), np.random.default_rng(2))
    assert alignment.accepted, alignment.refusal


def test_another_map_has_the_pose_of_its_own_robot(
    sightings: list[Sighting], stranger: GroundPass
) -> None:
    lost = over_another_map(sightings[0], stranger)
    assert lost.ground_cloud is stranger.cloud_ground
    assert lost.T_ground_camera is stranger.T_ground_camera
    assert lost.surface is sightings[0].surface


def test_without_a_stranger_only_the_overlap_case_is_measured(
    sightings: list[Sighting], truth: Any
) -> None:
    out = RowWriter("heap", 1, 0, BEST)
    protocol = Protocol(sequences=1, trials=1, sequence_length=1)
    add_negatives(out, Maps(sightings[:1]), None, truth, Config(), (1, 0), protocol)
    assert {row.stage for row in out.rows} == {"no_overlap"}
