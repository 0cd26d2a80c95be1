"""Times by the stamps of images, as a dictionary has them, in little memory."""

from __future__ import annotations

import pickle

import pytest

from evaluation.run.live.stamped_times import StampedTimes


def test_times_come_back_by_their_stamps() -> None:
    times = StampedTimes()
    for stamp_ns in (5, 8, 13, 13):
        times.note(stamp_ns, 10 * stamp_ns + len(times))
    expected = {5: 50, 8: 81, 13: 133}
    assert dict(times) == expected
    assert dict(pickle.loads(pickle.dumps(times))) == expected
    assert {5, 9} - times.keys() == {9}
    for unknown in (4, 6, 14):
        with pytest.raises(KeyError):
            times[unknown]
    with pytest.raises(ValueError, match="stamp 12 comes after 13"):
        times.note(12, 0)


def test_an_hour_takes_little_memory() -> None:
    times = StampedTimes()
    for index in range(3600 * 30):
        times.note(index * 33_333_333, index)
    assert len(pickle.dumps(times)) < 17 * len(times)
