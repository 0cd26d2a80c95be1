"""Writes `measured_levels.md`, the tables of measured levels, from the runs kept beside it.

python docs/measured_levels.py                       # the page anew
python docs/measured_levels.py keep RUN LEVEL/NAME   # keep a run of reproduce --level
"""

import shutil
import sys
from collections import Counter
from pathlib import Path

from evaluation.judge import samples
from evaluation.judge.results import CONFIG, SUMMARY, TABLE, merged, read_results
from evaluation.judge.summary import Summary
from evaluation.measure.protocol.negatives import CASES
from evaluation.setup.text import TextTable, markdown_table, metres, milliseconds
from evaluation.show.report.calibration import calibration_table, claims_table
from evaluation.show.report.levels import PER_MAP, Method, baselines_at, presets_at
from evaluation.show.report.trajectories import trajectory_table
from evaluation.table.rows import CONTROL_SCENES, ResultTable

PAGE = Path(__file__).with_suffix(".md")
RUNS = Path(__file__).with_suffix("")
"""One folder a level, with one folder a run."""
LEVELS = ("paper", "easy", "medium", "hard", "extreme")
STAGES = (
    *("localization", "baseline", "alignment", "refinement", "trajectory", "appearance"),
    *(case.stage for case in CASES),
)
"""Stages whose rows are kept; of the times only those of `PER_MAP`, as a repository is small."""
INTRODUCTION = """\
# Measured levels

What every method achieved at each [level](levels.md#measuring-a-level). `make docs` writes this
page from the runs that are kept in `docs/measured_levels/`; a test checks that it is up to date.
Intervals are 95 %, by Wilson, and take cases as independent. A method without a guess is wrong.
Times are medians on one core, while the other one measures another flight.
"""
HEADER = (
    "method",
    "aerial maps",
    "best guess within 0.25 m",
    "and within 3°",
    "median error",
    "wrong claims",
    "time per map [ms]",
)


def page() -> str:
    """The whole page."""
    lines = [INTRODUCTION, *(line for level in LEVELS for line in _level(RUNS / level))]
    return "\n".join([*lines, ""])


def keep(run: Path, name: str) -> None:
    """Copy what the tables need of a run of `reproduce --level`, as a run of fewer rows."""
    frame = read_results(run).table.frame
    timed = (frame["stage"] == "timing") & frame["metric"].isin(PER_MAP)
    kept = RUNS / name
    kept.mkdir(parents=True, exist_ok=True)
    table = frame[frame["stage"].isin(STAGES) | timed]
    table.to_parquet(kept / TABLE, index=False, compression="zstd", compression_level=19)
    for file in (CONFIG, SUMMARY):
        shutil.copyfile(run / file, kept / file)


def _level(folder: Path) -> list[str]:
    runs = sorted(folder.glob(f"*/{SUMMARY}"))
    if not runs:
        return []
    (level,) = merged([read_results(run.parent) for run in runs]).levels
    best = next(c for c in level.table.conditions() if (c.preset, c.poses) == ("best", "slam"))
    measured = level.table.of(best)
    lines = [f"## `{level.level.name}` {level.level.version}", ""]
    lines += [_conditions(measured, [Summary.read(run) for run in runs]), ""]
    lines += markdown_table(HEADER, [_row(m) for m in presets_at([level]) + baselines_at([level])])
    lines += ["", "What `best` claims, and how well it knows its errors:", ""]
    lines += [*_table(claims_table(measured)), ""]
    found = calibration_table(measured)
    lines += [*_table(TextTable(("beliefs of best", *found.header[1:]), found.rows)), ""]
    return [*lines, *_table(_consistency(measured)), ""]


def _conditions(measured: ResultTable, summaries: list[Summary]) -> str:
    counts = Counter(flight.scene for flight in samples.flights(measured))
    flights = ", ".join(f"`{scene}` {count}" for scene, count in counts.items())
    seeds = sorted({summary.seed for summary in summaries})
    revisions = sorted({summary.git_revision for summary in summaries})
    machines = sorted({f"{s.machine.cores} cores of {s.machine.cpu}" for s in summaries})
    nothing = ", ".join(scene for scene in counts if scene in CONTROL_SCENES)
    return (
        f"Revision {', '.join(revisions)}, `--seed {', '.join(map(str, seeds))}`, "
        f"{', '.join(machines)}. Flights of `best`: {flights}"
        + (f"; in `{nothing}` there is nothing to find." if nothing else ".")
    )


def _row(method: Method) -> tuple[str, ...]:
    (made,) = method.achieved
    assert made is not None
    return (
        method.title,
        str(method.maps),
        _in_line(made.success.text()),
        f"{made.posed.successes} of {made.posed.total}",
        metres(made.error_m),
        f"{made.wrong.successes} of {made.wrong.total}",
        milliseconds(made.ms),
    )


def _consistency(measured: ResultTable) -> TextTable:
    """Normalized errors of the poses that both robots' SLAM reports."""
    full = trajectory_table(measured, measured.conditions())
    rows = [(row[0], row[-1]) for row in full.rows if "NEES" in row[0]]
    return TextTable(("poses of best", "median over flights"), tuple(rows))


def _table(table: TextTable) -> list[str]:
    return markdown_table(table.header, [tuple(map(_in_line, row)) for row in table.rows])


def _in_line(cell: str) -> str:
    """What follows a line break is detail."""
    shown, _, detail = cell.partition("\n")
    return f"{shown} ({detail})" if detail else shown


if __name__ == "__main__":
    if sys.argv[1:2] == ["keep"]:
        keep(Path(sys.argv[2]), sys.argv[3])
    PAGE.write_text(page(), encoding="utf-8")
