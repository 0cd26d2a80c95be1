"""The short table on the screen at the end of a run."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from evaluation.realtime.live_summary import LiveSummary
from evaluation.report.live import live_rows
from evaluation.results.summary import Summary
from evaluation.trust.claims import ALL


def print_summary(summary: Summary, console: Console | None = None) -> None:
    """Print the headline numbers of a summary beside the paper's."""
    poses = {"oracle": "oracle poses", "slam": "poses from SLAM"}[summary.poses]
    shown = Table(
        title=f"{', '.join(summary.scenes)}: preset {summary.preset}, {poses}",
        caption="same protocol, simulated; the paper: real robots",
        title_justify="left",
        caption_justify="left",
    )
    shown.add_column("")
    shown.add_column("here", justify="right", style="bold")
    shown.add_column("paper", justify="right")
    for row in _rows(summary):
        shown.add_row(*row)
    console = console or Console()
    console.print(shown)
    if summary.realtime is not None:
        console.print(_live(summary.realtime))


def _live(summary: LiveSummary) -> Table:
    shown = Table(title="live", caption="latencies: median, 95 %, worst", title_justify="left")
    for header in ("", "MAV", "ground robot"):
        shown.add_column(header, justify="right" if header else "left")
    for row in live_rows(summary):
        shown.add_row(*row)
    return shown


def _rows(summary: Summary) -> list[tuple[str, str, str]]:
    localization, refinement = summary.localization, summary.refinement
    within = (
        ("within 0.5 m after 1 aerial map", localization.within_0_50_m, 1, "65 %"),
        ("within 0.25 m after 4", localization.within_0_25_m, 4, "89 %"),
    )
    rows = [("sequences", str(localization.sequences), "41")]
    for title, shares, iteration, paper in within:
        share = shares[iteration - 1] if len(shares) >= iteration else None
        rows.append((title, _percent(share), paper))
    after = refinement.after
    rows += [
        ("refinement trials", str(refinement.trials), "67"),
        ("refined, median position", _millimetres(after.translation_m.median), "76 mm"),
        ("refined, median angle", _text(after.rotation_deg.median, "{:.2f}°"), "3.0°"),
        ("refined within 5 cm and 2°", _percent(refinement.within_5cm_2deg), "-"),
        *_claims(summary),
        ("fused surface, median error", _millimetres(summary.surface.error_median_m), "-"),
        ("fused surface, completeness", _percent(summary.surface.completeness), "-"),
        ("recorded s / processing s", _text(summary.real_time_factor, "{:.2f}"), "real time"),
    ]
    return rows


def _claims(summary: Summary) -> list[tuple[str, str, str]]:
    """Over all cases, those without a place to find included."""
    every = summary.claims.localization.get(ALL) if summary.claims is not None else None
    if every is None:
        return []
    return [
        ("localizations that claim a place", _percent(every.accepted.share), "-"),
        ("wrong among them, all cases", _percent(every.wrong.share), "-"),
    ]


def _text(value: float | None, form: str) -> str:
    return "-" if value is None else form.format(value)


def _percent(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.1f} %"


def _millimetres(value: float | None) -> str:
    return "-" if value is None else f"{1e3 * value:.1f} mm"
