"""The mapper takes the cores that no tracker wants, and no more."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

import pytest

from evaluation.run.live.priority import MOST_NICENESS, lowest_priority

Found = TypeVar("Found")


def policy() -> tuple[int, int]:
    """The scheduling policy and the niceness of the calling thread."""
    return os.sched_getscheduler(0), os.getpriority(os.PRIO_PROCESS, 0)


def of_a_thread(body: Callable[[], Found]) -> Found:
    """What `body` returns in a thread of its own, whose priority ends with it."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(body).result()


def test_threads_that_start_meanwhile_are_idle_too_and_those_before_are_not() -> None:
    def body() -> tuple[tuple[int, int], ...]:
        with ThreadPoolExecutor(1) as earlier:
            earlier.submit(threading.get_ident).result()
            with lowest_priority():
                return policy(), of_a_thread(policy), earlier.submit(policy).result()

    own, later, earlier = of_a_thread(body)
    assert own[0] == os.SCHED_IDLE
    assert later[0] == os.SCHED_IDLE
    assert earlier == policy()


@pytest.mark.skipif(os.geteuid() != 0, reason="without privileges a priority only falls")
def test_afterwards_the_priority_is_as_before() -> None:
    def body() -> tuple[int, int]:
        with lowest_priority():
            pass
        return policy()

    assert of_a_thread(body) == policy()


def test_where_the_system_forbids_it_the_mapper_is_as_nice_as_can_be(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def forbidden(*_: object) -> None:
        raise PermissionError("Operation not permitted")

    def body() -> tuple[int, int]:
        with lowest_priority():
            return policy()

    monkeypatch.setattr(os, "sched_setscheduler", forbidden)
    before = policy()
    assert of_a_thread(body) == (before[0], max(before[1], MOST_NICENESS))
