"""Independent tasks on all cores, which Ctrl-C ends at once."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from airground.errors import AirgroundError
from evaluation.environment import prepare
from sim.interrupts import deaf_children, end_children

Task = TypeVar("Task")
Outcome = TypeVar("Outcome")


def outcomes(
    function: Callable[[Task], Outcome], tasks: Sequence[Task], workers: int
) -> Iterator[Outcome]:
    """What `function` makes of each task, in the order of the tasks.

    Args:
        function: Of a module, since other processes import it.
        tasks: What to do.
        workers: Processes at a time; where there are fewer tasks, each gets more threads.

    Raises:
        AirgroundError: A process died.
    """
    if not tasks:
        return
    processes = min(len(tasks), workers)
    # Spawned, not forked: OpenMP's threads do not survive a fork.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(processes, context, prepare, (max(1, workers // processes),))
    try:
        with deaf_children():
            futures = [pool.submit(function, task) for task in tasks]
        for future in futures:
            yield future.result()
    except BrokenProcessPool:
        raise AirgroundError(
            f"a process died, perhaps for lack of memory; try fewer than {processes} --threads"
        ) from None
    except BaseException:
        end_children()
        raise
    finally:
        pool.shutdown(cancel_futures=True)
