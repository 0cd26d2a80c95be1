"""`compare.html`: one self-contained page of the changes between runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from evaluation.judge.divergence import Held, first_divergence
from evaluation.judge.runs import Against, Run
from evaluation.judge.samples import Flight
from evaluation.judge.verdict import MOVED, Judged
from evaluation.setup.text import MISSING, TextTable
from evaluation.show.comparison.figures import comparison_figures
from evaluation.show.comparison.verdict_table import HEADER, cells, conclusion, conditions
from evaluation.show.report.failures import Failure, failures
from evaluation.show.report.page import rendered, saved_picture
from evaluation.show.rerun_view.differences import conclusion as where_they_part
from evaluation.show.rerun_view.differences import differences_table

PAGE = "compare.html"


@dataclass(frozen=True)
class Parted:
    """Folders of two runs over one recording, and their first differences; none if unknown."""

    reference: Path
    run: Path
    differences: Sequence[Held]

    @property
    def table(self) -> TextTable:
        return differences_table(self.differences)

    @property
    def conclusion(self) -> str:
        return where_they_part(first_divergence(self.differences))


def write_comparison(
    out: Path, helds: Sequence[Against], parted: Sequence[Parted] | None = None
) -> None:
    """Write the page and `figures/` (PNG and PDF) into an existing folder.

    Args:
        out: The folder.
        helds: One run at least, all with the same reference.
        parted: Where each run parts from the reference; None if that is not known.
    """
    reference = helds[0].reference
    runs = [reference, *(held.run for held in helds)]
    page = rendered(
        "compare.html.j2",
        reference=reference.name,
        sections=[
            _section(held, None if parted is None else parted[number])
            for number, held in enumerate(helds)
        ],
        overview=overview_table(helds) if len(helds) > 1 else None,
        pictures=[saved_picture(drawn, out) for drawn in comparison_figures(helds)],
        differing=conditions_table(runs, common=False),
        common=conditions_table(runs, common=True),
    )
    (out / PAGE).write_text(page, encoding="utf-8")


def _section(held: Against, parted: Parted | None) -> dict[str, object]:
    return {
        "parted": parted if parted is not None and parted.differences else None,
        "name": held.run.name,
        "outcome": held.outcome(),
        "conclusion": conclusion(held.comparison),
        "judged": conditions(held.comparison),
        "caveats": held.caveats(),
        "moved": moved_table(held),
        "rest": rest_table(held),
        "failures": failures_moved(held) if held.shared else None,
    }


def moved_table(held: Against) -> TextTable:
    """Metrics that moved beyond chance, worse first."""
    return _verdicts(held, _moved(held))


def rest_table(held: Against) -> TextTable:
    """Metrics in which no difference was seen, or that were not measured."""
    moved = _moved(held)
    return _verdicts(held, [one for one in held.comparison.judged if one not in moved])


def overview_table(helds: Sequence[Against]) -> TextTable:
    """Every metric that moved in some run: its figure and verdict in each."""
    moved = {one.metric.name for held in helds for one in _moved(held)}
    rows = []
    for judged in zip(*(held.comparison.judged for held in helds), strict=True):
        if judged[0].metric.name in moved:
            found = [cells(one) for one in judged]
            rows.append((*found[0][:2], *(f"{row[2]}\n{row[-1]}" for row in found)))
    names = [helds[0].reference.name, *(held.run.name for held in helds)]
    return TextTable(("metric", *names), tuple(rows))


@dataclass(frozen=True)
class FailuresMoved:
    """Failures over the same flights: of the run only, of the reference only, number in both."""

    appeared: list[Failure]
    went: list[Failure]
    stayed: int


def failures_moved(held: Against) -> FailuresMoved:
    before, after = (
        {failure.key: failure for failure in failures(run.on(held.shared))}
        for run in (held.reference, held.run)
    )
    return FailuresMoved(
        appeared=[failure for key, failure in after.items() if key not in before],
        went=[failure for key, failure in before.items() if key not in after],
        stayed=len(before.keys() & after.keys()),
    )


def _moved(held: Against) -> list[Judged]:
    return [one for verdict in MOVED for one in held.comparison.of(verdict)]


def _verdicts(held: Against, judged: list[Judged]) -> TextTable:
    """The cells of `airground check`, the verdict first, under the names of both runs."""
    header = (HEADER[0], HEADER[-1], held.reference.name, held.run.name, *HEADER[3:-1])
    rows = [cells(one) for one in judged]
    return TextTable(header, tuple((row[0], row[-1], *row[1:-1]) for row in rows))


def conditions_table(runs: Sequence[Run], common: bool) -> TextTable:
    """Conditions that all runs share, or conditions and parameters in which they differ."""
    columns = [_conditions(run) if common else _conditions(run) | _parameters(run) for run in runs]
    rows = []
    for name in columns[0]:
        values = [column[name] for column in columns]
        if (len(set(values)) == 1) == common:
            rows.append((name, *(values[:1] if common else values)))
    names = ("all runs",) if common else tuple(run.name for run in runs)
    return TextTable(("", *names), tuple(rows))


def _conditions(run: Run) -> dict[str, str]:
    summary, measured = run.summary, run.measured
    return {
        "condition": measured.condition.label(),
        "level": MISSING if summary.level is None else str(summary.level),
        "code": f"{summary.version}, revision {summary.git_revision}",
        "flights": measured.suite,
        "seeds of the flights": _seeds(measured.flights),
        "--seed": str(summary.seed),
        "machine": f"{summary.machine.cpu}, {summary.machine.cores} cores",
    }


def _parameters(run: Run) -> dict[str, str]:
    """Every parameter by its name in --set."""
    return {
        f"{section}.{key}": str(value)
        for section, values in run.config.model_dump().items()
        if isinstance(values, dict)
        for key, value in values.items()
    }


def _seeds(flights: Sequence[Flight]) -> str:
    """Sorted, with runs of neighbours as ranges."""
    seeds = sorted({flight.seed for flight in flights})
    ranges: list[list[int]] = []
    for seed in seeds:
        if ranges and seed == ranges[-1][-1] + 1:
            ranges[-1].append(seed)
        else:
            ranges.append([seed])
    words = [f"{r[0]} to {r[-1]}" if len(r) > 1 else str(r[0]) for r in ranges]
    return ", ".join(words) or MISSING
