"""Makes the frames of a plan on all cores: every one to disk, or those that are asked for."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, as_completed
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.errors import AirgroundError
from airground.io.png_encoder import encode_png
from sim.interrupts import end_with_parent
from sim.recording.frames import FrameMaker, FramePlan, Written
from sim.recording.process_pool import ProcessDied, ProcessPool
from sim.recording.render import draw_with
from sim.robots.motion import ROBOTS, Robot

FRAMES_PER_TASK = 8

Result = TypeVar("Result")
Task = tuple[Robot, int, int]
"""Robot, first frame, and the frame after the last."""


class FrameWorkers:
    """Processes that make frames. They start at once, so that they have imported all that they
    need when the first plan is ready. A context manager; an error in it ends the processes."""

    def __init__(self, count: int) -> None:
        self.count = count
        threads = max(len(os.sched_getaffinity(0)) // count, 1)
        self._pool = ProcessPool(count, _start_worker, threads)

    def __enter__(self) -> FrameWorkers:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is None:
            self._pool.close()
        else:
            self._pool.kill()  # results are not needed any more

    def submit(self, work: Callable[..., Result], *arguments: Any) -> Future[Result]:
        """Have one of the processes do something."""
        return self._pool.submit(work, *arguments)

    def died(self) -> AirgroundError:
        """What to raise when a process has died."""
        return AirgroundError(
            "a rendering process died, perhaps for lack of memory: "
            f"try fewer than {self.count} workers"
        )


def frame_workers(count: int) -> AbstractContextManager[FrameWorkers | None]:
    """Processes for `make_frames`; none for one worker, which is this process."""
    return nullcontext() if count == 1 else FrameWorkers(count)


def make_frames(plan: FramePlan, pool: FrameWorkers | None) -> Iterator[list[Written]]:
    """Write every frame; yields what was written, a few frames at a time, in any order.

    Args:
        plan: Frames to make.
        pool: Processes that make them; None is this process.

    Raises:
        AirgroundError: A process died, as when memory runs out.
    """
    tasks = _tasks(plan)
    if pool is None:
        with FrameMaker(plan) as maker:
            for task in tasks:
                yield _make(maker, task)
        return
    try:
        futures = [pool.submit(_work, plan, task) for task in tasks]
        for future in as_completed(futures):
            yield future.result()
    except ProcessDied:
        raise pool.died() from None


Picture = tuple[Robot, int, Path]
"""Robot, frame, and the file for its image."""


def make_pictures(
    plan: FramePlan, pictures: Sequence[Picture], pool: FrameWorkers | None
) -> Iterator[int]:
    """Write images, without depth; yields how many were written, a few at a time, in any order.

    Args:
        plan: Frames to choose from.
        pictures: Images to write.
        pool: Processes that make them; None is this process.

    Raises:
        AirgroundError: A process died, as when memory runs out.
    """
    tasks = [
        pictures[first : first + FRAMES_PER_TASK]
        for first in range(0, len(pictures), FRAMES_PER_TASK)
    ]
    if pool is None:
        with FrameMaker(plan) as maker:
            for task in tasks:
                yield _write_pictures(maker, task)
        return
    try:
        for future in as_completed([pool.submit(_work_on_pictures, plan, t) for t in tasks]):
            yield future.result()
    except ProcessDied:
        raise pool.died() from None


class FrameServer:
    """Gives a plan's frames as they are asked for, drawn a little ahead by other processes.

    Asked in order, a robot's frames come without waiting if drawing keeps up; in any other order
    each frame is drawn when it is asked for.
    """

    def __init__(self, plan: FramePlan, pool: FrameWorkers) -> None:
        self._plan, self._pool = plan, pool
        self._counts = {robot: len(frames.stamps_ns) for robot, frames in plan.frames.items()}
        self._ahead: dict[Robot, dict[int, Future[Any]]] = {robot: {} for robot in ROBOTS}
        for robot in ROBOTS:
            self._draw_ahead(robot, 0)

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
        except ProcessDied:
            raise self._pool.died() from None

    def _draw_ahead(self, robot: Robot, index: int) -> None:
        """Have this frame and the next ones drawn, and forget all others."""
        ahead = self._ahead[robot]
        wanted = range(index, min(index + 2 * self._pool.count + 1, self._counts[robot]))
        for other in [k for k in ahead if k not in wanted]:
            ahead.pop(other).cancel()
        for k in wanted:
            if k not in ahead:
                ahead[k] = self._pool.submit(_draw, self._plan, robot, k)


def _tasks(plan: FramePlan) -> list[Task]:
    """Runs of frames of all robots, taken in turn."""
    tasks: list[Task] = []
    for robot, frames in plan.frames.items():
        count = len(frames.stamps_ns)
        for first in range(0, count, FRAMES_PER_TASK):
            tasks.append((robot, first, min(first + FRAMES_PER_TASK, count)))
    return sorted(tasks, key=lambda task: task[1])


def _make(maker: FrameMaker, task: Task) -> list[Written]:
    robot, first, end = task
    return [written for index in range(first, end) for written in maker.make(robot, index)]


def _write_pictures(maker: FrameMaker, task: Sequence[Picture]) -> int:
    for robot, index, file in task:
        file.write_bytes(encode_png(maker.picture(robot, index)))
    return len(task)


_maker: tuple[Path, FrameMaker] | None = None  # one a process, of the plan with this recording


def _start_worker(threads: int) -> None:
    end_with_parent()
    draw_with(threads)
    cv2.setNumThreads(1)


def _maker_of(plan: FramePlan) -> FrameMaker:
    global _maker
    if _maker is None or _maker[0] != plan.recording:
        try:
            _maker = plan.recording, FrameMaker(plan)
        except OSError as error:
            raise AirgroundError(f"{plan.recording}: cannot be read: {error}") from None
    return _maker[1]


def _work(plan: FramePlan, task: Task) -> list[Written]:
    return _make(_maker_of(plan), task)


def _work_on_pictures(plan: FramePlan, task: Sequence[Picture]) -> int:
    return _write_pictures(_maker_of(plan), task)


def _draw(plan: FramePlan, robot: Robot, index: int) -> Any:
    maker = _maker_of(plan)
    return maker.mav(index) if robot == "mav" else maker.ground(index)
