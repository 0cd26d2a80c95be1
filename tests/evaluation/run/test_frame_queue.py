"""Frames that a bounded queue accepts."""

from __future__ import annotations

from collections import deque

from hypothesis import given
from hypothesis import strategies as st

from evaluation.run.live.playback import FrameQueue


def test_a_fast_tracker_gets_every_frame_before_it_is_due() -> None:
    queue = FrameQueue([10, 20, 30], capacity=0)
    assert [queue.take(now) for now in (0, 11, 21, 31)] == [0, 1, 2, None]
    assert queue.dropped == []
    assert queue.longest == 0


def test_frames_that_find_the_queue_full_are_dropped() -> None:
    queue = FrameQueue(range(0, 100, 10), capacity=2)
    assert queue.take(0) == 0
    assert queue.take(55) == 1  # 1 and 2 wait; 3, 4 and 5 are dropped
    assert queue.dropped == [3, 4, 5]
    assert queue.take(60) == 2  # 6 has arrived and waits
    assert queue.take(61) == 6
    assert queue.take(62) == 7
    assert queue.longest == 2


def simulated(stamps: list[int], works: list[int], capacity: int) -> tuple[list[int], list[int]]:
    """The slow twin: a camera and a tracker, simulated tick by tick."""
    waiting: deque[int] = deque()
    tracked, dropped = [], []
    free_at = 0
    for now in range(stamps[-1] + sum(works) + 2):
        for index in [i for i, stamp in enumerate(stamps) if stamp == now]:
            # A frame that arrives when the tracker is idle never waits.
            if len(waiting) < capacity or (now > free_at and not waiting):
                waiting.append(index)
            else:
                dropped.append(index)
        if waiting and now >= free_at:
            index = waiting.popleft()
            tracked.append(index)
            free_at = now + works[index]
    return tracked, dropped


@given(
    st.lists(st.integers(1, 9), min_size=1, max_size=30),
    st.lists(st.integers(1, 25), min_size=30, max_size=30),
    st.integers(1, 4),
)
def test_it_equals_a_simulation_tick_by_tick(
    gaps: list[int], works: list[int], capacity: int
) -> None:
    stamps = [sum(gaps[: i + 1]) for i in range(len(gaps))]
    queue = FrameQueue(stamps, capacity)
    now, tracked = 0, []
    while (index := queue.take(now)) is not None:
        tracked.append(index)
        now = max(now, stamps[index]) + works[index]
    assert (tracked, queue.dropped) == simulated(stamps, works, capacity)
    assert sorted(tracked + queue.dropped) == list(range(len(stamps)))
