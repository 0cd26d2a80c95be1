"""Since when a run is worse: metrics that got worse, with the kind of thing that they measure."""

from __future__ import annotations

from collections.abc import Iterable

from evaluation.judge.divergence import Held, Kind
from evaluation.judge.verdict import Comparison, Judged, Verdict

KIND_OF: dict[str, Kind] = {
    **dict.fromkeys(("mav_trajectory", "mav_tracked"), "MAV's pose"),
    **dict.fromkeys(("ground_trajectory", "ground_tracked"), "ground robot's pose"),
    **dict.fromkeys(("aerial_maps", "surface_median", "surface_p90", "completeness"), "surface"),
    **dict.fromkeys(
        ("localization_1", "localization_4", "spread_1", "within_50cm_1", "within_25cm_4",
         "located", "located_wrongly", "control_claims"),
        "belief",
    ),
    **dict.fromkeys(
        ("refined_translation", "refined_rotation", "refined_well", "refinement_accepted",
         "refined_wrongly"),
        "alignment",
    ),
}  # fmt: skip
"""What each watched metric of a run measures; the wide search is no part of a run."""


def worsened(comparison: Comparison, helds: Iterable[Held]) -> list[tuple[Judged, Held]]:
    """Metrics that got worse, with the kind that they measure, where that differs.

    A single recording gives one observation of many metrics, and so no verdict: there a change for
    the worse counts from what matters on.
    """
    parted = {held.kind: held for held in helds if held.first is not None}
    return [
        (judged, parted[KIND_OF[judged.metric.name]])
        for judged in comparison.judged
        if KIND_OF.get(judged.metric.name) in parted and _is_worse(judged)
    ]


def _is_worse(judged: Judged) -> bool:
    if judged.verdict != Verdict.SINGLE or judged.compared is None:
        return judged.verdict in (Verdict.WORSE, Verdict.SLIGHTLY_WORSE)
    change = judged.compared.effect.value
    worse = change if judged.metric.better == "lower" else -change
    return worse > 0 and worse >= judged.matters
