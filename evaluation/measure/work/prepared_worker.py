"""What a Dask worker sets before its first task.

Workers import this module to start, so it imports nothing that reads its number of threads when it
is imported, as numba does.
"""

from __future__ import annotations

import os
import signal
import tempfile
import threading
from typing import Any

from distributed import Worker, WorkerPlugin

from airground.core.freed_memory import hand_back_memory
from evaluation.setup.environment import prepare


class PreparedWorker(WorkerPlugin):
    """Sets a worker's number of threads before its first task imports libraries that read it.

    Args:
        threads: Cores that the worker may use.
        scratch: Folder of its temporary files, from which the next run removes those of a killed
            worker; None for the system's folder.
    """

    name = "airground"

    def __init__(self, threads: int, scratch: str | None = None) -> None:
        self.threads = threads
        self.scratch = scratch

    def setup(self, worker: Worker) -> None:
        """As `WorkerPlugin.setup`; called in the worker."""
        prepare(self.threads)
        os.environ["LP_NUM_THREADS"] = str(self.threads)  # Mesa's software renderer
        if self.scratch is not None:
            tempfile.tempdir = self.scratch
        if threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGINT, signal.SIG_IGN)  # the main process handles Ctrl-C

    def transition(self, key: Any, start: str, finish: str, **kwargs: Any) -> None:
        """As `WorkerPlugin.transition`: returns the memory of a finished task to the system."""
        if start == "executing":
            hand_back_memory()
