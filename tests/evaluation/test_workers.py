"""Tasks in other processes: their order, their errors, their end."""

from __future__ import annotations

import os
import time

import pytest

from airground.errors import AirgroundError, InputError
from evaluation.workers import outcomes


def slowest_first(task: int) -> int:
    time.sleep(0.1 if task == 0 else 0.0)
    return task * task


def refuse(task: int) -> int:
    raise InputError(f"task {task} is no good")


def die(task: int) -> int:
    os._exit(1)


def take_forever(task: int) -> float:
    if task > 0:
        time.sleep(600)
    return time.time()


def test_outcomes_come_in_the_order_of_the_tasks() -> None:
    assert list(outcomes(slowest_first, [0, 1, 2], workers=2)) == [0, 1, 4]
    assert list(outcomes(slowest_first, [], workers=2)) == []


def test_a_tasks_error_is_passed_on() -> None:
    with pytest.raises(InputError, match="task 7 is no good"):
        list(outcomes(refuse, [7], workers=1))


def test_a_death_is_told() -> None:
    with pytest.raises(AirgroundError, match="a process died"):
        list(outcomes(die, [0], workers=1))


def test_an_interrupt_does_not_wait_for_what_is_running() -> None:
    def interrupted_after_the_first() -> None:
        for _ in outcomes(take_forever, [0, 1], workers=1):
            raise KeyboardInterrupt

    started = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        interrupted_after_the_first()
    assert time.monotonic() - started < 60
