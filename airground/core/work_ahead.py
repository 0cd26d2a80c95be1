"""Working a little ahead: the next items are made while the newest one is worked on."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from itertools import islice, repeat
from typing import TypeVar

AHEAD = 4
"""Reads that may be done or under way before they are asked for."""

Item = TypeVar("Item")
Argument = TypeVar("Argument")


def read_ahead(
    pool: ThreadPoolExecutor,
    read: Callable[[Argument], Item],
    arguments: Iterable[Argument],
    ahead: int = AHEAD,
) -> Generator[Item]:
    """What `read` gives for each argument, in order; it raises where `read` does.

    Args:
        pool: Its threads read.
        read: Must not depend on what was read before, unless the pool has only one thread.
        arguments: What to read.
        ahead: Reads that may be done or under way before they are asked for.
    """
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
    """The same items, made in a thread of their own; it raises where `items` does.

    What makes the items must share nothing that changes with who takes them.

    Args:
        items: Made one after another, as always.
        ahead: Items that may wait to be taken.
    """
    iterator = iter(items)
    with ThreadPoolExecutor(1) as pool:
        made = read_ahead(pool, lambda _: list(islice(iterator, 1)), repeat(None), ahead)
        with closing(made):
            for item in made:
                if not item:
                    return
                yield from item
