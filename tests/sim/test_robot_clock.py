"""A clock that steps: stamps and times are each other's inverse, and the truth's file is read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from airground.errors import RecordingError
from sim.recording.faults_file import FILE, read_clocks, write_faults
from sim.sensors.faults import Fault
from sim.sensors.robot_clock import RobotClock

TIMES_NS = np.arange(0, 10_000, 7, dtype=np.int64)


@pytest.mark.parametrize("steps", [(), ((5000, 1234),), ((7000, 3), (2000, 600), (2001, 0))])
def test_every_stamp_leads_back_to_its_time(steps: tuple[tuple[int, int], ...]) -> None:
    clock = RobotClock.stepping(steps)
    stamps = clock.stamps_ns(TIMES_NS)
    np.testing.assert_array_equal(clock.times_ns(stamps), TIMES_NS)
    ahead = sum(size for _, size in steps)
    assert (stamps[0], stamps[-1]) == (0, TIMES_NS[-1] + ahead)
    assert (np.diff(stamps) > 0).all()


def test_a_step_is_at_its_time() -> None:
    clock = RobotClock(((5000, 1000),))
    assert clock.stamps_ns(np.array([4999, 5000])).tolist() == [4999, 6000]
    assert [clock.time_ns(stamp) for stamp in (4999, 6000, 7000)] == [4999, 5000, 6000]


def test_steps_are_read_from_the_list_of_faults(tmp_path: Path) -> None:
    faults = (
        Fault("clock", "mav", 0.0, start_s=3.5, size=0.0815),
        Fault("black", "mav", 1.0, start_s=2.0),
        Fault("clock", "mav", 0.0, start_s=1.25, size=0.000_000_007),
    )
    write_faults(tmp_path, faults)
    assert read_clocks(tmp_path) == {
        "mav": RobotClock(((1_250_000_000, 7), (3_500_000_000, 81_500_000))),
        "ground": RobotClock(),
    }


def test_without_faults_there_is_no_list(tmp_path: Path) -> None:
    write_faults(tmp_path, ())
    assert list(tmp_path.iterdir()) == []
    assert read_clocks(tmp_path) == {"mav": RobotClock(), "ground": RobotClock()}


HEAD = "kind,robot,start [s],end [s],size\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "faults.csv:1: must be the columns kind,robot"),
        ("kind,robot\n", "faults.csv:1: must be the columns kind,robot"),
        (HEAD + "clock,mav,1.0,1.0\n", "faults.csv:2: must be clock, mav or ground"),
        (HEAD + "clock,us,1.0,1.0,0.5\n", "faults.csv:2: must be clock, mav or ground"),
        (HEAD + "clock,mav,one,1.0,0.5\n", "faults.csv:2: must be clock, mav or ground"),
        (HEAD + "black,mav,,,\nclock,mav,1.0,1.0,nan\n", "faults.csv:3: must be clock"),
        (HEAD + "clock,mav,1.0,1.0,-0.5\n", "faults.csv:2: must be clock"),
        (HEAD + "clock,mav,1e30,1.0,0.5\n", "faults.csv:2: must be clock"),
        ("\udcff", "faults.csv: cannot be read"),
    ],
)
def test_a_damaged_list_is_refused(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / FILE).write_text(text, encoding="utf-8", errors="surrogateescape")
    with pytest.raises(RecordingError, match=said):
        read_clocks(tmp_path)
