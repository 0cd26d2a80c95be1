"""Makes the frames of a plan on all cores: every one to disk, or those that are asked for."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.errors import AirgroundError
from sim.interrupts import deaf_children, end_children, end_with_parent
from sim.recording.frames import FrameMaker, FramePlan, Written
from sim.robots.motion import ROBOTS, Robot

FRAMES_PER_TASK = 8

Task = tuple[Robot, int, int]
"""Robot, first frame, and the frame after the last."""


def make_frames(plan: FramePlan, workers: int) -> Iterator[list[Written]]:
    """Write every frame; yields what was written, a few frames at a time, in any order.

    With one worker the frames are made in this process.

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
    pool = _pool(plan, workers)
    try:
        with deaf_children():
            futures = [pool.submit(_work, task) for task in tasks]
        for future in as_completed(futures):
            yield future.result()
    except BrokenProcessPool:
        raise _died(workers) from None
    except BaseException:
        end_children()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


class FrameServer:
    """Gives a plan's frames as they are asked for, drawn a little ahead by other processes.

    A context manager. Asked in order, a robot's frames come without waiting if drawing keeps up;
    in any other order each frame is drawn when it is asked for.
    """

    def __init__(self, plan: FramePlan, workers: int) -> None:
        self._counts = {robot: len(frames.stamps_ns) for robot, frames in plan.frames.items()}
        self._workers = workers
        self._pool = _pool(plan, workers)
        self._ahead: dict[Robot, dict[int, Future[Any]]] = {robot: {} for robot in ROBOTS}

    def __enter__(self) -> FrameServer:
        with deaf_children():  # all processes start with the first tasks
            for robot in ROBOTS:
                self._draw_ahead(robot, 0)
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(cancel_futures=True)

    def mav(self, index: int) -> NDArray[np.uint8]:
        """As `FrameMaker.mav`; AirgroundError if a process died."""
        image: NDArray[np.uint8] = self._take("mav", index)
        return image

    def ground(self, index: int) -> tuple[NDArray[np.uint8], NDArray[np.uint16]]:
        """As `FrameMaker.ground`; AirgroundError if a process died."""
        images: tuple[NDArray[np.uint8], NDArray[np.uint16]] = self._take("ground", index)
        return images

    def _take(self, robot: Robot, index: int) -> Any:
        try:
            self._draw_ahead(robot, index)
            return self._ahead[robot].pop(index).result()
        except BrokenProcessPool:
            raise _died(self._workers) from None

    def _draw_ahead(self, robot: Robot, index: int) -> None:
        """Have this frame and the next ones drawn, and forget all others."""
        ahead = self._ahead[robot]
        wanted = range(index, min(index + 2 * self._workers + 1, self._counts[robot]))
        for other in [k for k in ahead if k not in wanted]:
            ahead.pop(other).cancel()
        for k in wanted:
            if k not in ahead:
                ahead[k] = self._pool.submit(_draw, robot, k)


def _pool(plan: FramePlan, workers: int) -> ProcessPoolExecutor:
    threads = max(len(os.sched_getaffinity(0)) // workers, 1)
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(workers, context, _start_worker, (plan, threads))


def _died(workers: int) -> AirgroundError:
    return AirgroundError(
        f"a rendering process died, perhaps for lack of memory: try fewer than {workers} workers"
    )


def _tasks(plan: FramePlan) -> list[Task]:
    """Runs of frames of both robots, taken in turn."""
    tasks: list[Task] = []
    for robot in ROBOTS:
        count = len(plan.frames[robot].stamps_ns)
        for first in range(0, count, FRAMES_PER_TASK):
            tasks.append((robot, first, min(first + FRAMES_PER_TASK, count)))
    return sorted(tasks, key=lambda task: task[1])


def _make(maker: FrameMaker, task: Task) -> list[Written]:
    robot, first, end = task
    return [written for index in range(first, end) for written in maker.make(robot, index)]


_maker: FrameMaker | AirgroundError | None = None  # one a process


def _start_worker(plan: FramePlan, threads: int) -> None:
    global _maker
    end_with_parent()
    os.environ.setdefault("LP_NUM_THREADS", str(threads))  # of Mesa's software renderer
    cv2.setNumThreads(1)
    try:
        _maker = FrameMaker(plan)
    except (AirgroundError, OSError) as error:
        # Raised with the first task: an error here breaks the pool and prints a traceback.
        _maker = AirgroundError(f"{plan.recording}: cannot be read: {error}")


def _made() -> FrameMaker:
    assert _maker is not None
    if isinstance(_maker, AirgroundError):
        raise _maker
    return _maker


def _work(task: Task) -> list[Written]:
    return _make(_made(), task)


def _draw(robot: Robot, index: int) -> Any:
    return _made().mav(index) if robot == "mav" else _made().ground(index)
