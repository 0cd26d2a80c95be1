"""`compare.html`: one self-contained page that says what changed between runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from evaluation.compare import tables
from evaluation.compare.figures import comparison_figures
from evaluation.compare.runs import Against
from evaluation.regression.tables import conclusion, conditions
from evaluation.report.html import rendered, saved_picture
from evaluation.report.tables import TextTable

PAGE = "compare.html"


@dataclass(frozen=True)
class Section:
    """What the page says of one run, beside the figures."""

    name: str
    outcome: str
    conclusion: str
    judged: str
    caveats: list[str]
    moved: TextTable
    rest: TextTable
    failures: tables.FailuresMoved | None

    @classmethod
    def of(cls, held: Against) -> Section:
        return cls(
            name=held.run.name,
            outcome=held.outcome(),
            conclusion=conclusion(held.comparison),
            judged=conditions(held.comparison),
            caveats=held.caveats(),
            moved=tables.moved_table(held),
            rest=tables.rest_table(held),
            failures=tables.failures_moved(held) if held.shared else None,
        )


def write_comparison(out: Path, helds: Sequence[Against]) -> None:
    """Write the page and `figures/` (PNG and PDF) into an existing folder.

    Args:
        out: Where.
        helds: At least one; all have the same reference.
    """
    reference = helds[0].reference
    runs = [reference, *(held.run for held in helds)]
    page = rendered(
        "compare.html.j2",
        reference=reference.name,
        sections=[Section.of(held) for held in helds],
        overview=tables.overview_table(helds) if len(helds) > 1 else None,
        pictures=[saved_picture(drawn, out) for drawn in comparison_figures(helds)],
        differing=tables.difference_table(runs),
        common=tables.common_table(runs),
    )
    (out / PAGE).write_text(page, encoding="utf-8")
