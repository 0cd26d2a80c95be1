"""The report: self-contained, complete, honest about what failed."""

import base64
import io
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from evaluation.judge.claims import localization_claims
from evaluation.judge.metrics import METRICS
from evaluation.judge.readings import rate
from evaluation.setup.condition import Condition, RunInfo
from evaluation.setup.text import degrees, metres
from evaluation.show.report.failures import control_table, failures
from evaluation.show.report.figures import report_figures
from evaluation.show.report.page import write_report
from evaluation.show.report.tables import comparison_table, headlines, scene_table, timing_table
from evaluation.show.report.trajectories import trajectory_figures, trajectory_table
from evaluation.table.rows import ResultTable, Row
from tests.evaluation.synthetic_results import BEST, DRIFT, LITERAL, PAPER, SCENES, make_table

RUN = RunInfo("0.1.0", "abc1234", 7, "some <processor>", 2)


@pytest.fixture(scope="module")
def table() -> ResultTable:
    return make_table(conditions=(BEST, LITERAL, PAPER))


@pytest.fixture(scope="module")
def page(table: ResultTable, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    out = tmp_path_factory.mktemp("report")
    write_report(out, table, None, RUN, notes=["Something <missed> its mark."])
    return out, (out / "report.html").read_text(encoding="utf-8")


def test_the_page_needs_nothing_from_outside(page: tuple[Path, str]) -> None:
    out, html = page
    assert re.findall(r'src="(?!data:)[^"]*"', html) == []
    links = re.findall(r'href="(?!#)([^"]*)"', html)
    made_later = {"results.parquet", "summary.json", "config.toml"}
    assert made_later < set(links)
    assert {name for name in links if not (out / name).is_file()} == made_later
    assert "<script" not in html
    assert not re.search(r"url\(|@import", html)


def test_captions_say_where_refinements_started(table: ResultTable) -> None:
    def captions(shown: ResultTable) -> list[str]:
        drawn = report_figures(shown, [BEST], None)
        return [figure.caption for figure in drawn if "refinement" in figure.name]

    of_a_run = table.frame[~table.frame["metric"].str.startswith("from_truth")]
    assert all("start from the true pose with Gaussian noise" in c for c in captions(table))
    assert all("where the particles place it" in c for c in captions(ResultTable(of_a_run)))


def test_every_figure_is_embedded_and_saved(page: tuple[Path, str]) -> None:
    out, html = page
    embedded = re.findall(r'src="data:image/webp;base64,([^"]+)"', html)
    saved = sorted(path.stem for path in (out / "figures").glob("*.png"))
    assert saved == sorted(path.stem for path in (out / "figures").glob("*.pdf"))
    assert saved == [
        "calibration",
        "fig11_localization_error",
        "fig12_spread",
        "fig13_refinement_translation",
        "fig14_refinement_angle",
        "table1_timing",
    ]
    assert len(embedded) == len(saved)
    for data in embedded:
        assert Image.open(io.BytesIO(base64.b64decode(data))).format == "WEBP"
    assert len(html) < 8e6


def test_text_from_outside_is_escaped(page: tuple[Path, str]) -> None:
    _, html = page
    assert "some &lt;processor&gt;" in html
    assert "Something &lt;missed&gt; its mark." in html


def test_the_page_says_that_it_is_simulated_and_under_which_conditions(
    page: tuple[Path, str],
) -> None:
    _, html = page
    assert "Same protocol, simulated." in html
    assert BEST.label() in html
    for published in ("89 %", "65 %", "76 mm", "3.0°"):
        assert published in html


def test_the_comparison_has_a_column_for_the_paper_and_each_condition(table: ResultTable) -> None:
    made = comparison_table(table, table.conditions())
    assert made.header == ("", "paper (real robots)", "preset best", "preset paper_literal",
                           "preset paper")  # fmt: skip
    assert {len(row) for row in made.rows} == {5}
    cells = {row[0]: row for row in made.rows}
    errors = table.of(LITERAL).scored().sequences("error_m")[4].to_numpy(float)
    good = int((errors <= 0.25).sum())
    assert f"{good} of {len(errors)};" in cells["within 0.25 m after 4 maps"][3]
    assert cells["refined, median"][1] == "76 mm, 3.0°"


def test_claims_and_calibration_have_their_sections(page: tuple[Path, str]) -> None:
    _, html = page
    for anchor in ("claims", "calibration_table", "calibration"):
        assert html.count(f'id="{anchor}"') == 1
    assert html.count('href="#claims"') == html.count('href="#calibration_table"') == 1
    assert "another scene&#39;s ground map" in html
    assert "true position in the 90 % ellipse" in html


def test_what_was_not_measured_has_no_row(table: ResultTable) -> None:
    names = [row[0] for row in comparison_table(table, [BEST]).rows]
    assert "MAV: live, RMS error" not in names


def test_poses_that_were_not_tracked_have_no_table(table: ResultTable) -> None:
    assert trajectory_table(table, [BEST]).rows == ()


def test_drift_is_shown_where_it_was_measured() -> None:
    rows = [Row("indoor_a", 1, 0, DRIFT, "trajectory", "mav_ate_se3_rmse_m", 0.0123, "m")]
    made = comparison_table(ResultTable.from_rows(rows), [DRIFT])
    assert ("MAV: live, RMS error", "12 mm", "12.3 mm") in made.rows


def test_a_place_with_the_wrong_heading_is_not_a_pose() -> None:
    off = [(0.1, 2.9), (0.1, 3.1), (0.3, 1.0), (np.nan, np.nan)]
    rows = [
        Row("indoor_a", 1, 0, BEST, "localization", metric, value, unit, n, iteration=4)
        for n, errors in enumerate(off)
        for metric, value, unit in zip(("error_m", "error_deg"), errors, ("m", "deg"), strict=True)
    ]
    made = rate(METRICS["posed_4"], ResultTable.from_rows(rows))
    assert (made.successes, made.total) == (1, 4)
    without = [row for row in rows if row.metric != "error_deg"]
    assert rate(METRICS["posed_4"], ResultTable.from_rows(without)).total == 0


def test_every_failure_is_listed_with_its_reason(table: ResultTable) -> None:
    part = table.of(LITERAL).scored()
    made = failures(part)
    errors = part.sequences("error_m")[4].to_numpy(float)
    listed = [failure for failure in made if failure.kind == "sequence"]
    assert len(listed) == int((~(errors <= 0.25)).sum())
    assert all(failure.said for failure in made)
    assert len({failure.key for failure in made}) == len(made)


def test_every_failure_leads_to_what_happened(table: ResultTable, page: tuple[Path, str]) -> None:
    _, html = page
    listed = failures(table.of(BEST).scored())
    assert listed
    for failure in listed:
        assert html.count(failure.title) == 1
    hopeless = failures(table.of(LITERAL).scored())
    sequence = next(failure for failure in hopeless if failure.kind == "sequence")
    assert [row[0] for row in sequence.story.rows] == [str(n) for n in range(1, 13)]
    assert sequence.result.startswith(sequence.story.rows[3][2])


def test_failures_lead_to_the_run_in_rerun_where_it_was_kept(
    table: ResultTable, page: tuple[Path, str], tmp_path: Path
) -> None:
    _, html = page
    assert ("run RECORDING --rerun" in html, "red crosses" in html) == (True, False)
    (tmp_path / "run.rrd").touch()
    write_report(tmp_path, table, None, RUN)
    kept = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert ("run RECORDING --rerun" in kept, "red crosses" in kept) == (False, True)


def test_a_failure_says_when_it_happened_and_how_to_open_that_moment(
    table: ResultTable, tmp_path: Path
) -> None:
    frame = table.frame.copy()
    of_maps = frame["stage"].isin(["localization", "refinement"])
    frame.loc[of_maps, "time_s"] = 10.0 + frame["iteration"].astype("float64").fillna(0.5)
    timed = ResultTable(frame)
    made = failures(timed.of(BEST).scored())
    for failure in made:
        assert failure.at_s == (14.0 if failure.kind == "sequence" else 10.5)
        assert failure.kind == "refinement" or failure.story.rows[3][1] == "14.00 s"
    (tmp_path / "run.rrd").touch()
    write_report(tmp_path, timed, None, RUN)
    html = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert html.count("airground view FOLDER --at 1") == len(made)


def test_a_sequence_without_estimate_is_a_failure() -> None:
    rows = [
        Row("indoor_a", 1, 0, BEST, "localization", metric, value, "", 0, i, note="no overlap")
        for i in range(1, 5)
        for metric, value in (("error_m", np.nan), ("converged", 0.0))
    ]
    (made,) = failures(ResultTable.from_rows(rows))
    assert made.title == "sequence 0 of indoor_a, seed 1, flight 0"
    assert made.result == "no estimate after 4"
    assert made.said == "no overlap"


def test_claims_are_counted_and_checked() -> None:
    rows = []
    for sequence, (error, converged) in enumerate([(0.1, 1), (0.9, 1), (0.9, 0), (np.nan, 0)]):
        for metric, value in (("error_m", error), ("converged", converged)):
            rows.append(Row("a", 1, 0, BEST, "localization", metric, value, "", sequence, 1))
    made = localization_claims(ResultTable.from_rows(rows))["found"]
    assert (made.accepted.successes, made.accepted.total) == (2, 4)
    assert (made.wrong.successes, made.wrong.total) == (1, 2)


def test_the_control_scene_is_judged_by_what_it_claims(table: ResultTable) -> None:
    made = control_table(table, table.conditions())
    assert [row[2] for row in made.rows] == ["0 of 3"] * 3
    assert "particles are spread" in made.rows[0][3]


def test_scenes_stand_side_by_side(table: ResultTable) -> None:
    made = scene_table(table.of(BEST).scored())
    assert [row[0] for row in made.rows] == list(SCENES)


def test_the_timing_table_says_what_was_not_run(table: ResultTable) -> None:
    rows = {row[0]: row for row in timing_table(table.of(BEST)).rows}
    assert rows["Egomotion: Monocular SLAM, a frame"][1:] == ("14 (CPU)", "not run", "-", "-", "0")
    assert rows["Dense reconstruction: Fusion, 8 iterations"][1] == "800 (GPU)"


def test_few_cases_are_no_percentage(table: ResultTable) -> None:
    frame = table.of(BEST).scored().frame
    one = frame[(frame["scene"] == "indoor_a") & (frame["flight"] == 0)]
    one = one[(one["sequence"].fillna(0) < 1) & (one["trial"].fillna(0) < 1)]
    tiles = {line.title: line for line in headlines(ResultTable(one))}
    assert tiles["within 0.25 m after 4 maps"].value in ("0 of 1", "1 of 1")
    assert not any("%" in line.value for line in tiles.values())
    assert tiles["refined position"].detail == "of 1 trial only"


def test_failures_come_before_the_figures(page: tuple[Path, str], tmp_path: Path) -> None:
    _, html = page
    assert 0 < html.index('id="failures"') < html.index('id="figures"')
    assert html.count('id="failures"') == html.count('href="#failures"') == 1


def test_every_table_has_a_caption_and_a_file_for_latex(page: tuple[Path, str]) -> None:
    out, html = page
    assert html.count("<table") == html.count("<caption>")
    made = {path.stem: path.read_text(encoding="utf-8") for path in (out / "tables").iterdir()}
    assert {"comparison", "timing", "by_scene", "claims", "calibration"} <= set(made)
    for text in made.values():
        assert text.startswith(r"\begin{tabular}")
        assert r"\bottomrule" in text
        assert not re.search(r"(?<!\\)[%_#$°]", text)


def test_the_values_behind_a_figure_are_beside_it(page: tuple[Path, str]) -> None:
    out, _ = page
    errors = pd.read_csv(out / "figures" / "fig11_localization_error.csv")
    assert set(errors["metric"]) == {"error_m"}
    assert {path.stem for path in (out / "figures").glob("*.csv")} == {
        path.stem for path in (out / "figures").glob("*.pdf")
    }


def test_alternative_texts_say_what_is_seen(page: tuple[Path, str]) -> None:
    _, html = page
    texts = re.findall(r'<img [^>]*alt="([^"]*)"', html)
    (fig11,) = [text for text in texts if "% of sequences within 0.25 m" in text]
    assert fig11.startswith("3 panels: ")
    assert "preset best" in fig11
    assert "iteration (number of aerial maps)" in fig11


def test_headlines_leave_out_what_was_not_measured(table: ResultTable) -> None:
    measured = table.of(BEST).scored()
    assert len(headlines(measured)) == 7
    only_timing = ResultTable(measured.frame[measured.frame["stage"] == "timing"])
    assert headlines(only_timing) == []


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0123, "12.3 mm"), (0.25, "0.25 m"), (np.inf, "failed"), (np.nan, "-"), (0.0, "0.0 mm")],
)
def test_lengths_are_written_for_people(value: float, text: str) -> None:
    assert metres(value) == text


def test_angles_are_written_for_people() -> None:
    assert (degrees(0.123), degrees(np.inf)) == ("0.12°", "failed")


def test_poses_from_slam_get_figures_and_a_table_with_their_alignment() -> None:
    condition = Condition("best", "slam", "nominal", "known")
    rows = []
    for seed, size in enumerate((0.004, 0.02, 0.006)):
        where = ("indoor_a", seed, 0, condition)
        rows += [
            Row(*where, "trajectory", "mav_ate_se3_rmse_m", size, "m"),
            Row(*where, "trajectory", "mav_scale_error", -size, ""),
            Row(*where, "trajectory", "mav_path_m", 20.0, "m"),
        ]
        for tenth in range(30):
            error = float("nan") if tenth < 5 else size
            for metric in ("mav_error_m", "mav_final_error_m"):
                time_s = tenth / 10
                rows.append(Row(*where, "trajectory_error", metric, error, "m", time_s=time_s))
    table = ResultTable.from_rows(rows)
    (figure,) = trajectory_figures(table, [condition])
    assert figure.name == "fig09_mav_error"
    titles = [axes.get_title(loc="left") for axes in figure.figure.axes]
    assert titles == [
        "median run (indoor_a, seed 2, flight 0): RMS 0.60 cm live, 0.60 cm final",
        "worst run (indoor_a, seed 1, flight 0): RMS 2.00 cm live, 2.00 cm final",
    ]
    cells = {row[0]: row[1:] for row in trajectory_table(table, [condition]).rows}
    assert cells["MAV: live, RMS error"] == (
        "SE3, scale not corrected", "12 mm", "6.0 mm\nworst of 3: 20.0 mm",
    )  # fmt: skip
    assert cells["MAV: live, scale error (absolute)"][2] == "0.60 %\nworst of 3: 2.00 %"
    assert not any(name.startswith("ground") for name in cells)
