"""A stand-in replaces one stage by the truth and leaves the others alone."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import open3d as o3d
import pytest
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from airground.core.surface import AerialSurface
from evaluation.measure.protocol.error_budget import (
    STAND_INS,
    with_true_ground_map,
    with_true_heading,
    with_true_surface,
)
from evaluation.setup.condition import Condition
from evaluation.show.report.error_budget import budget_figure, budget_table
from evaluation.table.row_writer import RowWriter
from evaluation.table.rows import ResultTable
from evaluation.table.truth_errors import true_T_ground_mav
from sim.recording.true_surface import TrueSurface

CAMERA = PinholeCamera(40, 30, 30.0, 30.0, 19.5, 14.5)
DOWN = SE3.from_rotation_vector([np.pi, 0, 0], [0.5, 0.2, 2.0])
AHEAD = SE3(np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], float), np.array([-2.0, 0.0, 0.7]))
T_GROUND_WORLD = SE3.from_heading(0.4, [1.0, 2.0, 0.0])
T_MAV_WORLD = SE3.from_heading(-0.9, [0.3, -1.0, 0.5])
CONDITION = Condition("best", "slam", "nominal", "known")


class FlatTruth:
    """A floor at height zero, and two cameras that stand still."""

    def __init__(self) -> None:
        self.scene = o3d.t.geometry.RaycastingScene()
        corners = np.array([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], np.float32)
        faces = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
        self.scene.add_triangles(
            o3d.core.Tensor.from_numpy(corners), o3d.core.Tensor.from_numpy(faces)
        )

    def T_world_mav_camera(self, stamp_ns: int) -> SE3:
        return DOWN

    def T_world_ground_camera(self, stamp_ns: int) -> SE3:
        return AHEAD

    def surface(self, robot: str) -> FlatTruth:
        return self

    def cast(self, camera: PinholeCamera, T_world_camera: SE3) -> NDArray[np.float32]:
        return TrueSurface.cast(cast(TrueSurface, self), camera, DOWN)


@pytest.fixture(scope="module")
def truth() -> Any:
    return FlatTruth()


@pytest.fixture
def sighting() -> Sighting:
    """Both maps in their own frames, with errors of a few centimetres."""
    rng = np.random.default_rng(0)
    floor = np.column_stack([rng.uniform(-2, 2, (500, 2)), rng.normal(0, 0.03, 500)])
    grey = np.zeros((500, 3), np.uint8)
    T_mav_camera = T_MAV_WORLD @ DOWN
    depth = np.full((30, 40), 2.1, np.float32)
    aerial = PointCloud((T_MAV_WORLD @ floor).astype(np.float32), grey)
    surface = AerialSurface(5, 3, CAMERA, T_mav_camera, depth, aerial, 4)
    ground = PointCloud((T_GROUND_WORLD @ floor).astype(np.float32), grey)
    return Sighting(surface, ground, 5, T_mav_camera, 4, T_GROUND_WORLD @ AHEAD, 1.2)


def test_the_true_surface_is_flat_and_complete(sighting: Sighting, truth: Any) -> None:
    made = with_true_surface(sighting, truth)
    points_world = T_MAV_WORLD.inverse() @ made.surface.cloud_mav.points.astype(float)
    assert len(points_world) == CAMERA.width * CAMERA.height
    assert np.abs(points_world[:, 2]).max() < 1e-5
    assert made.ground_cloud is sighting.ground_cloud
    assert made.heading == sighting.heading


def test_the_true_ground_map_keeps_the_coverage(sighting: Sighting, truth: Any) -> None:
    made = with_true_ground_map(sighting, truth)
    here = T_GROUND_WORLD.inverse() @ made.ground_cloud.points.astype(float)
    before = T_GROUND_WORLD.inverse() @ sighting.ground_cloud.points.astype(float)
    assert np.abs(here[:, 2]).max() < 1e-5
    assert np.allclose(here[:, :2], before[:, :2], atol=1e-5)
    assert made.surface is sighting.surface


def test_the_true_heading_is_that_of_the_maps(sighting: Sighting, truth: Any) -> None:
    made = with_true_heading(sighting, truth)
    assert made.heading == pytest.approx(0.4 + 0.9)
    assert np.allclose(
        true_T_ground_mav(sighting, truth).matrix(),
        (T_GROUND_WORLD @ T_MAV_WORLD.inverse()).matrix(),
    )


def test_every_stage_of_figure_4_has_a_stand_in() -> None:
    assert len({stand_in.name for stand_in in STAND_INS}) == len(STAND_INS) == 8
    assert STAND_INS[0].poses == "slam"
    assert STAND_INS[0].change is None
    assert not STAND_INS[0].located


def test_the_table_counts_failures() -> None:
    out = RowWriter("indoor_a", 1, 0, CONDITION)
    for name, errors in (("nothing", [0.01, 0.02, np.nan]), ("all", [0.001, 0.002, 0.003])):
        for trial, error in enumerate(errors):
            out.add("budget", "translation_m", error, "m", trial=trial, note=name)
            out.add("budget", "rotation_deg", 10 * error, "deg", trial=trial, note=name)
    table = ResultTable.from_rows(out.rows)
    rows = budget_table(table).rows
    assert [row[0] for row in rows] == ["nothing", "all"]
    assert rows[0][1] == "20.0 mm\n95 %: failed"
    assert rows[0][3].startswith("66.7 %\n2 of 3")
    assert rows[1][1] == "2.0 mm\n95 %: 2.9 mm"
    assert len(list(budget_figure(table, CONDITION))) == 1
    assert not list(budget_figure(table.of_scenes(["other"]), CONDITION))
