"""A lidar's scans: against the true surface, and as other tools read them."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import open3d as o3d
import pytest

from airground.core.se3 import SE3
from airground.errors import InputError
from evaluation.cli import answer
from evaluation.datasets.simulated import Simulated
from sim.recording.lidar_scan import lidar_scan, scan_starts_ns
from sim.sensors.lidar import Lidar

EXACT = Lidar(noise_m=0.0)


def fastest(simulated: Simulated, lidar: Lidar) -> int:
    """Number of the scan during which the robot moves farthest."""
    poses = simulated.truth.motion
    starts_ns = scan_starts_ns(simulated.truth, lidar).tolist()
    steps = [
        (poses.pose("ground", start).inverse() @ poses.pose("ground", start + lidar.revolution_ns))
        for start in starts_ns
    ]
    steps_m = [float(np.linalg.norm(step.translation)) for step in steps]
    assert max(steps_m) > 0.02
    return int(np.argmax(steps_m))


def scan(
    simulated: Simulated, lidar: Lidar, index: int | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Points of a scan, by default of the fastest, and their places (N, 3) in the world, each by
    its own pose."""
    truth = simulated.truth
    index = fastest(simulated, lidar) if index is None else index
    start_ns = int(scan_starts_ns(truth, lidar)[index])
    points = lidar_scan(truth, lidar, start_ns, np.random.default_rng(1))
    T_body_lidar = lidar.mounting(truth.motion.ground.mounting.T_body_camera)
    times, which = np.unique(points["time_ns"], return_inverse=True)
    poses = [truth.motion.pose("ground", start_ns + int(t)) @ T_body_lidar for t in times]
    places = np.stack([points[axis] for axis in "xyz"], axis=1).astype(np.float64)
    world = np.array([poses[k] @ place for k, place in zip(which, places, strict=True)])
    return points, world


def test_points_lie_on_the_surface(simulated: Simulated) -> None:
    points, world = scan(simulated, EXACT)
    assert len(points) > 0.3 * EXACT.beams * EXACT.columns
    assert simulated.truth.surface("ground").distance(world).max() < 1e-4


def test_noise_is_along_the_beam_and_of_its_size(simulated: Simulated) -> None:
    exact, _ = scan(simulated, EXACT)
    noisy, _ = scan(simulated, Lidar(noise_m=0.02))
    both = {(p["ring"], p["time_ns"]): p for p in exact}
    pairs = [(both[key], p) for p in noisy if (key := (p["ring"], p["time_ns"])) in both]
    a, b = (np.array([[p[i][axis] for axis in "xyz"] for p in pairs]) for i in (0, 1))
    ranges = np.linalg.norm(a, axis=1), np.linalg.norm(b, axis=1)
    assert np.abs(np.cross(a, b)).max() / (ranges[0] * ranges[1]).max() < 1e-5
    errors = ranges[1] - ranges[0]
    assert abs(errors.std() / 0.02 - 1) < 0.02
    assert abs(errors.mean()) < 0.02 * 4 / np.sqrt(len(errors))


def test_level_ground_is_where_geometry_says(simulated: Simulated) -> None:
    points, world = scan(simulated, EXACT, index=0)
    floor = (points["ring"] == 0) & (np.abs(world[:, 2]) < 1e-3)
    T_body_lidar = EXACT.mounting(simulated.truth.motion.ground.mounting.T_body_camera)
    height = (simulated.truth.motion.pose("ground", 0) @ T_body_lidar).translation[2]
    ranges = np.linalg.norm([points[axis][floor] for axis in "xyz"], axis=0)
    assert floor.sum() > 100
    # The robot tilts by a few tenths of a degree as it drives.
    np.testing.assert_allclose(ranges, height / np.sin(np.radians(45.0)), rtol=5e-3)
    np.testing.assert_allclose(points["intensity"][floor], np.sin(np.radians(45.0)), atol=5e-3)


def test_times_are_those_of_a_turning_head(simulated: Simulated) -> None:
    points, _ = scan(simulated, EXACT)
    assert (np.diff(points["time_ns"].astype(np.int64)) >= 0).all()
    azimuth = np.arctan2(points["y"], points["x"]) % (2 * np.pi)
    expected = points["time_ns"] / EXACT.revolution_ns * 2 * np.pi
    turned = (azimuth - expected + np.pi) % (2 * np.pi) - np.pi
    assert np.abs(turned).max() < 1e-3


def test_the_command_writes_what_open3d_reads(simulated: Simulated, tmp_path: Path) -> None:
    words = ["render", str(simulated.recording.path), "--add", "lidar", "--every", "9"]
    assert answer([*words, "--beams", "16", "--out", str(tmp_path)]) in (None, 0)
    folder = tmp_path / "ground_lidar"
    sensor = tomllib.loads((folder / "sensor.toml").read_text())
    assert sensor["beams"] == 16
    assert SE3.from_matrix(np.array(sensor["T_body_lidar"])).translation[2] > 0.15
    files = sorted(folder.glob("*.pcd"), key=lambda file: int(file.stem))
    read = o3d.t.io.read_point_cloud(str(files[1]))
    expected = lidar_scan(
        simulated.truth,
        Lidar(beams=16),
        int(files[1].stem),
        np.random.default_rng([*seeds(simulated), 3, 10]),
    )
    for axis, name in enumerate("xyz"):
        np.testing.assert_array_equal(read.point.positions.numpy()[:, axis], expected[name])
    for name in ("intensity", "ring", "time_ns"):
        np.testing.assert_array_equal(read.point[name].numpy()[:, 0], expected[name])


def seeds(simulated: Simulated) -> tuple[int, int]:
    return simulated.recording.header.seed, simulated.recording.header.flight


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--add", "lidar", "--beams", "8"), "beams must be from 16 to 128, got 8"),
        (("--add", "lidar", "--robot", "mav"), "the ground robot carries it"),
        (("--add", "depth", "--beams", "64"), "--beams: only with --add lidar"),
        (("--add", "radar"), "known: depth, normals, segmentation, flow, lidar"),
    ],
)
def test_wrong_words(simulated: Simulated, words: tuple[str, ...], message: str) -> None:
    with pytest.raises(InputError, match=message):
        answer(["render", str(simulated.recording.path), *words])
