"""Front ends beside each other: on a real recording where there is one, on a made one always."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from airground.config import Config
from airground.core.cloud import Source
from airground.io.open_recording import open_robot
from airground.slam.front_ends import GROUND, Ingredients, make_front_end
from evaluation import cli
from evaluation.run.own_recordings import run_alone
from evaluation.show.figures.front_ends import FrontEndError, draw_front_ends, front_end_error
from evaluation.table.true_camera import true_camera
from tests.evaluation.plain_recordings import write_tum_folder
from tests.slam.synthetic_world import ground_sequence

REAL = Path(__file__).parents[4] / "shared" / "real" / "tum_fr1_rpy_head"


def errors_of(folder: Path, *names: str) -> dict[str, FrontEndError | None]:
    """Each front end over the ground robot's recording."""
    recording = open_robot(folder, Source.GROUND)
    true_pose = true_camera(recording)
    assert true_pose is not None
    found = {}
    for name in names:
        given = Ingredients(recording.calibration, Config(), np.random.default_rng(0))
        result = run_alone(recording, make_front_end(GROUND, name, given))
        found[name] = front_end_error(recording, name, result, true_pose)
    return found


@pytest.mark.slow
@pytest.mark.skipif(not REAL.is_dir(), reason=f"real recording {REAL.name} is not here")
def test_slam_keeps_a_real_turning_kinect_and_beats_open3d_frame_to_frame() -> None:
    ours, theirs = errors_of(REAL, "slam", "open3d").values()
    assert ours is not None
    assert theirs is not None
    assert ours.tracked == 1.0
    assert ours.rms_cm < 4
    assert ours.rms_cm < 0.5 * theirs.rms_cm


@pytest.mark.slow
def test_the_picture_and_a_table_for_each_front_end(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, out = write_tum_folder(tmp_path / "made", ground_sequence()), tmp_path / "out"
    with pytest.raises(SystemExit) as exit_:
        cli.main(["track", str(folder), "--front-end", "slam", "opencv", "--out", str(out)])
    assert exit_.value.code == 0
    said = capsys.readouterr().out
    assert said.index("front end slam") < said.index("front end opencv")
    summary = json.loads((out / "slam" / "summary.json").read_text())
    assert summary["error"]["live"]["ate_se3_rmse_m"] < 0.01
    assert (out / "front_ends.png").stat().st_size > 10_000


def test_without_truth_or_with_too_few_poses_nothing_is_drawn(tmp_path: Path) -> None:
    folder = write_tum_folder(tmp_path / "made", ground_sequence(4))
    recording = open_robot(folder, Source.GROUND)
    given = Ingredients(recording.calibration, Config(), np.random.default_rng(0))
    result = run_alone(recording, make_front_end(GROUND, "opencv", given))
    draw_front_ends(tmp_path, recording, {"opencv": result}, None)
    assert front_end_error(recording, "opencv", result, lambda stamp_ns: None) is None
    draw_front_ends(tmp_path, recording, {"opencv": result}, lambda stamp_ns: None)
    assert not list(tmp_path.glob("*.png"))
    draw_front_ends(tmp_path, recording, {"opencv": result}, true_camera(recording))
    assert (tmp_path / "front_ends.png").exists()
