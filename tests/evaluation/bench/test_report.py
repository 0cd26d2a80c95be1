"""The benchmark's report: JSON and back, the table, and the pictures."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.text import Text
from rich.console import Console

from airground.errors import InputError
from evaluation import cli
from evaluation.bench.floors import Speed
from evaluation.bench.machine import LoadAverage
from evaluation.bench.picture import bench_figure, curves_figure
from evaluation.bench.publish import (
    BEGIN,
    END,
    body,
    header,
    markdown,
    print_table,
    publish,
    with_table,
)
from evaluation.bench.report import (
    KIND,
    SCHEMA,
    BenchReport,
    CurvePointTiming,
    CurveResult,
    LaneTiming,
    Machine,
    PeerTiming,
    RealTime,
    RecordingInfo,
    RecordingSpeed,
    RowResult,
    Timing,
)
from evaluation.bench.work import Sample
from evaluation.judge.live_summary import live_summary
from evaluation.setup.checked_json import read_checked
from tests.evaluation.synthetic_results import live_rows


def timing(median_ms: float) -> Timing:
    times = median_ms * np.array([0.9, 1.0, 1.0, 1.0, 1.3])
    return Timing.of([[Sample(t, 1.8 * t) for t in times]])


def row(name: str, median_ms: float, published_ms: float | None, **more: object) -> RowResult:
    return RowResult(
        name=name,
        title=f"Stage {name}",
        group="Dense" if name < "c" else "Global",
        size="752 x 480 px",
        published_ms=published_ms,
        published_on="GPU" if name < "c" else "CPU",
        target_ms=9,
        lanes=[
            LaneTiming(threads=1, timing=timing(1.7 * median_ms), floor_ms=0.4 * median_ms),
            LaneTiming(threads=2, timing=timing(median_ms), floor_ms=0.2 * median_ms),
        ],
        **more,
    )


@pytest.fixture
def report() -> BenchReport:
    peer = PeerTiming(name="Other", differs="does less", timing=timing(40.0), times_ours=4.0)
    return BenchReport(
        schema=SCHEMA,
        version="0.1",
        git_revision="abc",
        date="2026-01-01T00:00:00+00:00",
        seconds_a_row=1.0,
        machine=Machine(
            cpu="CPU",
            cores=2,
            speeds=[
                Speed(threads=1, bandwidth_gb_s=20, arithmetic_gflop_s=100),
                Speed(threads=2, bandwidth_gb_s=30, arithmetic_gflop_s=200),
            ],
            load_before=LoadAverage(0.1, 0.2, 0.3),
            load_after=LoadAverage(1.1, 0.2, 0.3),
            other_cores=0.25,
        ),
        recording=RecordingInfo(scene="tiny", seed=0, sensors="nominal", duration_s=34),
        rows=[
            row("a", 10.0, 5.0),
            row("b", 100.0, 800.0, peers=[peer], peak_memory_mib=50.0),
            row("c", 4.0, None, missing_peers=["scikit-image"]),
        ],
        pipeline=[
            RealTime(
                threads=2, recorded_s=34, processing_s=17, cpu_s=30, real_time_factor=2,
                peak_memory_mib=700, resident_mib=[800, 1000, 900],
            )
        ],
        live=live_summary(live_rows(mav_dropped=3)),
        recordings=[
            RecordingSpeed(
                scene="indoor_a", sensors="real", threads=2, recorded_s=60, wall_s=75, cpu_s=140,
                recorded_s_a_second=0.8, cpu_ms_an_image=38.9, mib_a_minute=1500,
            )
        ],
        curves=[
            CurveResult(
                name="voxels",
                title="Surface",
                parameter="voxels [millions]",
                points=[CurvePointTiming(value=v, timing=timing(20 * v)) for v in (1, 2, 4)],
                exponent=1.0,
                cpu_exponent=0.9,
            )
        ],
    )  # fmt: skip


def texts(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.findobj(Text) if isinstance(text, Text)]


def test_json_round_trip(report: BenchReport, tmp_path: Path) -> None:
    path = tmp_path / "bench.json"
    path.write_text(report.to_json(), encoding="utf-8")
    assert read_checked(BenchReport, path, KIND) == report
    assert json.loads(report.to_json())["schema"] == SCHEMA


def test_another_schema_or_no_json_is_refused(report: BenchReport, tmp_path: Path) -> None:
    path = tmp_path / "bench.json"
    path.write_text(report.to_json().replace('"schema": 1', '"schema": 2'), encoding="utf-8")
    with pytest.raises(InputError, match="schema"):
        read_checked(BenchReport, path, KIND)
    path.write_text("{", encoding="utf-8")
    with pytest.raises(InputError, match="no benchmark"):
        read_checked(BenchReport, path, KIND)
    with pytest.raises(InputError, match="cannot be read"):
        read_checked(BenchReport, tmp_path / "nothing.json", KIND)


def test_a_timing_holds_the_median_the_95th_percentile_and_the_count() -> None:
    one = Timing.of([[Sample(t, 2 * t) for t in (1.0, 2.0)], [Sample(9.0, 0.5)]])
    assert (one.n, one.median_ms, one.least_ms, one.mean_ms) == (3, 2.0, 1.0, 4.0)
    assert one.p95_ms == pytest.approx(8.3)
    assert one.cpu_median_ms == 2.0


def test_the_table_shows_paper_target_floor_and_peer(report: BenchReport) -> None:
    lines = body(report)
    assert all(len(line) == len(header(report)) for line in lines)
    second = dict(zip(header(report), lines[1], strict=True))
    assert second["stage [ms]"] == "Stage b"
    assert second["2 cores"] == "100, 124 (5)"
    assert second["paper"] == "800 GPU"
    assert second["floor"] == "20"
    assert second["peer"] == "Other 40 (4.0x)"
    assert second["memory"] == "50 MiB"


def test_what_is_printed_states_the_conditions(report: BenchReport) -> None:
    out = io.StringIO()
    print_table(report, Console(file=out, width=200))
    shown = out.getvalue()
    assert "real-time factor 2.00" in shown
    assert (
        "2 cores: 800 to 1000 MiB held after the tenths of the recording, at the end 900" in shown
    )
    assert (
        "2 cores: 60 s of indoor_a with real sensors simulated in 75.0 s: 0.80 recorded seconds "
        "per second, 38.9 ms of processor time per image, 1500 MiB per minute"
    ) in shown
    assert "live, images dropped: MAV 3 of 7, ground robot 0 of 4" in shown
    assert "live, peak memory, all processes: 1100 MiB" in shown
    assert "other programs: 0.25 cores busy" in shown
    assert "measured under load" in shown
    assert "scikit-image not installed" in shown
    assert "voxels [millions]: power 1.00, of processor time 0.90" in shown
    assert "stage [ms]" in shown


def test_an_idle_machine_needs_no_excuse(report: BenchReport) -> None:
    idle = report.machine.model_copy(update={"other_cores": 0.02})
    shown = markdown(report.model_copy(update={"machine": idle}))
    assert "under load" not in shown
    assert "other programs: 0.02 cores busy" in shown


def test_markdown_is_a_table_of_even_width(report: BenchReport) -> None:
    lines = [line for line in markdown(report).splitlines() if line.startswith("| Stage")]
    assert len(lines) == 3
    assert {line.count("|") for line in lines} == {len(header(report)) + 1}


def test_the_docs_get_the_table_and_the_pictures(report: BenchReport, tmp_path: Path) -> None:
    results, docs = tmp_path / "results", tmp_path / "docs"
    results.mkdir()
    (docs / "pictures").mkdir(parents=True)
    (results / "bench.json").write_text(report.to_json(), encoding="utf-8")
    page = docs / "speed.md"
    page.write_text(f"Before\n{BEGIN}\nold\n{END}\nAfter\n", encoding="utf-8")
    publish(results, docs)
    publish(results, docs)
    shown = page.read_text(encoding="utf-8")
    assert shown == f"Before\n{BEGIN}\n\n{markdown(report)}\n{END}\nAfter\n"
    pictures = sorted(path.name for path in (docs / "pictures").iterdir())
    assert pictures == ["bench.png", "bench_curves.png"]
    with pytest.raises(InputError, match="has no lines"):
        with_table("a page without marks", report)


def test_the_page_of_the_docs_can_be_refreshed(report: BenchReport) -> None:
    page = (Path(__file__).parents[3] / "docs" / "speed.md").read_text(encoding="utf-8")
    assert markdown(report) in with_table(page, report)


def test_bars_end_at_the_medians_and_turn_dark_up_to_the_floor(report: BenchReport) -> None:
    axes = bench_figure(report).axes[0]
    bars = [bar for bar in axes.patches if isinstance(bar, Rectangle) and bar.get_height() > 0]
    ends = {round(bar.get_x() + bar.get_width(), 6) for bar in bars if bar.get_width() > 0}
    assert {10.0, 100.0, 4.0} <= ends
    assert {2.0, 20.0, 0.8} <= ends
    diamonds = [line for line in axes.lines if line.get_marker() == "D" and len(line.get_xdata())]
    assert sorted(float(line.get_xdata()[0]) for line in diamonds) == [5.0, 800.0]


def test_the_picture_names_rows_groups_and_conditions(report: BenchReport) -> None:
    shown = texts(bench_figure(report))
    assert {"Stage a", "Stage b", "Stage c", "Dense", "Global"} <= set(shown)
    assert any("busy with other programs meanwhile: 0.2 cores" in text for text in shown)


def test_curves_show_their_power(report: BenchReport) -> None:
    assert {"power 1.00", "CPU 0.90"} <= set(texts(curves_figure(report)))


def test_an_unknown_row_is_one_clear_line(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as exit_:
        cli.main(["bench", "--rows", "cost_map,nonsense"])
    assert exit_.value.code == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.splitlines()[-1].startswith("airground: error: --rows nonsense: unknown")


def test_a_negative_time_and_an_existing_folder_are_refused(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    for words in (["--seconds-a-row", "-1"], ["--out", str(tmp_path)]):
        with pytest.raises(SystemExit) as exit_:
            cli.main(["bench", *words])
        assert exit_.value.code == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert lines[0].startswith("airground: error: --seconds-a-row -1: must be")
    assert "exists already" in lines[1]
