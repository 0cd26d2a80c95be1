"""Who claims to know, and who is wrong: claims by case, with places to find and without."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import pandas as pd

from evaluation.regression import samples
from evaluation.results.table import CONTROL_SCENES, ResultTable
from evaluation.statistics.intervals import Rate, wilson
from evaluation.trust.cases import CASES, Case

TO_BE_FOUND = "found"
"""The case in which there is something to find."""
NO_STRUCTURE = "no_structure"
"""The case of the control scenes."""
ALL = "all"


@dataclass(frozen=True)
class Claims:
    """What was claimed in one case.

    Attributes:
        accepted: Of all that were asked.
        wrong: Of those accepted.
    """

    accepted: Rate
    wrong: Rate

    @classmethod
    def of(cls, claimed: pd.Series, wrong: pd.Series) -> Claims:
        """Count claims, and those among them that are wrong (1 or 0 each, the same index)."""
        accepted, false = int((claimed > 0).sum()), int((wrong > 0).sum())
        return cls(wilson(accepted, len(claimed)), wilson(false, accepted))

    @classmethod
    def sum(cls, parts: list[Claims]) -> Claims:
        """All cases together."""
        asked = sum(part.accepted.total for part in parts)
        accepted = sum(part.accepted.successes for part in parts)
        false = sum(part.wrong.successes for part in parts)
        return cls(wilson(accepted, asked), wilson(false, accepted))


def localization_claims(table: ResultTable) -> dict[str, Claims]:
    """Claims of a position by case, `ALL` last (of one condition); one entry an aerial map.

    Where there is something to find, a claim farther off than 0.25 m in the horizontal plane
    is wrong; elsewhere every one is.
    """
    return _by_case(table, samples.claimed, samples.claimed_wrongly, "converged")


def refinement_claims(table: ResultTable) -> dict[str, Claims]:
    """Accepted refinements by case, `ALL` last (of one condition); one entry a trial.

    Where there is something to find, one farther off than 5 cm or 2 degrees is wrong; elsewhere
    every one is.
    """
    return _by_case(table, samples.refined("accepted"), samples.refined_wrongly, "accepted")


def _by_case(
    table: ResultTable,
    claimed: Callable[[ResultTable], pd.Series],
    wrong: Callable[[ResultTable], pd.Series],
    metric: str,
) -> dict[str, Claims]:
    """Cases in which nothing was asked are left out, and `ALL` without any case."""
    controls = [scene for scene in table.scenes() if scene in CONTROL_SCENES]
    places = table.of_scenes(scene for scene in table.scenes() if scene not in CONTROL_SCENES)
    flat = claimed(table.of_scenes(controls))
    made = {
        TO_BE_FOUND: Claims.of(claimed(places), wrong(places)),
        NO_STRUCTURE: Claims.of(flat, flat),
        **{case.stage: _negative(table, case, metric) for case in CASES},
    }
    asked = {name: claims for name, claims in made.items() if claims.accepted.total}
    return asked | {ALL: Claims.sum(list(asked.values()))} if asked else {}


def _negative(table: ResultTable, case: Case, metric: str) -> Claims:
    claimed = table.rows(case.stage, metric)["value"]
    return Claims.of(claimed, claimed)
