"""A comparison for other programs: every metric as JSON, and a badge as shields.io draws it."""

from __future__ import annotations

import json
from typing import Any

from evaluation.judge.verdict import ALPHA, Comparison, Judged, Verdict
from evaluation.setup.checked_json import number
from evaluation.setup.text import MISSING
from evaluation.show.comparison.verdict_table import HEADER, cells, conclusion, conditions

SCHEMA = 1
BADGE_LABEL = "accuracy"


def as_json(comparison: Comparison) -> str:
    """What the screen shows, as text and as numbers; docs/history.md describes the keys.
    Null is a failure, or what was not measured: `shown` has the word for it."""
    made = {
        "schema": SCHEMA,
        "verdict": outcome(comparison),
        "conclusion": conclusion(comparison),
        "judged": conditions(comparison),
        "suite": comparison.suite,
        "condition": vars(comparison.condition),
        "paired": comparison.paired,
        "alpha": ALPHA,
        "metrics": [_metric(judged) for judged in comparison.judged],
    }
    return json.dumps(made, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def outcome(comparison: Comparison) -> str:
    """One word for all metrics: "worse" exactly if check exits with 1."""
    for verdict in (Verdict.WORSE, Verdict.BETTER):
        if comparison.of(verdict):
            return str(verdict)
    seen = (Verdict.SAME, Verdict.SLIGHTLY_WORSE, Verdict.SLIGHTLY_BETTER)
    return str(Verdict.SAME) if any(map(comparison.of, seen)) else "no verdict possible"


def badge(comparison: Comparison) -> str:
    """The JSON that the endpoint badge of shields.io reads."""
    word = outcome(comparison)
    colours = {Verdict.WORSE: "red", Verdict.BETTER: "brightgreen", Verdict.SAME: "green"}
    worse, better = (len(comparison.of(one)) for one in (Verdict.WORSE, Verdict.BETTER))
    counts = [f"{count} {name}" for count, name in ((worse, "worse"), (better, "better")) if count]
    made = {
        "schemaVersion": 1,
        "label": BADGE_LABEL,
        "message": ", ".join(counts) or word,
        "color": {str(key): colour for key, colour in colours.items()}.get(word, "lightgrey"),
    }
    return json.dumps(made) + "\n"


def _metric(judged: Judged) -> dict[str, Any]:
    metric, compared = judged.metric, judged.compared
    tested = compared is not None and judged.verdict != Verdict.SINGLE
    shown = dict(zip(HEADER, cells(judged), strict=True))
    return {
        "name": metric.name,
        "title": metric.title,
        "unit": metric.unit,
        "better": metric.better,
        "verdict": str(judged.verdict),
        "accepted": number(judged.before),
        "now": number(judged.after),
        "change": number(compared.effect.value) if compared else None,
        "low": number(compared.effect.low) if compared and tested else None,
        "high": number(compared.effect.high) if compared and tested else None,
        "p": number(judged.p) if tested else None,
        "matters": number(judged.matters),
        "observations": compared.count if compared else 0,
        "shown": {name: cell for name, cell in shown.items() if cell != MISSING},
    }
