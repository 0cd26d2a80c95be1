"""Rows of beliefs and alignments state when their surface was seen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from airground.core.belief import Alignment, Belief
from airground.core.se3 import SE3
from airground.errors import InputError
from evaluation.setup.condition import Condition
from evaluation.table.row_writer import RowWriter
from evaluation.table.rows import ResultTable
from evaluation.table.truth_errors import PoseError

ONE = SE3.identity()
BELIEF = Belief(
    3_250_000_000, np.zeros((2, 3)), np.zeros(3), np.eye(2), 0.0, 0.0, ONE, False, "spread too wide"
)
ERROR = PoseError(0.3, 0.2, 1.5)


def writer() -> RowWriter:
    return RowWriter("tiny", 0, 0, Condition("best", "slam", "nominal", "known"))


def test_each_row_of_a_belief_has_the_stamp_of_its_surface() -> None:
    out = writer()
    out.add_belief(BELIEF, ERROR, 1.0, 0, 1)
    out.add_no_belief("no surface", 0, 2)
    rows = ResultTable.from_rows(out.rows).rows("localization", "error_m").set_index("iteration")
    assert rows["time_s"][1] == 3.25
    assert np.isnan(rows["time_s"][2])


def test_each_row_of_an_alignment_has_the_stamp_of_its_surface() -> None:
    out = writer()
    out.add_alignment(Alignment(1_500_000_000, ONE, 0.9, 0.01, True, ""), {"after": ERROR}, 0)
    assert {row.metric: row.time_s for row in out.rows} == {
        "after_translation_m": 1.5,
        "after_rotation_deg": 1.5,
        "accepted": 1.5,
    }


def test_the_same_belief_twice_is_found_whatever_its_time() -> None:
    out = writer()
    out.add_alignment(Alignment(1, ONE, 0.9, 0.01, True, ""), {"after": ERROR}, 0)
    out.add_alignment(Alignment(2, ONE, 0.9, 0.01, True, ""), {"after": ERROR}, 0)
    with pytest.raises(InputError, match="is there twice"):
        ResultTable.from_rows(out.rows).check_once("here")


def test_results_say_that_their_folder_is_gone(tmp_path: Path) -> None:
    out = writer()
    out.add_belief(BELIEF, ERROR, 1.0, 0, 1)
    with pytest.raises(FileNotFoundError) as raised:
        ResultTable.from_rows(out.rows).write(tmp_path / "gone" / "results.parquet")
    assert raised.value.errno is not None
