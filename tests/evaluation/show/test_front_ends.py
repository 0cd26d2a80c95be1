"""Front ends beside each other: on a real recording where there is one, on a made one always."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from airground.config import Config
from airground.core.cloud import Source
from airground.errors import InputError
from airground.io.open_recording import open_robot
from evaluation.show.figures.front_ends import front_end_error, main
from tests.evaluation.plain_recordings import write_tum_folder
from tests.slam.synthetic_world import ground_sequence

REAL = Path(__file__).parents[4] / "shared" / "real" / "tum_fr1_rpy_head"


@pytest.mark.slow
@pytest.mark.skipif(not REAL.is_dir(), reason=f"real recording {REAL.name} is not here")
def test_slam_keeps_a_real_turning_kinect_and_beats_open3d_frame_to_frame() -> None:
    recording = open_robot(REAL, Source.GROUND)
    ours = front_end_error(recording, "slam", Config())
    theirs = front_end_error(recording, "open3d", Config())
    assert ours.tracked == 1.0
    rms = [float(np.sqrt(np.mean(one.error_m**2))) for one in (ours, theirs)]
    assert rms[0] < 0.08
    assert rms[0] < 0.5 * rms[1]


@pytest.mark.slow
def test_the_picture_and_a_line_for_each_front_end(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = write_tum_folder(tmp_path / "made", ground_sequence())
    main([str(folder), "ground", "slam", "opencv", "--out", str(tmp_path / "both.png")])
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == ["slam", "opencv"]
    assert float(lines[0].split()[1]) < 1.0  # cm
    assert (tmp_path / "both.png").stat().st_size > 10_000


def test_a_recording_without_truth_is_refused(tmp_path: Path) -> None:
    folder = write_tum_folder(tmp_path / "made", ground_sequence())
    (folder / "groundtruth.txt").unlink()
    with pytest.raises(InputError, match="no ground truth"):
        front_end_error(open_robot(folder, Source.GROUND), "slam", Config())
