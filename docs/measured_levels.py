"""Writes `measured_levels.md`, the tables of measured levels, from the runs kept beside it.

- `python docs/measured_levels.py`: writes the page and its pictures anew.
- `python docs/measured_levels.py keep RUN NAME`: keeps a run of `reproduce --level` under this name
  first, such as the name of its preset.
"""

import shutil
import sys
from collections import Counter
from pathlib import Path

from airground.errors import InputError
from evaluation.judge import samples
from evaluation.judge.results import CONFIG, SUMMARY, TABLE, AtLevel, merged, read_results
from evaluation.judge.summary import Summary
from evaluation.measure.protocol import wide_search
from evaluation.measure.protocol.negatives import CASES
from evaluation.setup.console import EXIT_ERROR
from evaluation.setup.output import fresh_folder
from evaluation.setup.text import (
    MISSING,
    TextTable,
    in_brackets,
    markdown_table,
    metres,
    milliseconds,
)
from evaluation.show.figures.style import write_png
from evaluation.show.report.calibration import calibration_table, claims_table
from evaluation.show.report.levels import (
    PER_MAP,
    Method,
    baselines_at,
    level_figures,
    presets_at,
)
from evaluation.show.report.trajectories import trajectory_table
from evaluation.table.rows import CONTROL_SCENES, ResultTable

PAGE = Path(__file__).with_suffix(".md")
RUNS = Path(__file__).with_suffix("")
"""One folder a level, with one folder a run."""
PICTURES = PAGE.parent / "pictures"
"""Where the pictures of several levels lie, each named after its figure."""
STAGES = (
    *("localization", "baseline", "alignment", "refinement", "trajectory", "appearance"),
    *("surface", wide_search.STAGE),
    *(case.stage for case in CASES),
)
"""Stages whose rows are kept: all that `compare` and the tables need; of the times only those of
`PER_MAP`, as a repository is small."""
INTRODUCTION = """\
# Measured levels

What every method achieved at each [level](levels.md#measuring-a-level). `make docs` writes this
page from the runs that are kept in `docs/measured_levels/`; a test checks that it is up to date.
Intervals are 95 %, by Wilson, and take cases as independent. A method without a guess is wrong.
Times are medians on one core, while the other one is as busy.
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


def page(kept: Path = RUNS) -> str:
    """The whole page, of the runs in `kept`."""
    summaries = [Summary.read(run / SUMMARY) for run in _runs(kept)]
    levels = measured_levels(kept)
    lines = [INTRODUCTION, *_side_by_side(levels)]
    for one in levels:
        lines += _level(one, [summary for summary in summaries if summary.level == one.level])
    return "\n".join([*lines, ""])


def measured_levels(kept: Path = RUNS) -> list[AtLevel]:
    """What the runs in `kept` measured, level by level."""
    runs = _runs(kept)
    return list(merged([read_results(run) for run in runs]).levels) if runs else []


def _runs(kept: Path) -> list[Path]:
    return sorted(summary.parent for summary in kept.glob(f"*/*/{SUMMARY}"))


def _side_by_side(levels: list[AtLevel]) -> list[str]:
    """Pictures and a table of several levels; nothing of one."""
    figures = level_figures(levels)
    if not figures:
        return []
    pictures = [
        line
        for made in figures
        for line in (f"![{made.title}](pictures/{made.name}.png)", "", f"*{made.caption}*", "")
    ]
    header = ("best guess within 0.25 m", "aerial maps", *(str(one.level) for one in levels))
    rows = [
        (
            method.title,
            str(method.maps),
            *(
                MISSING if made is None else in_brackets(made.success.text())
                for made in method.achieved
            ),
        )
        for method in presets_at(levels) + baselines_at(levels)
    ]
    return ["## All levels", "", *pictures, *markdown_table(header, rows), ""]


def keep(run: Path, name: str, kept: Path = RUNS) -> None:
    """Copy what the tables need of a run into a folder of its level, as a run of fewer rows.

    Raises:
        InputError: `run` is none of a level, `name` is no name of a folder, the level has a run of
            this name already, or rows of this run are kept already.
    """
    if Path(name).name != name:
        raise InputError(f"{name}: expected the name of a folder, such as best")
    results = read_results(run)
    if results.level is None:
        raise InputError(f"{run}: states no level; expected a run of reproduce --level")
    frame = results.table.frame
    timed = (frame["stage"] == "timing") & frame["metric"].isin(PER_MAP)
    table = frame[frame["stage"].isin(STAGES) | timed]
    with fresh_folder(kept / results.level.name / name) as folder:
        merged([results, *map(read_results, _runs(kept))])
        table.to_parquet(folder / TABLE, index=False, compression="zstd", compression_level=19)
        for file in (CONFIG, SUMMARY):
            shutil.copyfile(run / file, folder / file)


def _level(level: AtLevel, summaries: list[Summary]) -> list[str]:
    lines = [f"## `{level.level.name}` {level.level.version}", "", _conditions(summaries), ""]
    lines += markdown_table(HEADER, [_row(m) for m in presets_at([level]) + baselines_at([level])])
    for condition in level.table.conditions():
        if (condition.preset, condition.poses) == ("best", "slam"):
            lines += ["", *_of_best(level.table.of(condition))]
    return [*lines, ""]


def _conditions(summaries: list[Summary]) -> str:
    revisions = ", ".join(sorted({summary.git_revision for summary in summaries}))
    seeds = ", ".join(map(str, sorted({summary.seed for summary in summaries})))
    machines = sorted({f"{s.machine.cores} cores of {s.machine.cpu}" for s in summaries})
    return f"Revision {revisions}, `--seed {seeds}`, {', '.join(machines)}."


def _row(method: Method) -> tuple[str, ...]:
    (made,) = method.achieved
    assert made is not None
    return (
        method.title,
        str(method.maps),
        in_brackets(made.success.text()),
        f"{made.posed.successes} of {made.posed.total}",
        metres(made.error_m),
        f"{made.wrong.successes} of {made.wrong.total}",
        milliseconds(made.ms),
    )


def _of_best(measured: ResultTable) -> list[str]:
    """Claims of preset best, and how well it knows its errors."""
    flights = Counter(flight.scene for flight in samples.flights(measured))
    counts = ", ".join(f"`{scene}` {count}" for scene, count in flights.items())
    empty = ", ".join(f"`{scene}`" for scene in flights if scene in CONTROL_SCENES)
    nothing = f"; in {empty} there is nothing to find" if empty else ""
    beliefs = calibration_table(measured.scored())
    return [
        f"What `best` claims, and how well it knows its errors. Flights: {counts}{nothing}.",
        *("", *_table(claims_table(measured))),
        *("", *_table(TextTable(("beliefs of best", *beliefs.header[1:]), beliefs.rows))),
        *("", *_table(_consistency(measured))),
    ]


def _consistency(measured: ResultTable) -> TextTable:
    """Normalized errors of the poses that both robots' SLAM reports."""
    full = trajectory_table(measured, measured.conditions())
    rows = [(row[0], row[-1]) for row in full.rows if "NEES" in row[0]]
    return TextTable(("poses of best", "median over flights"), tuple(rows))


def _table(table: TextTable) -> list[str]:
    return markdown_table(table.header, [tuple(map(in_brackets, row)) for row in table.rows])


def main(words: list[str]) -> None:
    """The command line."""
    match words:
        case []:
            pass
        case ["keep", run, name]:
            keep(Path(run), name)
        case _:
            raise InputError(f"{' '.join(words)}: expected nothing, or keep RUN NAME")
    PAGE.write_text(page(), encoding="utf-8")
    for made in level_figures(measured_levels()):
        write_png(made.figure, PICTURES / f"{made.name}.png")


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except InputError as error:
        print(f"{Path(__file__).name}: error: {error}", file=sys.stderr)
        sys.exit(EXIT_ERROR)
