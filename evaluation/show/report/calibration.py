"""The report on trust: claims case by case, and whether the particles' spread fits their error."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from evaluation.judge.claims import (
    ALL,
    ELLIPSES,
    NO_STRUCTURE,
    TO_BE_FOUND,
    Claims,
    Localizations,
    localization_claims,
    localizations,
    refinement_claims,
)
from evaluation.measure.protocol.negatives import NO_OVERLAP, WRONG_MAP
from evaluation.setup.condition import Condition
from evaluation.setup.text import MISSING, TextTable, formatted
from evaluation.show.figures.calibration import calibration_figure
from evaluation.show.figures.style import ReportFigure
from evaluation.table.rows import ResultTable

TITLES = {
    TO_BE_FOUND: "a place to find",
    NO_STRUCTURE: "flat: no structure",
    NO_OVERLAP.stage: "no overlap",
    WRONG_MAP.stage: "another scene's ground map",
    ALL: "all together",
}


def claims_table(table: ResultTable) -> TextTable:
    """One row a case (of one condition); no rows where nothing was asked."""
    located, refined = localization_claims(table), refinement_claims(table)
    rows = [
        (title, *_cells(located.get(case)), *_cells(refined.get(case)))
        for case, title in TITLES.items()
        if case in located or case in refined
    ]
    localizations_of = ("localizations", "claim a position", "wrong claims")
    return TextTable(("case", *localizations_of, "refinements", "accepted", "wrongly"), tuple(rows))


def _cells(claims: Claims | None) -> tuple[str, str, str]:
    if claims is None:
        return "0", MISSING, MISSING
    return str(claims.accepted.total), claims.accepted.text(), claims.wrong.text()


def calibration_table(table: ResultTable) -> TextTable:
    """All beliefs beside those that claim a position; no rows where there is none."""
    found = localizations(table)
    if len(found) == 0:
        return TextTable((), ())
    parts = (found, found.only_accepted())
    rows = [("localizations", *(str(len(part)) for part in parts))]
    rows += [
        (
            f"true position in the {100 * share:.0f} % ellipse",
            *(part.coverage(share).text() for part in parts),
        )
        for share in ELLIPSES
    ]
    for title, read in (
        ("normalized error, mean", Localizations.mean_normalized_error),
        ("normalized error, median", Localizations.median_normalized_error),
        ("rank correlation of spread and error", Localizations.rank_correlation),
    ):
        rows.append((title, *(formatted(read(part), "{:.2f}", "infinite") for part in parts)))
    return TextTable(("", "all", "accepted"), tuple(rows))


def calibration_figures(table: ResultTable, condition: Condition) -> Iterator[ReportFigure]:
    """Of one condition, control scenes apart; nothing where there is no belief."""
    found = localizations(table)
    if len(found):
        yield ReportFigure(
            "calibration",
            "Calibration: do reported covariances fit the errors?",
            "Left: how often the true position lies in the ellipse of the reported covariance "
            "(particles, and errors of both robots' poses), with 95 % Wilson intervals at 50, 90 "
            "and 99 %; below the dashed line it is overconfident. Right: error and spread of the "
            "particles. Aerial maps of one sequence are not independent. "
            f"{_beyond(found)}Conditions: {condition.label()}.",
            calibration_figure(found),
        )


def _beyond(found: Localizations) -> str:
    collapsed = int(np.isinf(found.squared_mahalanobis).sum())
    if collapsed == 0:
        return ""
    return f"{collapsed} beliefs had all particles in one place: in no ellipse. "
