"""Producing items ahead of use, in another thread."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from itertools import islice, repeat
from typing import TypeVar

AHEAD = 4
"""Reads ahead of use: enough to hide the jitter of decoding, few enough to hold in memory."""

Item = TypeVar("Item")
Argument = TypeVar("Argument")


def read_ahead(
    pool: ThreadPoolExecutor,
    read: Callable[[Argument], Item],
    arguments: Iterable[Argument],
    ahead: int = AHEAD,
) -> Generator[Item]:
    """What `read` gives for each argument, in order; it raises where `read` does.

    At most `ahead` reads are done or under way ahead of use. They are independent of each other,
    unless the pool has one thread."""
    waiting: deque[Future[Item]] = deque()
    try:
        for argument in arguments:
            waiting.append(pool.submit(read, argument))
            if len(waiting) > ahead:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        for future in waiting:
            future.cancel()


def run_ahead(items: Iterable[Item], ahead: int) -> Generator[Item]:
    """The same items, produced in a thread of their own; raises where `items` does.
    At most `ahead` of them wait to be taken. Producer and consumer must share no mutable state."""
    iterator = iter(items)
    with ThreadPoolExecutor(1) as pool:
        made = read_ahead(pool, lambda _: list(islice(iterator, 1)), repeat(None), ahead)
        with closing(made):
            for item in made:
                if not item:
                    return
                yield from item
