"""Findings of an inspection: what they look like, and those on streams of stamps."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from evaluation.setup.text import TextTable, print_table


class Verdict(StrEnum):
    """Meaning of a finding."""

    FINE = "ok"
    NOTED = "note"
    WRONG = "wrong"


@dataclass(frozen=True)
class Finding:
    """One line of the table; `part` is "mav", "ground", or "" for all of the dataset."""

    part: str
    subject: str
    found: str
    verdict: Verdict = Verdict.FINE


def show(title: str, findings: Sequence[Finding]) -> None:
    colours = {Verdict.FINE: "", Verdict.NOTED: "yellow", Verdict.WRONG: "bold red"}
    rows = tuple((one.part, one.subject, one.found, str(one.verdict)) for one in findings)
    styles = [colours[one.verdict] for one in findings]
    table = TextTable(("", "what", "found", ""), rows)
    print_table(table, title, left=range(4), styles=styles)


def as_json(dataset: str, layout: str, findings: Sequence[Finding]) -> str:
    content = {
        "schema": "airground-inspection",
        "version": 1,
        "dataset": dataset,
        "layout": layout,
        "wrong": sum(one.verdict is Verdict.WRONG for one in findings),
        "findings": [asdict(one) for one in findings],
    }
    return json.dumps(content, indent=2)


MISSED = 1.5
"""Steps between stamps longer than this many median steps leave samples out."""
LONGEST_GAP_S = {"images": 0.5, "IMU": 0.05, "magnetometer": 0.5, "true poses": 0.5}
"""Gaps too long to be bridged by interpolation or integration [s]."""


@dataclass(frozen=True)
class Rhythm:
    """Regularity of one stream of stamps: rate by the median step, samples missing at that rate,
    and as jitter the standard deviation of the steps that leave nothing out."""

    count: int
    rate_hz: float
    missing: int
    longest_gap_s: float
    jitter_ms: float

    @classmethod
    def of(cls, stamps_ns: NDArray[np.int64]) -> Rhythm:
        """From at least two stamps [ns]."""
        steps_s = np.diff(stamps_ns) / 1e9
        usual_s = float(np.median(steps_s))
        whole = steps_s < MISSED * usual_s
        left_out = np.rint(steps_s[~whole] / usual_s) - 1
        return cls(
            len(stamps_ns),
            1 / usual_s,
            int(left_out.sum()),
            float(steps_s.max()),
            float(1e3 * steps_s[whole].std()),
        )


def look_at_stamps(part: str, subject: str, stamps_ns: NDArray[np.int64]) -> Finding:
    """Rate and gaps of one of the streams that `LONGEST_GAP_S` names."""
    if len(stamps_ns) < 2:
        return Finding(part, subject, f"{len(stamps_ns)}: too few for a rate", Verdict.WRONG)
    rhythm = Rhythm.of(stamps_ns)
    found = f"{rhythm.count} at {rhythm.rate_hz:.1f} Hz, jitter {rhythm.jitter_ms:.2f} ms"
    verdict = Verdict.FINE
    if rhythm.missing:
        found += f", {rhythm.missing} missing, longest gap {rhythm.longest_gap_s:.3g} s"
        too_long = rhythm.longest_gap_s > LONGEST_GAP_S[subject]
        verdict = Verdict.WRONG if too_long else Verdict.NOTED
    return Finding(part, subject, found, verdict)
