"""The pipeline's own alignments count as failed where there is none, or a wrong one."""

from __future__ import annotations

import math

from evaluation.judge.metrics import METRICS
from evaluation.judge.readings import read
from evaluation.table.rows import ALIGNMENT_STAGE, ResultTable, Row
from tests.evaluation.synthetic_results import BEST, make_table


def alignment(trial: int, off_m: float | None) -> list[Row]:
    """Rows of one sighting; None for one without an alignment."""
    values = {"accepted": float(off_m is not None)}
    if off_m is not None:
        values |= {"after_translation_m": off_m, "after_rotation_deg": 0.1}
    return [
        Row("tiny", 0, 0, BEST, ALIGNMENT_STAGE, metric, value, "", trial=trial)
        for metric, value in values.items()
    ]


def test_a_sighting_without_a_good_alignment_is_a_failure() -> None:
    rows = [*alignment(0, 0.01), *alignment(1, 0.3), *alignment(2, None), *alignment(3, 0.02)]
    table = ResultTable.from_rows(rows)
    well = read(METRICS["aligned_well"], table)
    assert (well.value, well.count) == (0.5, 4)
    assert read(METRICS["aligned_translation"], table).value == 0.02


def test_a_table_without_alignments_has_no_value() -> None:
    assert math.isnan(read(METRICS["aligned_well"], make_table().of(BEST)).value)
