"""What happens in a worker: how it is set up, and what it does with a task."""

from __future__ import annotations

import os
import signal
import tempfile
import threading

from distributed import Worker, WorkerPlugin

from evaluation.environment import prepare


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
