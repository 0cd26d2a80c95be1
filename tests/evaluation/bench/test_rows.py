"""Rows and peers of the benchmark do the work that they stand for, on a small surface."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import KDTree

from airground.core.cloud import Source
from airground.core.events import Event, GroundTracked, MavTracked
from airground.core.se3 import SE3
from airground.errors import InputError
from airground.io.png import decode_png
from evaluation.bench import dense_rows, floors, localization_rows, peers, simulation_rows
from evaluation.bench.curves import CURVES, exponent, tiled
from evaluation.bench.floors import Floor, Speed
from evaluation.bench.lane import Lane
from evaluation.bench.machine import LoadMeter
from evaluation.bench.material import PARTS, Material, MemoryLog
from evaluation.bench.rows import NAMES, ROWS, checked_names
from evaluation.bench.run import timed_curve, timed_row
from evaluation.bench.work import take_turn
from evaluation.run.onlooker import Seen
from evaluation.setup.memory import AddedMemory
from tests.evaluation.bench.material import T_GROUND_MAV, make_material

SPEED = Speed(threads=1, bandwidth_gb_s=1e3, arithmetic_gflop_s=1e4)
"""Faster than any machine that runs these tests."""


@pytest.fixture(scope="module")
def material(tmp_path_factory: pytest.TempPathFactory) -> Material:
    return make_material(tmp_path_factory.mktemp("bench") / "recording")


@pytest.fixture(scope="module", autouse=True)
def _small_flight() -> Iterator[None]:
    """The simulator's rows over a scene that is soon built."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(simulation_rows, "SCENE", "tiny")
        patch.setattr(simulation_rows, "DURATION_S", 8.0)
        yield
    simulation_rows.simulated.cache_clear()


def test_views_at_one_place_do_not_show_the_depth_and_are_swept_all_the_same(
    material: Material,
) -> None:
    here = material.reference.T_mav_camera
    views = [replace(view, T_mav_camera=here) for view in material.views]
    work = dense_rows.add_frame(replace(material, views=views))
    take_turn(work, 0.0)
    near_m, far_m = material.depth_range()
    assert 0 < near_m < far_m


def test_two_rows_are_timed_on_both_lanes_with_their_peers(material: Material) -> None:
    lanes = {1: Lane(material), 2: Lane(material)}
    speeds = {1: SPEED, 2: Speed(2, 2e3, 2e4)}
    by_name = {row.name: row for row in ROWS}
    result = timed_row(by_name["cost_map"], lanes, speeds, 0.3)
    assert [lane.threads for lane in result.lanes] == [1, 2]
    assert all(lane.timing.n >= 3 for lane in result.lanes)
    assert {peer.name for peer in result.peers} == {peer.name for peer in by_name["cost_map"].peers}
    assert result.missing_peers == ()
    one, two = (lane.floor_ms for lane in result.lanes)
    assert one is not None
    assert two == pytest.approx(one / 2)
    assert result.best.timing.least_ms > two
    height_map = timed_row(by_name["height_map"], lanes, speeds, 0.1)
    assert height_map.published_ms is None
    assert "points" in height_map.size


LONG = ("headings", "headings_channels")


@pytest.mark.parametrize(
    "row",
    [
        pytest.param(row, id=row.name, marks=pytest.mark.slow if row.name in LONG else ())
        for row in ROWS
    ],
)
def test_every_row_and_its_peers_run_above_their_floor(material: Material, row) -> None:
    work = row.make(material)
    samples = take_turn(work, 0.0) + take_turn(work, 0.0)
    assert work.size
    if work.floor is not None:
        assert 0 < work.floor.least_ms(SPEED) < min(sample.wall_ms for sample in samples)
    for peer in row.peers:
        assert take_turn(peer.make(material), 0.0)[0].wall_ms > 0


def test_the_simulators_rows_make_the_images_of_a_recording(material: Material) -> None:
    flight = simulation_rows.simulated()
    index, time_ns = flight.indices("mav")[0], flight.times_ns("mav")[0]
    picture, depth = simulation_rows.draw("mav", material).run()
    _, rng = flight.maker.start("mav", index)
    exposed = flight.maker.expose("mav", picture, depth, time_ns, rng)
    np.testing.assert_array_equal(exposed[..., 0], flight.maker.mav(index))
    packed = simulation_rows.encode_grey(material).run()
    np.testing.assert_array_equal(decode_png(packed), flight.maker.mav(index))


def test_adding_frames_begins_anew_when_all_views_are_in(material: Material) -> None:
    work = next(row for row in ROWS if row.name == "add_frame").make(material)
    for _ in range(2 * len(material.views) + 1):
        work.before()
        work.run()


def test_scikit_image_finds_the_place_that_our_cost_map_finds(material: Material) -> None:
    config = localization_rows.paper_sized(cost="ncc")
    maps = localization_rows.Maps(material, config)
    ours = maps.search().cost_map("ncc").best()
    shift_cells = peers.masked_correlation(material).run()[0]
    # It gives the shift between the middles of both maps.
    shift_cells = shift_cells + 0.5 * np.subtract(
        maps.ground.heights.shape, maps.aerial.heights.shape
    )
    theirs = maps.ground.origin - maps.aerial.origin + shift_cells / maps.ground.cells_per_m
    np.testing.assert_allclose(theirs, ours, atol=0.05)


def test_opencv_finds_the_place_that_our_cost_map_finds(material: Material) -> None:
    config = localization_rows.paper_sized(cost="ncc")
    maps = localization_rows.Maps(material, config)
    ours = maps.search().cost_map("ncc").best()
    scores = peers.match_template(material).run()
    cell = np.unravel_index(np.argmax(scores), scores.shape)
    theirs = maps.ground.origin - maps.aerial.origin + np.array(cell) / maps.ground.cells_per_m
    np.testing.assert_allclose(theirs, ours, atol=0.05)


def test_open3d_aligns_as_ours_does(material: Material) -> None:
    found = localization_rows.icp(material).run().T_ground_mav
    theirs = peers.open3d_icp(material).run().transformation
    np.testing.assert_allclose(theirs, found.matrix(), atol=0.05)
    np.testing.assert_allclose(found.matrix(), T_GROUND_MAV.matrix(), atol=0.03)


def test_open3d_extracts_the_surface_that_ours_casts(material: Material) -> None:
    work = dense_rows.VoxelWork(material.depth_maps, material.config)
    ours = work.all_of_it().points
    theirs = peers.integrate_and_extract(material).run().point.positions.numpy()
    assert len(theirs) > 1000
    distance, _ = KDTree(theirs).query(ours)
    assert np.median(distance) < 0.03


def test_refinement_starts_as_far_off_as_the_papers_trials(material: Material) -> None:
    off = localization_rows.start_of(material) @ T_GROUND_MAV.inverse()
    centre = T_GROUND_MAV @ material.surface.cloud_mav.points.mean(axis=0, dtype=np.float64)
    assert np.rad2deg(off.angle()) == pytest.approx(3.0)
    assert np.linalg.norm(off @ centre - centre) == pytest.approx(0.2)


def test_the_floor_is_the_slower_of_memory_and_arithmetic() -> None:
    speed = Speed(threads=1, bandwidth_gb_s=1, arithmetic_gflop_s=10)
    assert Floor(2e6, 1e6).least_ms(speed) == pytest.approx(2.0)
    assert Floor(1e3, 5e7).least_ms(speed) == pytest.approx(5.0)
    assert Floor(1, 2) + Floor(3, 4) * 2 == Floor(7, 10)


def test_all_cores_are_as_fast_as_one() -> None:
    assert Speed(2, 3, 10).at_least(Speed(1, 2, 50)) == Speed(2, 3, 50)


def test_floors_count_what_must_move() -> None:
    voxels = 376 * 240 * 150
    # A word of 4 bytes a voxel in and out; five fields in and out, and the counts in.
    assert floors.distance_field(voxels).bytes_moved == 8 * voxels
    assert floors.fusion(voxels, 8, 8).bytes_moved == 44 * voxels
    # 16-bit costs of 200 planes, read and written.
    assert floors.add_frame(376 * 240, 200).bytes_moved == 4 * 376 * 240 * 200
    assert floors.transforms(1024, 9).operations == 2.5 * 1024 * 10 * 9
    turned, straight = (floors.particles(100, 200, turned) for turned in (True, False))
    assert turned.operations > straight.operations


@pytest.mark.parametrize("curve", CURVES, ids=lambda curve: curve.name)
def test_curves_run_at_every_value(material: Material, curve) -> None:
    values = curve.values if curve.name != "voxels" else (0.05, 0.1)
    for value in values[:2]:
        assert take_turn(curve.make(material, value), 0.0)[0].wall_ms > 0


def test_a_curve_is_timed_and_fitted(material: Material) -> None:
    curve = next(curve for curve in CURVES if curve.name == "particles")
    result = timed_curve(curve, Lane(material), 0.2)
    assert [point.value for point in result.points] == list(curve.values)
    assert 0.2 < result.exponent < 1.5


def test_the_exponent_of_a_power_law_is_found() -> None:
    values = np.array([1.0, 2.0, 5.0, 30.0])
    assert exponent(values, 3.0 * values**1.7) == pytest.approx(1.7)


def test_a_tiled_map_is_so_many_times_as_large(material: Material) -> None:
    cloud = material.ground_cloud
    larger = tiled(cloud, 3)
    assert len(larger) == 3 * len(cloud)
    assert np.ptp(larger.points[:, 0]) > 3 * np.ptp(cloud.points[:, 0])
    np.testing.assert_array_equal(larger.points[: len(cloud)], cloud.points)


def test_peak_memory_counts_touched_pages_only() -> None:
    with AddedMemory() as touched:
        np.ones(8_000_000).sum()
    with AddedMemory() as untouched:
        np.empty(8_000_000)
    if touched.mib is None or untouched.mib is None:
        pytest.skip("this system does not count memory")
    assert touched.mib == pytest.approx(61, abs=4)
    assert untouched.mib < 4


def see(log: MemoryLog, event: Event) -> None:
    log.see(Seen(event, 0.0, None, None))


def test_memory_is_read_after_each_tenth_of_the_recording(material: Material) -> None:
    stamps_ns = material.recording.of(Source.GROUND).camera_stamps
    log = MemoryLog(material.recording, [os.getpid()])
    for stamp_ns in stamps_ns:
        see(log, MavTracked(int(stamp_ns), SE3.identity()))
    assert log.resident_mib == []
    for stamp_ns in stamps_ns[:-1]:
        see(log, GroundTracked(int(stamp_ns), SE3.identity()))
    assert len(log.resident_mib) < PARTS
    see(log, GroundTracked(int(stamps_ns[-1]), SE3.identity()))
    assert len(log.resident_mib) == PARTS
    assert min(log.resident_mib) > 10


def test_the_load_of_others_leaves_out_our_own() -> None:
    meter, started, own = LoadMeter(), time.monotonic(), time.process_time()
    while time.monotonic() < started + 0.5:
        sum(range(1000))
    others = meter.other_cores()
    busy = (time.process_time() - own) / (time.monotonic() - started)
    if others is None:
        pytest.skip("this system does not count the load")
    # The system counts in hundredths of a second.
    assert 0 <= others <= (os.cpu_count() or 1) - busy + 0.2


def test_unknown_rows_are_named() -> None:
    with pytest.raises(InputError, match=r"--rows nonsense: unknown; known: .*cost_map"):
        checked_names(["cost_map", "nonsense"])
    assert checked_names([]) == NAMES
    assert checked_names(["icp", "mono_slam"]) == ("mono_slam", "icp")


def test_our_ground_map_has_all_points_that_open3d_finds(material: Material) -> None:
    ours = dense_rows.ground_surface(material).run()
    theirs = peers.extract_ground(material).run().point.positions.numpy()
    # The floor lies on the voxels exactly: Open3D leaves it out.
    assert len(ours) > len(theirs) > 1000
    assert KDTree(ours.points).query(theirs)[0].max() == 0
