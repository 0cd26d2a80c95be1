"""Lanes are processes of their own: so many cores, nothing on stdout, gone when interrupted."""

from __future__ import annotations

import multiprocessing
import os
import time

import pytest

from airground.errors import AirgroundError
from evaluation.bench.lane import lane_processes
from evaluation.setup.environment import usable_cores


def cores_and_threads() -> tuple[int, str]:
    print("output of a library")
    return len(os.sched_getaffinity(0)), os.environ["NUMBA_NUM_THREADS"]


def die() -> None:
    os._exit(1)


def test_a_lane_of_one_core_is_bound_to_it_and_prints_to_stderr(
    capfd: pytest.CaptureFixture[str],
) -> None:
    here = len(os.sched_getaffinity(0))
    with lane_processes(sorted({1, usable_cores()})) as lanes:
        found = [lane.ask(cores_and_threads) for lane in lanes]
    assert found[0] == (1, "1")
    assert found[-1] == (here if usable_cores() > 1 else 1, str(usable_cores()))
    printed = capfd.readouterr()
    assert printed.out == ""
    assert "output of a library" in printed.err


def test_a_process_that_dies_is_an_error() -> None:
    with lane_processes([1]) as lanes, pytest.raises(AirgroundError, match="a process died"):
        lanes[0].ask(die)


def interrupted_while_a_lane_works() -> None:
    with lane_processes([1]) as lanes:
        lanes[0]._pool.submit(time.sleep, 600)
        raise KeyboardInterrupt


def test_an_interrupt_ends_the_lanes_at_once() -> None:
    started = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        interrupted_while_a_lane_works()
    assert time.monotonic() - started < 60
    assert multiprocessing.active_children() == []
