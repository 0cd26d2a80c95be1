"""Reading ahead gives what reading gives, in order, and reads no further than it may."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from airground.core.work_ahead import AHEAD, read_ahead, run_ahead


@given(indices=st.lists(st.integers(0, 100), max_size=30), threads=st.integers(1, 3))
def test_the_order_is_that_of_the_indices(indices: list[int], threads: int) -> None:
    with ThreadPoolExecutor(threads) as pool:
        assert list(read_ahead(pool, lambda index: 2 * index, indices)) == [2 * i for i in indices]


def test_no_more_is_read_than_was_promised() -> None:
    seen: list[int] = []
    with ThreadPoolExecutor(1) as pool:
        items = read_ahead(pool, lambda index: seen.append(index) or index, range(100))
        assert [next(items) for _ in range(3)] == [0, 1, 2]
        items.close()
    assert len(seen) <= 3 + AHEAD


def test_what_cannot_be_read_raises_when_its_turn_comes() -> None:
    def read(index: int) -> int:
        if index == 2:
            raise ValueError("broken")
        return index

    with ThreadPoolExecutor(1) as pool:
        items = read_ahead(pool, read, range(5))
        assert [next(items), next(items)] == [0, 1]
        with pytest.raises(ValueError, match="broken"):
            next(items)


@settings(deadline=None)  # threads wait for a busy machine
@given(count=st.integers(0, 20), ahead=st.integers(1, 5))
def test_running_ahead_changes_nothing(count: int, ahead: int) -> None:
    assert list(run_ahead(iter(range(count)), ahead)) == list(range(count))


def test_another_thread_runs_ahead_and_no_further_than_it_may() -> None:
    threads: list[int] = []

    def items() -> Iterator[int]:
        for item in range(100):
            threads.append(threading.get_ident())
            yield item

    ahead = run_ahead(items(), 3)
    assert [next(ahead), next(ahead)] == [0, 1]
    ahead.close()
    assert 2 <= len(threads) <= 2 + 3
    assert threading.get_ident() not in threads


def test_an_error_comes_after_the_items_before_it() -> None:
    def items() -> Iterator[int]:
        yield 0
        raise ValueError("broken")

    ahead = run_ahead(items(), 3)
    assert next(ahead) == 0
    with pytest.raises(ValueError, match="broken"):
        next(ahead)
