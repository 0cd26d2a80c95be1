"""The parts of `summary.json` on what localization claims, and on how well it knows its errors."""

from __future__ import annotations

from evaluation.results.summary_parts import Count, Number, Part, Share, number
from evaluation.results.table import ResultTable
from evaluation.statistics.intervals import Rate
from evaluation.trust.calibration import ELLIPSES, Localizations, localizations
from evaluation.trust.claims import Claims, localization_claims, refinement_claims


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
    """Of all that were asked, those accepted; of those, the wrong ones."""

    accepted: ShareOf
    wrong: ShareOf

    @classmethod
    def of(cls, claims: Claims) -> ClaimsPart:
        return cls(accepted=ShareOf.of(claims.accepted), wrong=ShareOf.of(claims.wrong))


class ClaimsSummary(Part):
    """By case: "found", "no_structure", "no_overlap", "wrong_map", and "all" of them."""

    localization: dict[str, ClaimsPart]
    refinement: dict[str, ClaimsPart]


class CalibrationPart(Part):
    """Of some localizations: 1 is right for both normalized errors, above is too sure."""

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
        return {case: ClaimsPart.of(made) for case, made in claims.items()}

    return ClaimsSummary(
        localization=parts(localization_claims(table)), refinement=parts(refinement_claims(table))
    )


def calibration_summary(table: ResultTable) -> CalibrationSummary | None:
    """Of one condition, control scenes apart; None where no belief was measured."""
    found = localizations(table)
    if len(found) == 0:
        return None
    return CalibrationSummary(
        all=CalibrationPart.of(found), accepted=CalibrationPart.of(found.only_accepted())
    )
