"""The short tables on the screen at the end of a run, and the table of live runs."""

from __future__ import annotations

from collections.abc import Callable

from rich.console import Console

from evaluation.judge.claims import ALL
from evaluation.judge.live_summary import DEADLINE_MS, Latency, LiveRobot, LiveSummary, live_summary
from evaluation.judge.metrics import METRICS
from evaluation.judge.poses import ROBOTS, SlamRobot
from evaluation.judge.summary import Summary
from evaluation.setup.text import (
    MISSING,
    TextTable,
    degrees,
    formatted,
    metres,
    percent,
    print_table,
    seconds,
)
from evaluation.show.report.tables import SEQUENCES, TRIALS
from evaluation.table.rows import ResultTable


def print_summary(summary: Summary, console: Console | None = None) -> None:
    """Print the headline numbers of a summary beside the paper's."""
    poses = {"oracle": "oracle poses", "slam": "poses from SLAM"}[summary.poses]
    level = "" if summary.level is None else f", level {summary.level}"
    print_table(
        TextTable(("", "here", "paper"), tuple(_rows(summary))),
        f"{', '.join(summary.scenes)}{level}: preset {summary.preset}, {poses}",
        "same protocol, simulated; the paper: real robots",
        console=console,
        bold=(1,),
    )
    if summary.realtime is not None:
        live = TextTable(("", "MAV", "ground robot"), live_rows(summary.realtime))
        print_table(live, "live", "latencies: median, 95 %, worst", console=console)


def _rows(summary: Summary) -> list[tuple[str, str, str]]:
    localization, refinement, surface = summary.localization, summary.refinement, summary.surface
    after = refinement.after
    values = {
        "within_50cm_1": percent(_at(localization.within_0_50_m, 1)),
        "within_25cm_4": percent(_at(localization.within_0_25_m, 4)),
        "refined_translation": metres(after.translation_m.median),
        "refined_rotation": degrees(after.rotation_deg.median),
        "refined_well": percent(refinement.within_5cm_2deg),
        "surface_median": metres(surface.error_median_m),
        "completeness": percent(surface.completeness),
    }
    metrics = [(METRICS[name].title, text, METRICS[name].paper) for name, text in values.items()]
    return [
        ("sequences", str(localization.sequences), SEQUENCES),
        ("refinement trials", str(refinement.trials), TRIALS),
        *metrics,
        *_claims(summary),
        *_poses("mav", summary.slam.mav),
        *_poses("ground", summary.slam.ground),
        ("recorded s / processing s", formatted(summary.real_time_factor, "{:.2f}"), "real time"),
    ]


def _at(shares: list[float], iteration: int) -> float | None:
    return shares[iteration - 1] if len(shares) >= iteration else None


def _claims(summary: Summary) -> list[tuple[str, str, str]]:
    """Over all cases, those without a place to find included."""
    claims = summary.claims
    every = claims.localization.get(ALL) if claims is not None else None
    if claims is None or every is None:
        return []
    return [
        ("localizations that claim a place", percent(every.accepted.share), MISSING),
        ("wrong among them, all cases", percent(every.wrong.share), MISSING),
        *_commonest("localizations", claims.localization_refusals),
        *_commonest("refinements", claims.refinement_refusals),
    ]


def _commonest(what: str, refusals: dict[str, int]) -> list[tuple[str, str, str]]:
    """The commonest reason of a stage's refusals; nothing without any."""
    if not refusals:
        return []
    reason, count = next(iter(refusals.items()))
    return [(f"{what} refused, mostly", f"{reason}: {count} of {sum(refusals.values())}", MISSING)]


def _poses(robot: str, poses: SlamRobot) -> list[tuple[str, str, str]]:
    """One robot's own poses; nothing where an oracle gave them."""
    if poses.tracked_fraction is None:
        return []
    title, paper = ROBOTS[robot], METRICS[f"{robot}_trajectory"].paper
    return [
        (f"{title}: live, RMS error after SE3", metres(poses.ate_se3_rmse_m), paper),
        (f"{title}: live, RMS error over 1 m", metres(poses.rpe_1m_rmse_m), MISSING),
        (f"{title}: tracked, from the first motion", percent(poses.tracked_fraction), MISSING),
        (f"{title}: first pose after", seconds(poses.initialized_s), MISSING),
    ]


def live_table(table: ResultTable) -> TextTable:
    """Measures of the live runs in a table; no rows where there was none."""
    summary = live_summary(table)
    rows = live_rows(summary) if summary is not None else ()
    return TextTable(("", "MAV", "ground robot"), rows)


def live_rows(summary: LiveSummary) -> tuple[tuple[str, str, str], ...]:
    """Title, MAV, ground robot; the mapper's measures stand once for both."""
    mav, ground = summary.mav, summary.ground

    def each(title: str, cell: Callable[[LiveRobot], str]) -> tuple[str, str, str]:
        return title, cell(mav), cell(ground)

    rows = [
        each("images dropped", lambda robot: f"{robot.dropped} of {robot.images}"),
        each("frames not mapped", _unmapped),
        each("pose after its image", lambda robot: _latency(robot.posed_ms)),
        each(f"poses later than {DEADLINE_MS:.0f} ms", lambda robot: str(robot.deadlines_missed)),
        each("mapped after its image", lambda robot: _latency(robot.mapped_ms)),
        ("surface located after its last image", _latency(summary.aligned_ms), ""),
        each("most images waiting", lambda robot: str(robot.longest_queue)),
        each("most frames before the mapper", lambda robot: str(robot.most_under_way)),
        each("sent to the mapper", lambda robot: formatted(robot.mbit_s, "{:.2f} Mbit/s")),
        each("processor, of one core", lambda robot: percent(robot.processor_share, 0)),
        ("processor, mapper", "", percent(summary.mapper_processor_share, 0)),
        ("peak memory, all processes", "", formatted(summary.peak_memory_mib, "{:.0f} MiB")),
    ]
    if min(mav.survived, ground.survived) < summary.runs:
        rows.insert(0, each("survived", lambda robot: f"{robot.survived} of {summary.runs}"))
    return tuple(rows)


def _unmapped(robot: LiveRobot) -> str:
    """Reasons for which frames did not reach the mapper, with counts."""
    reasons = {"no room": robot.shed, "lost by the radio": robot.lost, "late": robot.late}
    found = [f"{count} {reason}" for reason, count in reasons.items() if count]
    return ", ".join(found) or "none"


def _latency(latency: Latency) -> str:
    if latency.median is None or latency.p95 is None or latency.worst is None:
        return MISSING
    return f"{latency.median:.0f}, {latency.p95:.0f}, {latency.worst:.0f} ms"
