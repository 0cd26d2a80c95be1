"""summary.json holds to the contract, and its numbers to a plain calculation."""

import json
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from airground.errors import InputError
from evaluation.judge.summary import Summary, build_summary
from evaluation.setup.condition import Condition, RunInfo
from evaluation.show.report.screen import print_summary
from evaluation.table.rows import ResultTable, Row
from tests.evaluation.synthetic_results import BEST, PAPER, SCENES, make_table

RUN = RunInfo("0.1.0", "abc1234", 7, "some processor", 2)


@pytest.fixture(scope="module")
def table() -> ResultTable:
    return make_table()


def test_every_key_of_the_contract_is_there(table: ResultTable, tmp_path: Path) -> None:
    build_summary(table, BEST, RUN).write(tmp_path / "summary.json")
    made = json.loads((tmp_path / "summary.json").read_text())
    assert list(made) == [
        "schema", "version", "git_revision", "preset", "poses", "seed", "level", "scenes",
        "machine", "slam", "surface", "localization", "refinement", "timing_ms",
        "real_time_factor", "realtime", "claims", "calibration", "reproduction",
    ]  # fmt: skip
    assert made["machine"] == {"cpu": "some processor", "cores": 2}
    promised = {"ate_sim3_rmse_m", "ate_se3_rmse_m", "scale_error", "tracked_fraction", "path_m"}
    assert promised < set(made["slam"]["mav"])
    assert {"final_ate_se3_rmse_m", "worst_ate_se3_rmse_m", "nees_pose"} < set(made["slam"]["mav"])
    assert set(made["slam"]["ground"]) == set(made["slam"]["mav"])
    assert set(made["surface"]) == {"error_median_m", "error_p90_m", "completeness"}
    quantiles = {"median", "q25", "q75", "p95"}
    assert set(made["localization"]["error_m"]) == quantiles
    assert set(made["localization"]["spread_m"]) == quantiles
    assert set(made["refinement"]["after"]["rotation_deg"]) == quantiles
    assert set(made["timing_ms"]) == {
        "mono_slam", "rgbd_slam", "add_frame", "distance_field", "fusion", "ray_cast",
        "cost_map", "particles", "icp",
    }  # fmt: skip
    assert set(made["timing_ms"]["icp"]) == {"mean", "median", "p95", "n"}


def test_numbers_agree_with_a_plain_calculation(table: ResultTable) -> None:
    made = build_summary(table, PAPER, RUN)
    frame = table.of(PAPER).frame
    frame = frame[frame["scene"].isin(SCENES)]
    fourth = frame[(frame["metric"] == "error_m") & (frame["iteration"] == 4)]["value"].to_numpy()
    assert made.localization.sequences == len(fourth)
    assert made.localization.within_0_25_m[3] == pytest.approx(np.mean(fourth <= 0.25))
    assert made.localization.error_m.median[3] == pytest.approx(np.median(fourth))
    after = frame[frame["metric"] == "after_translation_m"]["value"]
    assert made.refinement.after.translation_m.p95 == pytest.approx(np.quantile(after, 0.95))
    assert made.timing_ms.icp.n == 3 * 2 * 12
    recorded = frame[frame["metric"] == "recorded_s"]["value"].sum()
    processing = frame[frame["metric"] == "processing_s"]["value"].sum()
    assert made.real_time_factor == pytest.approx(recorded / processing)


def test_it_is_read_back_as_written(table: ResultTable, tmp_path: Path) -> None:
    made = build_summary(table, BEST, RUN)
    made.write(tmp_path / "summary.json")
    assert Summary.read(tmp_path / "summary.json") == made


def test_oracle_poses_leave_slam_null(table: ResultTable) -> None:
    slam = build_summary(table, BEST, RUN).slam
    assert set(slam.mav.model_dump().values()) == {None}
    assert set(slam.ground.model_dump().values()) == {None}


def test_slam_poses_fill_slam() -> None:
    condition = Condition("best", "slam", "nominal", "known")
    errors = [0.01, 0.002, 0.05]
    rows = [
        Row("indoor_a", seed, 0, condition, "trajectory", metric, value, "m")
        for seed, error in enumerate(errors)
        for metric, value in (
            ("mav_ate_se3_rmse_m", error),
            ("mav_final_ate_se3_rmse_m", np.nan if seed == 1 else error / 2),
            ("mav_scale_error", -error if seed else error),
            ("mav_tracked_fraction", 1 - error),
            ("ground_path_m", 7.7),
        )
    ]
    made = build_summary(ResultTable.from_rows(rows), condition, RUN)
    mav, ground = made.slam.mav, made.slam.ground
    assert made.poses == "slam"
    assert (mav.ate_se3_rmse_m, mav.worst_ate_se3_rmse_m) == (0.01, 0.05)
    assert (mav.final_ate_se3_rmse_m, mav.worst_final_ate_se3_rmse_m) == (0.025, None)
    assert mav.scale_error == 0.01
    assert mav.least_tracked_fraction == pytest.approx(0.95)
    assert (ground.path_m, ground.scale_error) == (7.7, None)


def test_failures_count_and_become_null_not_infinity(tmp_path: Path) -> None:
    errors = [0.1, np.nan, np.nan]
    rows = [
        Row("indoor_a", 1, 0, BEST, "localization", "error_m", error, "m", sequence, 1)
        for sequence, error in enumerate(errors)
    ]
    made = build_summary(ResultTable.from_rows(rows), BEST, RUN)
    assert made.localization.within_0_25_m == [pytest.approx(1 / 3)]
    assert made.localization.error_m.median == [None]
    made.write(tmp_path / "summary.json")
    assert "Infinity" not in (tmp_path / "summary.json").read_text()


def test_a_refused_alignment_is_no_success() -> None:
    values = {"after_translation_m": 0.001, "after_rotation_deg": 0.1}
    rows = [
        Row("indoor_a", 1, 0, BEST, "refinement", metric, value, "", trial=trial)
        for trial in range(2)
        for metric, value in (*values.items(), ("accepted", float(trial)))
    ]
    assert build_summary(ResultTable.from_rows(rows), BEST, RUN).refinement.within_5cm_2deg == 0.5


def test_a_condition_that_was_not_measured_is_named() -> None:
    other = Condition("best", "slam", "harsh", "known")  # the table has oracle poses only
    with pytest.raises(InputError, match="nothing was measured with preset best, poses from SLAM"):
        build_summary(make_table(sequences=1, conditions=(BEST,)), other, RUN)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"seed": "many"}, "seed"),
        ({"extra": 1}, "extra"),
        ({"schema": 2}, "schema"),
        ({"localization": {"iterations": 3}}, "localization"),
    ],
)
def test_a_broken_summary_is_one_clear_line(
    table: ResultTable, tmp_path: Path, change: dict, complaint: str
) -> None:
    path = tmp_path / "summary.json"
    build_summary(table, BEST, RUN).write(path)
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(InputError, match=complaint) as caught:
        Summary.read(path)
    assert "\n" not in str(caught.value)


def test_lists_must_have_one_entry_per_iteration(table: ResultTable, tmp_path: Path) -> None:
    path = tmp_path / "summary.json"
    build_summary(table, BEST, RUN).write(path)
    content = json.loads(path.read_text())
    content["localization"]["within_0_25_m"].pop()
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match="one entry per iteration"):
        Summary.read(path)


def test_the_screen_shows_our_numbers_beside_the_papers(table: ResultTable) -> None:
    console = Console(width=100, record=True, file=None, quiet=False)
    with console.capture() as captured:
        print_summary(build_summary(table, BEST, RUN), console)
    text = captured.get()
    assert "within 0.25 m after 4" in text
    assert "89 %" in text
    assert "76 mm" in text


def test_the_screen_gives_the_commonest_reason_of_refusals(table: ResultTable) -> None:
    frame = table.frame.copy()
    for stage, metric, notes in (
        ("localization", "converged", ["split: 0.3 m", "split: 0.4 m", "flat: 2 mm"]),
        ("refinement", "accepted", ["no overlap: 3 %"]),
    ):
        rows = frame.index[(frame["stage"] == stage) & (frame["metric"] == metric)]
        frame.loc[rows, ["value", "note"]] = [1.0, ""]
        for row, note in zip(rows, notes, strict=False):
            frame.loc[row, ["value", "note"]] = [0.0, note]
    summary = build_summary(ResultTable(frame), BEST, RUN)
    assert summary.claims is not None
    assert summary.claims.localization_refusals == {"split": 2, "flat": 1}
    console = Console(width=100, record=True, file=None, quiet=False)
    with console.capture() as captured:
        print_summary(summary, console)
    assert "split: 2 of 3" in captured.get()
    assert "no overlap: 1 of 1" in captured.get()


def test_an_unknown_preset_is_refused() -> None:
    table = ResultTable(make_table(conditions=(BEST,)).frame.assign(preset="odd"))
    with pytest.raises(InputError, match="unknown preset 'odd'"):
        build_summary(table, table.conditions()[0], RunInfo("0.1.0", "abc", 0, "some CPU", 2))
