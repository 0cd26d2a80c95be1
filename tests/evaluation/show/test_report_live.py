"""How live runs went, in few numbers and in words."""

from __future__ import annotations

import pytest

from evaluation.judge.live_summary import live_summary
from evaluation.show.report.screen import live_table
from tests.evaluation.synthetic_results import live_rows, make_table


def test_latencies_counts_and_rates_are_summed_up() -> None:
    live = live_summary(live_rows(mav_dropped=3))
    assert live is not None
    assert (live.runs, live.mav.images, live.mav.dropped, live.mav.lost) == (1, 7, 3, 2)
    assert (live.mav.deadlines_missed, live.ground.deadlines_missed) == (1, 0)
    assert live.mav.posed_ms.median == 20.0
    assert live.mav.posed_ms.p95 == pytest.approx(20 + 0.85 * 230)
    assert live.mav.posed_ms.worst == 250.0
    assert live.mav.mbit_s == pytest.approx(2.0)
    assert live.peak_memory_mib == 1100.0
    assert live.aligned_ms.median is None


def test_the_table_says_why_frames_were_not_mapped() -> None:
    cells = {row[0]: row[1:] for row in live_table(live_rows(mav_dropped=3)).rows}
    assert cells["images dropped"] == ("3 of 7", "0 of 4")
    assert cells["frames not mapped"] == ("2 lost by the radio", "2 lost by the radio")
    assert cells["pose after its image"][1] == "20, 54, 60 ms"
    assert cells["surface located after its last image"] == ("-", "")
    assert "survived" not in cells


def test_a_robot_that_died_is_reported_first() -> None:
    table = live_table(live_rows(survived=False))
    assert table.rows[0] == ("survived", "0 of 1", "1 of 1")


def test_runs_offline_have_no_such_table() -> None:
    offline = make_table()
    assert live_summary(offline) is None
    assert live_table(offline).rows == ()
