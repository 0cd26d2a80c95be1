"""Processes that do tasks, each over a pipe of its own.

The processes of `concurrent.futures.ProcessPoolExecutor` share one pipe for their results. One that
is killed while it writes leaves half a result there and keeps the lock of the others, so that its
parent waits without end. Here a killed process closes its pipe, and its parent notices.
"""

from __future__ import annotations

import multiprocessing
import traceback
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from multiprocessing.connection import Connection
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Any, NamedTuple, TypeVar

from sim.interrupts import deaf_children

Result = TypeVar("Result")


class ProcessDied(Exception):
    """A process of a pool died, so the pool does nothing more."""


class Task(NamedTuple):
    """What one of the processes is to do, and where its result goes."""

    future: Future[Any]
    work: Callable[..., Any]
    arguments: tuple[Any, ...]


class ProcessPool:
    """Processes that start at once and do tasks in the order in which they are submitted.

    Args:
        count: Number of processes.
        prepare: Called first in each process, with `arguments`; a function of a module.
    """

    def __init__(self, count: int, prepare: Callable[..., None], *arguments: Any) -> None:
        spawn = multiprocessing.get_context("spawn")
        self._tasks: SimpleQueue[Task | None] = SimpleQueue()
        self._died = False
        self._processes: list[multiprocessing.process.BaseProcess] = []
        self._threads: list[Thread] = []
        with deaf_children():
            for _ in range(count):
                pipe, theirs = spawn.Pipe()
                process = spawn.Process(target=_serve, args=(theirs, prepare, arguments))
                process.daemon = True
                process.start()
                theirs.close()  # with no other writer the pipe ends when the process does
                self._processes.append(process)
                self._threads.append(Thread(target=self._feed, args=(pipe,), daemon=True))
        for thread in self._threads:
            thread.start()

    def submit(self, work: Callable[..., Result], *arguments: Any) -> Future[Result]:
        """Have one of the processes do something. The result raises what `work` raised, or
        `ProcessDied` if one of the processes died before."""
        future: Future[Result] = Future()
        self._tasks.put(Task(future, work, arguments))
        return future

    def close(self) -> None:
        """Cancel what has not begun, wait for what has, and end the processes."""
        self._end()

    def kill(self) -> None:
        """The same without waiting: what has begun raises `ProcessDied`."""
        for process in self._processes:
            process.terminate()
        self._end()

    def _end(self) -> None:
        with suppress(Empty):
            while (task := self._tasks.get_nowait()) is not None:
                task.future.cancel()
        for _ in self._threads:
            self._tasks.put(None)
        for thread in self._threads:
            thread.join()
        for process in self._processes:
            process.join()

    def _feed(self, pipe: Connection) -> None:
        """Give tasks to the process at the other end, until there are no more or one died."""
        with pipe:
            while (task := self._tasks.get()) is not None:
                if not task.future.set_running_or_notify_cancel():
                    continue
                if self._died:
                    task.future.set_exception(ProcessDied())
                else:
                    self._have_done(task, pipe)

    def _have_done(self, task: Task, pipe: Connection) -> None:
        try:
            pipe.send((task.work, task.arguments))
            result, error = pipe.recv()
        except (EOFError, OSError):
            self._died = True
            task.future.set_exception(ProcessDied())
        except Exception as unsent:  # what cannot be pickled
            task.future.set_exception(unsent)
        else:
            if error is None:
                task.future.set_result(result)
            else:
                task.future.set_exception(error)


def _serve(pipe: Connection, prepare: Callable[..., None], arguments: tuple[Any, ...]) -> None:
    """The body of a process: tasks from the pipe, until its other end is closed."""
    prepare(*arguments)
    with pipe, suppress(EOFError):
        while True:
            work, given = pipe.recv()
            pipe.send(_answer(work, given))


def _answer(work: Callable[..., Any], arguments: tuple[Any, ...]) -> tuple[Any, Exception | None]:
    try:
        return work(*arguments), None
    except Exception as error:
        error.add_note(f"in another process:\n{traceback.format_exc()}")
        return None, error
