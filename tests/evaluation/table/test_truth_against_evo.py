"""Errors against truth at any rate, with jitter and gaps: ours and evo's from the same files."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from evo.core import metrics, sync
from evo.tools import file_interface
from numpy.typing import NDArray

from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.io.tum import format_stamp, write_tum
from evaluation import cli

START_NS = 1_305_031_102_000_000_000
IMAGES, IMAGE_PERIOD_NS = 90, 50_000_000
NOISE_M = 0.01
MAX_DIFF_S = 0.01
"""evo's default: an estimate is compared with the nearest true pose at most this far away."""
GAP_S = (1.72, 2.13)
"""A gap in the truth: eight images lie in it."""
CALIBRATION = """\
resolution: [32, 24]
intrinsics: [30.0, 30.0, 15.5, 11.5]
distortion_model: none
"""


def true_pose(time_s: float) -> SE3:
    """A camera that sways by half a metre and turns."""
    x, y, z = 0.5 * np.sin(1.3 * time_s), 0.4 * np.cos(0.9 * time_s), 0.2 * np.sin(2 * time_s)
    return SE3.from_rotation_vector((0.1 * x, 0.2 * y, 0.3 * time_s), (x, y, z))


def image_stamps() -> NDArray[np.int64]:
    return START_NS + IMAGE_PERIOD_NS * np.arange(IMAGES, dtype=np.int64)


def write_path(file: Path, stamps: NDArray[np.int64], noise_m: float = 0.0) -> None:
    """True poses at some stamps, with noise, in a frame of their own where there is noise."""
    rng = np.random.default_rng(1)
    own = SE3.from_heading(0.7, (3.0, -1.0, 0.5)) if noise_m else SE3.identity()
    poses = []
    for stamp in stamps.tolist():
        pose = own @ true_pose((stamp - START_NS) * 1e-9)
        poses.append(SE3(pose.rotation, pose.translation + noise_m * rng.normal(size=3)))
    write_tum(file, Trajectory.from_poses(stamps.tolist(), poses))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A TUM folder of small images, and `estimate.tum` with a pose for each."""
    root = tmp_path_factory.mktemp("tum")
    lines = []
    for kind, pixels in (("rgb", np.zeros((24, 32, 3), np.uint8)), ("depth", None)):
        (root / kind).mkdir()
        picture = np.full((24, 32), 5000, np.uint16) if pixels is None else pixels
        for stamp in image_stamps().tolist():
            cv2.imwrite(str(root / kind / f"{format_stamp(stamp)}.png"), picture)
    for stamp in image_stamps().tolist():
        time = format_stamp(stamp)
        lines.append(f"{time} rgb/{time}.png {time} depth/{time}.png")
    (root / "associations.txt").write_text("\n".join(lines) + "\n")
    (root / "calibration.yaml").write_text(CALIBRATION)
    write_path(root / "estimate.tum", image_stamps(), NOISE_M)
    return root


def truth_stamps(rate_hz: int, jitter_ns: int, gap: bool) -> NDArray[np.int64]:
    """Stamps of true poses from the first image to the last."""
    last_s = (IMAGES - 1) * IMAGE_PERIOD_NS * 1e-9
    times = np.arange(0, round(last_s * rate_hz) + 1) / rate_hz
    if gap:
        times = times[(times < GAP_S[0]) | (times > GAP_S[1])]
    stamps = START_NS + np.rint(times * 1e9).astype(np.int64)
    rng = np.random.default_rng(2)
    jittered: NDArray[np.int64] = stamps + rng.integers(-jitter_ns, jitter_ns + 1, len(stamps))
    return jittered


def errors(folder: Path, out: Path) -> tuple[int, float, int, float]:
    """Number of compared poses and RMS error after SE3 [m]: ours, then evo's."""
    words = ("track", folder, "--trajectory", folder / "estimate.tum", "--out", out)
    with pytest.raises(SystemExit) as ended:
        cli.main([str(word) for word in words])
    assert ended.value.code == 0
    ours = json.loads((out / "summary.json").read_text())["error"]["final"]
    true = file_interface.read_tum_trajectory_file(str(folder / "groundtruth.txt"))
    made = file_interface.read_tum_trajectory_file(str(out / "trajectory.tum"))
    reference, estimate = sync.associate_trajectories(true, made, max_diff=MAX_DIFF_S)
    estimate.align(reference)
    error = metrics.APE(metrics.PoseRelation.translation_part)
    error.process_data((reference, estimate))
    rmse = error.get_statistic(metrics.StatisticsType.rmse)
    return ours["poses"], ours["ate_se3_rmse_m"], estimate.num_poses, float(rmse)


@pytest.mark.parametrize("gap", [False, True], ids=["whole", "gap"])
@pytest.mark.parametrize("jitter_ns", [0, 1_000], ids=["exact", "jitter"])
@pytest.mark.parametrize("rate_hz", [20, 100, 200])
def test_as_many_poses_as_evo_and_the_same_error(
    folder: Path, tmp_path: Path, rate_hz: int, jitter_ns: int, gap: bool
) -> None:
    write_path(folder / "groundtruth.txt", truth_stamps(rate_hz, jitter_ns, gap))
    ours, our_rmse_m, theirs, their_rmse_m = errors(folder, tmp_path / "out")
    assert ours == theirs == (82 if gap else IMAGES)
    assert our_rmse_m == pytest.approx(their_rmse_m, abs=1e-5)


@pytest.mark.parametrize("jitter_ns", [0, 1_000], ids=["exact", "jitter"])
def test_slow_truth_is_interpolated_where_evo_leaves_images_out(
    folder: Path, tmp_path: Path, jitter_ns: int
) -> None:
    write_path(folder / "groundtruth.txt", truth_stamps(10, jitter_ns, gap=False))
    ours, our_rmse_m, theirs, their_rmse_m = errors(folder, tmp_path / "out")
    # The last image comes half a period after the last true pose.
    assert (ours, theirs) == (IMAGES - 1, IMAGES // 2)
    assert our_rmse_m == pytest.approx(their_rmse_m, rel=0.1)


def test_slow_truth_with_a_gap_is_not_interpolated_across_it(folder: Path, tmp_path: Path) -> None:
    write_path(folder / "groundtruth.txt", truth_stamps(10, 1_000, gap=True))
    ours, our_rmse_m, theirs, their_rmse_m = errors(folder, tmp_path / "out")
    assert ours == IMAGES - 1 - 9  # from 1.75 s to 2.15 s
    assert theirs == IMAGES // 2 - 4
    assert our_rmse_m == pytest.approx(their_rmse_m, rel=0.1)


@pytest.mark.parametrize("rate_hz", [100, 200])
def test_images_between_the_true_poses_are_compared_too(
    folder: Path, tmp_path: Path, rate_hz: int
) -> None:
    stamps = truth_stamps(rate_hz, 1_000, gap=False) - 2_300_000
    write_path(folder / "groundtruth.txt", stamps)
    ours, our_rmse_m, theirs, their_rmse_m = errors(folder, tmp_path / "out")
    assert theirs == IMAGES
    assert ours in (IMAGES - 1, IMAGES)  # the last image lies 2.3 ms beyond the truth
    # evo compares with a true pose up to 2.5 ms away: 1.5 mm of path.
    assert our_rmse_m == pytest.approx(their_rmse_m, rel=0.03)
