"""Makes all frames of a plan on all cores."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool

import cv2

from airground.errors import AirgroundError
from sim.frames import FrameMaker, FramePlan, Written
from sim.interrupts import deaf_children, end_children
from sim.motion import ROBOTS, Robot

FRAMES_PER_TASK = 8

Task = tuple[Robot, int, int]
"""Robot, first frame, and the frame after the last."""


def make_frames(plan: FramePlan, workers: int) -> Iterator[list[Written]]:
    """Write every frame; yields what was written, a few frames at a time, in any order.

    Args:
        plan: What to make.
        workers: Number of processes; with 1 the frames are made in this one.

    Raises:
        AirgroundError: A process died, as when memory runs out.
    """
    tasks = _tasks(plan)
    if workers == 1:
        with FrameMaker(plan) as maker:
            for task in tasks:
                yield _make(maker, task)
        return
    workers = min(workers, len(tasks))
    threads = max(len(os.sched_getaffinity(0)) // workers, 1)
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, context, _start_worker, (plan, threads))
    try:
        with deaf_children():
            futures = [pool.submit(_work, task) for task in tasks]
        for future in as_completed(futures):
            yield future.result()
    except BrokenProcessPool:
        raise AirgroundError(
            "a rendering process died, perhaps for lack of memory: "
            f"try fewer than {workers} workers"
        ) from None
    except BaseException:
        end_children()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _tasks(plan: FramePlan) -> list[Task]:
    """Runs of frames of both robots, taken in turn."""
    tasks: list[Task] = []
    for robot in ROBOTS:
        count = len(plan.stamps_ns[robot])
        for first in range(0, count, FRAMES_PER_TASK):
            tasks.append((robot, first, min(first + FRAMES_PER_TASK, count)))
    return sorted(tasks, key=lambda task: task[1])


def _make(maker: FrameMaker, task: Task) -> list[Written]:
    robot, first, end = task
    return [written for index in range(first, end) for written in maker.make(robot, index)]


_maker: FrameMaker | None = None  # one a process


def _start_worker(plan: FramePlan, threads: int) -> None:
    global _maker
    os.environ.setdefault("LP_NUM_THREADS", str(threads))  # of Mesa's software renderer
    cv2.setNumThreads(1)
    _maker = FrameMaker(plan)


def _work(task: Task) -> list[Written]:
    assert _maker is not None
    return _make(_maker, task)
