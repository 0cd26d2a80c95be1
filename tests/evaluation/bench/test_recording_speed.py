"""Time, processor time and size of a whole recording."""

from __future__ import annotations

import pytest

from airground.errors import AirgroundError
from evaluation.bench.recording_speed import record_anew


@pytest.mark.slow
def test_a_recording_is_made_timed_and_measured() -> None:
    made = record_anew("recording", threads=2, scene="tiny", duration_s=8.0)
    assert made.sensors == "nominal"
    assert made.recorded_s == pytest.approx(8.0, abs=0.01)
    assert made.recorded_s_a_second == pytest.approx(made.recorded_s / made.wall_s)
    # About 470 images, by two processes.
    assert 0.5 < made.cpu_s < 2.2 * made.wall_s
    assert made.cpu_ms_an_image == pytest.approx(1e3 * made.cpu_s / 470, rel=0.05)
    assert 100 < made.mib_a_minute < 2000


def test_a_recording_that_cannot_be_made_is_an_error() -> None:
    with pytest.raises(AirgroundError, match=r"recording tiny: .*duration"):
        record_anew("recording", threads=1, scene="tiny", duration_s=0.5)
