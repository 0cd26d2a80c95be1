"""Claims of localization and refinement, wrong ones among them, and their calibration."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydantic import Field

from evaluation.judge import samples
from evaluation.measure.protocol.negatives import CASES
from evaluation.setup.checked_json import Count, Number, Part, Share, number
from evaluation.table.chi_squared import chi2_quantile
from evaluation.table.intervals import Rate, wilson
from evaluation.table.rows import CONTROL_SCENES, SEQUENCE_KEYS, ResultTable

TO_BE_FOUND = "found"
"""The case in which there is a place to find."""
NO_STRUCTURE = "no_structure"
"""The case of the control scenes."""
ALL = "all"


@dataclass(frozen=True)
class Claims:
    """Claims in one case: the share of cases with a claim, and of claims that are wrong."""

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
    """Claims of a position by case, `ALL` last (of one condition); one per aerial map.
    Where there is a place to find, a claim is wrong if it is off by more than `LOCATED_M` in the
    horizontal plane; elsewhere every claim is wrong."""
    return _by_case(table, samples.claimed, samples.claimed_wrongly, "converged")


def refinement_claims(table: ResultTable) -> dict[str, Claims]:
    """Accepted refinements by case, `ALL` last (of one condition); one per trial. Where there is a
    place to find, one that is no good pose (`is_good_pose`) is wrong; elsewhere every one is."""
    return _by_case(table, samples.refined("accepted"), samples.refined_wrongly, "accepted")


def _by_case(
    table: ResultTable,
    claimed: Callable[[ResultTable], pd.Series],
    wrong: Callable[[ResultTable], pd.Series],
    metric: str,
) -> dict[str, Claims]:
    """Cases without any value are left out, and `ALL` if there is none."""
    controls = [scene for scene in table.scenes() if scene in CONTROL_SCENES]
    places = table.of_scenes(scene for scene in table.scenes() if scene not in CONTROL_SCENES)
    flat = claimed(table.of_scenes(controls))
    negatives = {case.stage: table.rows(case.stage, metric)["value"] for case in CASES}
    made = {
        TO_BE_FOUND: Claims.of(claimed(places), wrong(places)),
        NO_STRUCTURE: Claims.of(flat, flat),
        **{stage: Claims.of(claims, claims) for stage, claims in negatives.items()},
    }
    asked = {name: claims for name, claims in made.items() if claims.accepted.total}
    return asked | {ALL: Claims.sum(list(asked.values()))} if asked else {}


def refusals(table: ResultTable, stage: str, metric: str) -> dict[str, int]:
    """How often a stage refused for which kind of reason (of one condition), the commonest first.
    The kind is what stands before the colon; equally common ones are in order of their names."""
    rows = table.rows(stage, metric)
    reasons = rows.loc[rows["value"] == 0, "note"].astype(str)
    counts = Counter(reason.partition(":")[0] for reason in reasons if reason)
    return dict(sorted(counts.items(), key=lambda item: (-item[1], item[0])))


METRIC = "squared_mahalanobis"
"""Of the stage "localization"."""
ELLIPSES = (0.50, 0.90, 0.99)
"""Shares of a Gaussian in the ellipses that are examined."""
FREEDOM = 2
"""Degrees of freedom of a horizontal position."""


@dataclass(frozen=True)
class Localizations:
    """Errors of localization and the errors that it reports, one per aerial map.

    Attributes:
        error_m, spread_m: (N,) horizontal error and the particles' standard deviation [m].
        squared_mahalanobis: (N,) distance of the true position in the belief's covariance.
        accepted: (N,) whether a position was claimed.
    """

    error_m: NDArray[np.float64]
    spread_m: NDArray[np.float64]
    squared_mahalanobis: NDArray[np.float64]
    accepted: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.accepted)

    def only_accepted(self) -> Localizations:
        """Those that claim a position."""
        kept = self.accepted
        return Localizations(
            self.error_m[kept], self.spread_m[kept], self.squared_mahalanobis[kept], kept[kept]
        )

    def coverage(self, share: float) -> Rate:
        """How often the truth lies in the ellipse that holds this share of a Gaussian."""
        inside = self.squared_mahalanobis <= chi2_quantile(share, FREEDOM)
        return wilson(int(inside.sum()), len(self))

    def mean_normalized_error(self) -> float:
        """Mean NEES over its degrees of freedom: above 1 is overconfident; NaN of none."""
        return float(self.squared_mahalanobis.mean() / FREEDOM) if len(self) else float("nan")

    def median_normalized_error(self) -> float:
        """Median NEES over that of a Gaussian: above 1 is overconfident; NaN of none."""
        if len(self) == 0:
            return float("nan")
        return float(np.median(self.squared_mahalanobis) / chi2_quantile(0.5, FREEDOM))

    def rank_correlation(self) -> float:
        """Spearman's, of spread and error: 1 where a larger spread always means a larger error.
        NaN for fewer than three localizations, or where one of both never changes."""
        if len(self) < 3 or np.ptp(self.error_m) == 0 or np.ptp(self.spread_m) == 0:
            return float("nan")
        from scipy.stats import spearmanr  # a third of a second, often not needed

        return float(spearmanr(self.spread_m, self.error_m).statistic)


def localizations(table: ResultTable) -> Localizations:
    """All beliefs of a table; an aerial map that was not made has none."""
    keys = [*SEQUENCE_KEYS, "iteration"]
    metrics = ["error_m", "spread_m", METRIC, "converged"]
    frame = table.frame[
        (table.frame["stage"] == "localization") & table.frame["metric"].isin(metrics)
    ]
    wide = frame.pivot(index=keys, columns="metric", values="value").reindex(columns=metrics)
    believed = wide[wide[METRIC].notna()]
    error_m, spread_m, distance, converged = believed.to_numpy(np.float64).T
    return Localizations(error_m, spread_m, distance, converged > 0)


class ShareOf(Part):
    """A share with its 95 % Wilson interval; null without any case."""

    count: Count
    total: Count
    share: Share | None
    low: Share
    high: Share

    @classmethod
    def of(cls, rate: Rate) -> ShareOf:
        share = rate.share if rate.total else None
        return cls(
            count=rate.successes, total=rate.total, share=share, low=rate.low, high=rate.high
        )


class ClaimsPart(Part):
    """`Claims` in the file."""

    accepted: ShareOf
    wrong: ShareOf


class ClaimsSummary(Part):
    """By case: "found", "no_structure", "no_overlap", "wrong_map", and "all" of them.
    Refusals are counted by the kind of their reason where there is a place to find."""

    localization: dict[str, ClaimsPart]
    refinement: dict[str, ClaimsPart]
    localization_refusals: dict[str, Count] = Field(default_factory=dict)
    refinement_refusals: dict[str, Count] = Field(default_factory=dict)


class CalibrationPart(Part):
    """Calibration of some localizations; normalized errors are 1 where it is right."""

    localizations: Count
    normalized_error_mean: Number
    normalized_error_median: Number
    rank_correlation: Number
    within_50: ShareOf
    within_90: ShareOf
    within_99: ShareOf

    @classmethod
    def of(cls, found: Localizations) -> CalibrationPart:
        half, most, nearly_all = (ShareOf.of(found.coverage(share)) for share in ELLIPSES)
        return cls(
            localizations=len(found),
            normalized_error_mean=number(found.mean_normalized_error()),
            normalized_error_median=number(found.median_normalized_error()),
            rank_correlation=number(found.rank_correlation()),
            within_50=half,
            within_90=most,
            within_99=nearly_all,
        )


class CalibrationSummary(Part):
    """All beliefs, and those that claim a position."""

    all: CalibrationPart
    accepted: CalibrationPart


def claims_summary(table: ResultTable) -> ClaimsSummary:
    """Of one condition, control scenes and negative cases included."""

    def parts(claims: dict[str, Claims]) -> dict[str, ClaimsPart]:
        return {
            case: ClaimsPart(accepted=ShareOf.of(made.accepted), wrong=ShareOf.of(made.wrong))
            for case, made in claims.items()
        }

    places = table.scored()
    return ClaimsSummary(
        localization=parts(localization_claims(table)),
        refinement=parts(refinement_claims(table)),
        localization_refusals=refusals(places, "localization", "converged"),
        refinement_refusals=refusals(places, "refinement", "accepted"),
    )


def calibration_summary(table: ResultTable) -> CalibrationSummary | None:
    """Of one condition, control scenes apart; None where no belief was measured."""
    found = localizations(table)
    if len(found) == 0:
        return None
    return CalibrationSummary(
        all=CalibrationPart.of(found), accepted=CalibrationPart.of(found.only_accepted())
    )
