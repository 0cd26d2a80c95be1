"""Reading ahead gives what reading gives, in order, and reads no further than it may."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest
from hypothesis import given
from hypothesis import strategies as st

from airground.io.read_ahead import AHEAD, read_ahead


@given(indices=st.lists(st.integers(0, 100), max_size=30), threads=st.integers(1, 3))
def test_the_order_is_that_of_the_indices(indices: list[int], threads: int) -> None:
    with ThreadPoolExecutor(threads) as pool:
        assert list(read_ahead(pool, lambda index: 2 * index, indices)) == [2 * i for i in indices]


def test_no_more_is_read_than_was_promised() -> None:
    seen: list[int] = []
    with ThreadPoolExecutor(1) as pool:
        items = read_ahead(pool, lambda index: seen.append(index) or index, range(100))
        assert [next(items) for _ in range(3)] == [0, 1, 2]
        items.close()  # type: ignore[attr-defined]
    assert len(seen) <= 3 + AHEAD


def test_what_cannot_be_read_is_told_when_its_turn_comes() -> None:
    def read(index: int) -> int:
        if index == 2:
            raise ValueError("broken")
        return index

    with ThreadPoolExecutor(1) as pool:
        items = read_ahead(pool, read, range(5))
        assert [next(items), next(items)] == [0, 1]
        with pytest.raises(ValueError, match="broken"):
            next(items)
