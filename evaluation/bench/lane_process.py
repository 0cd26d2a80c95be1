"""A lane in a process of its own, which knows from its start how many cores it has.

Some libraries read the number of threads once, when they are loaded, so one process cannot
serve both numbers. A lane of one core is bound to one: no thread, whoever starts it, can help.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, ParamSpec, TypeVar

from airground.errors import AirgroundError
from evaluation.setup.environment import prepare
from sim.interrupts import deaf_children, end_children

if TYPE_CHECKING:
    # The process must be prepared before anything heavy is imported.
    from evaluation.bench.curves import CurvePoint
    from evaluation.bench.lane import Facts, Lane, Opened
    from evaluation.bench.row import Contender
    from evaluation.bench.sampler import Turn
    from evaluation.judge.live_summary import LiveSummary

P = ParamSpec("P")
T = TypeVar("T")

_lanes: list[Lane] = []
"""The one of this process."""


class LaneProcess:
    """Asks a lane in another process; answers as `Lane` does.

    Attributes:
        threads: How many it has.
    """

    def __init__(self, threads: int) -> None:
        self.threads = threads
        # Spawned, not forked: OpenMP's threads do not survive a fork.
        context = multiprocessing.get_context("spawn")
        self._pool = ProcessPoolExecutor(1, context, _prepare, (threads,))

    def open(self, path: Path, whole: bool) -> Opened:
        """Probe the cores and play the recording."""
        return self._ask(_open, path, whole)

    def live(self, path: Path) -> LiveSummary:
        """Play the recording at its own rate through the pipeline."""
        return self._ask(_live, path)

    def facts(self, row: str) -> Facts:
        return self._ask(_facts, row)

    def take_turn(self, contender: Contender | CurvePoint, seconds: float) -> Turn:
        return self._ask(_take_turn, contender, seconds)

    def peak_memory_mib(self, row: str) -> float | None:
        return self._ask(_peak_memory_mib, row)

    def clear(self) -> None:
        self._ask(_clear)

    def close(self) -> None:
        self._pool.shutdown(cancel_futures=True)

    def _ask(self, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        try:
            with deaf_children():
                future = self._pool.submit(function, *args, **kwargs)
            return future.result()
        except BrokenProcessPool:
            raise AirgroundError("a process died, perhaps for lack of memory") from None


@contextmanager
def lane_processes(counts: list[int]) -> Iterator[list[LaneProcess]]:
    """One lane for each number of threads; all of them end with the block."""
    lanes = [LaneProcess(count) for count in counts]
    try:
        yield lanes
    except BaseException:
        end_children()
        raise
    finally:
        for lane in lanes:
            lane.close()


def _prepare(threads: int) -> None:
    # What a library prints must not get between the lines of --json.
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    if threads == 1:
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    prepare(threads)


def _open(path: Path, whole: bool) -> Opened:
    from evaluation.bench.lane import open_lane

    lane, opened = open_lane(path, whole)
    _lanes[:] = [lane]
    return opened


def _live(path: Path) -> LiveSummary:
    from evaluation.bench.live import play_live

    return play_live(path)


def _facts(row: str) -> Facts:
    return _lanes[0].facts(row)


def _take_turn(contender: Contender | CurvePoint, seconds: float) -> Turn:
    return _lanes[0].take_turn(contender, seconds)


def _peak_memory_mib(row: str) -> float | None:
    return _lanes[0].peak_memory_mib(row)


def _clear() -> None:
    _lanes[0].clear()
