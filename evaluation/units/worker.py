"""What happens in a worker: how it is set up, and what it does with a task."""

from __future__ import annotations

import multiprocessing
import os
import signal
import tempfile
import threading
from typing import Any

from distributed import Worker, WorkerPlugin

from evaluation.environment import hand_back_memory, prepare


class PreparedWorker(WorkerPlugin):
    """Settles a worker's threads before its first task imports anything that reads them.

    Args:
        threads: Cores that the worker may use.
        scratch: Where its temporary files go, so that the next run can remove those of a worker
            that was killed; None for the machine's usual place.
    """

    name = "airground"

    def __init__(self, threads: int, scratch: str | None = None) -> None:
        self.threads = threads
        self.scratch = scratch

    def setup(self, worker: Worker) -> None:
        """Called by Dask in the worker."""
        prepare(self.threads)
        os.environ["LP_NUM_THREADS"] = str(self.threads)  # of Mesa's software renderer
        if self.scratch is not None:
            tempfile.tempdir = self.scratch
        if threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for who started it

    def transition(self, key: Any, start: str, finish: str, **kwargs: Any) -> None:
        """Called by Dask as a task goes on: the next one starts with the memory of the first."""
        if start == "executing":
            hand_back_memory()


def unfit(dask_worker: Worker) -> str | None:
    """Why a worker cannot do our tasks; called in it by Dask."""
    if dask_worker.state.nthreads != 1:
        return "does several tasks in one process; start workers with --nthreads 1"
    if multiprocessing.current_process().daemon:
        return (
            "may start no processes, which draw images; "
            "start workers with DASK_DISTRIBUTED__WORKER__DAEMON=False in their environment"
        )
    return None
