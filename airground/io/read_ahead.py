"""Reading a little ahead: the next images are decoded while the newest one is worked on."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

AHEAD = 4
"""Reads that may be done or under way before they are asked for."""

Item = TypeVar("Item")


def read_ahead(
    pool: ThreadPoolExecutor, read: Callable[[int], Item], indices: Iterable[int]
) -> Iterator[Item]:
    """What `read` gives for each index, in order; it raises where `read` does.

    Args:
        pool: Its threads read.
        read: Must not depend on what was read before.
        indices: What to read.
    """
    waiting: deque[Future[Item]] = deque()
    try:
        for index in indices:
            waiting.append(pool.submit(read, index))
            if len(waiting) > AHEAD:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        for future in waiting:
            future.cancel()
