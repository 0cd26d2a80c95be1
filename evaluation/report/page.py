"""`report.html`: one self-contained page to show a colleague, and the figures beside it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from evaluation.report import published
from evaluation.report.baselines import baseline_table
from evaluation.report.budget import budget_table
from evaluation.report.calibration import calibration_table, claims_table
from evaluation.report.failures import control_table, failures
from evaluation.report.figures import report_figures
from evaluation.report.headline import headlines
from evaluation.report.html import rendered, saved_picture
from evaluation.report.live import live_table
from evaluation.report.tables import comparison_table, scene_table, timing_table
from evaluation.report.trajectories import trajectory_table
from evaluation.results.condition import Condition, shared_parts
from evaluation.results.run_info import RunInfo
from evaluation.results.table import ResultTable
from evaluation.showcase.showcase import Showcase


def write_report(
    out: Path,
    table: ResultTable,
    showcase: Showcase | None,
    run: RunInfo,
    conditions: Sequence[Condition] | None = None,
    notes: Sequence[str] = (),
) -> None:
    """Write `report.html` and `figures/` (PNG and PDF) into `out`.

    Args:
        out: Folder of the run; made where missing.
        table: Everything that was measured.
        showcase: What the pictures are drawn from; None leaves them out.
        run: Where the results come from.
        conditions: What to show, the primary one first; None shows all of the table. The
            primary one, those of the other preset and then the rest are drawn side by side
            (four at most); all stand in the comparison.
        notes: Sentences for "What to know": what missed its mark and why.
    """
    shown = list(conditions) if conditions is not None else table.conditions()
    primary = table.of(shown[0])
    measured = primary.without_controls()
    page = rendered(
        "report.html.j2",
        condition=shown[0].label(),
        scenes=measured.scenes(),
        run=run,
        headlines=headlines(measured, run.seed),
        comparison=comparison_table(table, shown),
        shared=shared_parts(shown) if len(shown) > 1 else shown[0].label(),
        pictures=[saved_picture(f, out) for f in report_figures(table, shown, showcase)],
        trajectories=trajectory_table(table, shown),
        budget=budget_table(measured),
        baselines=baseline_table(primary),
        claims=claims_table(primary),
        calibration=calibration_table(measured),
        timing=timing_table(measured),
        live=live_table(measured),
        by_scene=scene_table(primary),
        controls=control_table(table, shown),
        failures=failures(measured),
        notes=list(notes),
        platform=published.PLATFORM,
    )
    (out / "report.html").write_text(page, encoding="utf-8")
