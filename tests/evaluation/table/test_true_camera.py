"""For which stamps the true pose of a plain folder's camera is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from airground.core.cloud import Source
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.io.open_recording import open_robot
from airground.io.tum import write_tum
from evaluation.table.true_camera import true_camera
from tests.evaluation.plain_recordings import write_tum_folder
from tests.slam.synthetic_world import ground_sequence

START_NS = 1_305_031_102_000_000_000
SECONDS = 4


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_tum_folder(tmp_path_factory.mktemp("tum"), ground_sequence(3))


def known(folder: Path, truth_ns: NDArray[np.int64], asked_ns: NDArray[np.int64]) -> NDArray:
    """(N,) whether the pose at each stamp is known, of a camera that moves along x by 1 m/s."""
    poses = [SE3(np.eye(3), [(stamp - START_NS) * 1e-9, 0, 0]) for stamp in truth_ns.tolist()]
    write_tum(folder / "groundtruth.txt", Trajectory.from_poses(truth_ns.tolist(), poses))
    at = true_camera(open_robot(folder, Source.GROUND))
    assert at is not None
    found = [at(stamp) for stamp in asked_ns.tolist()]
    for stamp, pose in zip(asked_ns.tolist(), found, strict=True):
        if pose is not None:
            assert pose.translation[0] == pytest.approx((stamp - START_NS) * 1e-9, abs=1e-6)
    return np.array([pose is not None for pose in found])


def stamps(rate_hz: float, jitter_ms: float = 0.0) -> NDArray[np.int64]:
    times = np.arange(int(SECONDS * rate_hz)) / rate_hz
    times += np.random.default_rng(0).uniform(-1e-3, 1e-3, len(times)) * jitter_ms
    # As TUM files hold them: to the microsecond.
    return START_NS + np.int64(1000) * np.rint(1e6 * (times - times[0])).astype(np.int64)


@pytest.mark.parametrize(("rate_hz", "jitter_ms"), [(20, 0), (20, 8), (10, 0), (10, 15), (200, 1)])
def test_regular_truth_is_known_throughout(folder: Path, rate_hz: float, jitter_ms: float) -> None:
    truth = stamps(rate_hz, jitter_ms)
    asked = np.arange(truth[0], truth[-1], 33_333_333)
    assert known(folder, truth, asked).all()
    assert known(folder, truth, truth).all()


def test_steps_that_rounding_made_longer_than_50_ms_are_bridged(folder: Path) -> None:
    truth = START_NS + np.arange(80, dtype=np.int64) * 50_000_128
    assert known(folder, truth, stamps(30)[:-3]).all()
    assert known(folder, truth, truth).all()


def test_a_hole_is_unknown_but_for_its_borders(folder: Path) -> None:
    truth = stamps(200)
    hole = (truth > START_NS + 1_000_000_000) & (truth < START_NS + 1_200_000_000)
    left = truth[~hole]
    asked = stamps(30)
    inside = (asked > left[left <= START_NS + 1_000_000_000][-1]) & (
        asked < left[left >= START_NS + 1_200_000_000][0]
    )
    inside_before_end = inside & (asked <= truth[-1])
    found = known(folder, left, asked)
    assert not found[inside_before_end].any()
    assert found[~inside & (asked <= truth[-1])].all()
    assert known(folder, left, left).all()


def test_a_missing_sample_of_fast_truth_is_bridged(folder: Path) -> None:
    truth = np.delete(stamps(200), [100, 101])
    assert known(folder, truth, stamps(30)[:-1]).all()


def test_truth_slower_than_the_hard_bound_is_known_at_its_stamps_only(folder: Path) -> None:
    truth = stamps(4)
    assert known(folder, truth, truth).all()
    assert not known(folder, truth, truth + 50_000_000).any()


def test_nothing_is_known_beyond_the_ends(folder: Path) -> None:
    truth = stamps(20)
    assert not known(folder, truth, np.array([truth[0] - 1_000_000, truth[-1] + 1_000_000])).any()
