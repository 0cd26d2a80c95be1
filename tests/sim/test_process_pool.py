"""Processes that do tasks, and what their parent hears when one dies."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Iterator
from multiprocessing.connection import Connection
from threading import Timer
from typing import Any

import pytest

from sim.recording.process_pool import ProcessDied, ProcessPool

PATIENCE_S = 60.0
MORE_THAN_A_PIPE_HOLDS = 1 << 20
KILL_AFTER_S = 0.5

_prepared: list[str] = []


def prepare(word: str) -> None:
    _prepared.append(word)


def prepared() -> tuple[int, list[str]]:
    return os.getpid(), _prepared


def doubled(number: int) -> int:
    return 2 * number


def die() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def die_while_the_result_is_written() -> bytes:
    Timer(KILL_AFTER_S, die).start()
    return bytes(MORE_THAN_A_PIPE_HOLDS)


@pytest.fixture
def pool() -> Iterator[ProcessPool]:
    pool = ProcessPool(2, prepare, "ready")
    try:
        yield pool
    finally:
        pool.kill()
        assert not multiprocessing.active_children()


def test_tasks_are_done_by_processes_that_were_prepared(pool: ProcessPool) -> None:
    doubles = [pool.submit(doubled, number) for number in range(20)]
    assert [future.result(PATIENCE_S) for future in doubles] == [2 * n for n in range(20)]
    pid, words = pool.submit(prepared).result(PATIENCE_S)
    assert pid in {child.pid for child in multiprocessing.active_children()}
    assert words == ["ready"]


def test_an_error_comes_with_its_place_and_the_process_goes_on(pool: ProcessPool) -> None:
    wrong: Any = "wrong"
    with pytest.raises(ValueError, match="invalid literal") as caught:
        pool.submit(int, wrong).result(PATIENCE_S)
    assert "in _answer" in caught.value.__notes__[0]
    assert pool.submit(doubled, 4).result(PATIENCE_S) == 8


def test_arguments_that_cannot_be_sent_are_an_error(pool: ProcessPool) -> None:
    with pytest.raises((AttributeError, TypeError), match="pickle"):
        pool.submit(print, lambda: 0).result(PATIENCE_S)
    assert pool.submit(doubled, 4).result(PATIENCE_S) == 8


def test_a_process_that_dies_ends_all_that_is_submitted_later(pool: ProcessPool) -> None:
    with pytest.raises(ProcessDied):
        pool.submit(die).result(PATIENCE_S)
    with pytest.raises(ProcessDied):
        pool.submit(doubled, 4).result(PATIENCE_S)


def test_a_process_that_dies_while_it_writes_its_result_is_noticed(
    pool: ProcessPool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As by lack of memory. Nothing reads until it is dead, so half a result is in the pipe."""
    receive = Connection.recv

    def late(self: Connection) -> Any:
        deadline = time.monotonic() + PATIENCE_S
        while len(multiprocessing.active_children()) == 2 and time.monotonic() < deadline:
            time.sleep(0.01)
        return receive(self)

    monkeypatch.setattr(Connection, "recv", late)
    half = pool.submit(die_while_the_result_is_written)
    with pytest.raises(ProcessDied):
        half.result(PATIENCE_S)


def test_what_has_begun_is_done_when_the_pool_closes_and_the_rest_is_cancelled() -> None:
    pool = ProcessPool(1, prepare, "ready")
    begun = pool.submit(time.sleep, 0.5)
    waiting = pool.submit(doubled, 4)
    while not begun.running():
        time.sleep(0.01)
    pool.close()
    assert begun.done()
    assert begun.exception() is None
    assert waiting.cancelled()
    assert not multiprocessing.active_children()


def test_a_pool_that_is_killed_waits_for_nothing() -> None:
    pool = ProcessPool(1, prepare, "ready")
    begun = pool.submit(time.sleep, 10 * PATIENCE_S)
    while not begun.running():
        time.sleep(0.01)
    started = time.monotonic()
    pool.kill()
    assert time.monotonic() - started < PATIENCE_S
    assert isinstance(begun.exception(), ProcessDied)
