"""The processes that do the work: on this machine by default, or on any Dask cluster."""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeVar

import dask
from distributed import Client, KilledWorker, LocalCluster, Worker, WorkerPlugin, as_completed
from distributed.comm import CommClosedError

from airground.errors import AirgroundError, InputError
from evaluation.measure.work.batch_system import NO_DASHBOARD, batch_cluster
from evaluation.setup.environment import hand_back_memory, prepare
from sim.interrupts import end_children

Task = TypeVar("Task")
Outcome = TypeVar("Outcome")

DEATHS = 3
"""So many workers may die over one task before it is given up: it may be what kills them."""
RETRIES = 2
"""So often a task is tried again that failed by an error which is no user's."""
CONNECT_S = 30
SETTINGS = {
    # Our workers draw images in processes of their own, which daemons may not have.
    "distributed.worker.daemon": False,
    "distributed.scheduler.allowed-failures": DEATHS,
    # A compiled loop that holds a worker for minutes is no dead worker.
    "distributed.scheduler.worker-ttl": None,
    "distributed.admin.tick.limit": "1h",
}


class Crew:
    """Workers that start with the first task, and end with the block.

    Args:
        cluster: None for processes on this machine; `tcp://HOST:PORT` of a Dask scheduler that
            is there; or a YAML file that describes jobs of a batch system.
        cores: How many of this machine's they may use; a worker of a cluster uses one.
        tasks: How many there are to do at a time, at most: no more processes are started here.
        scratch: Folder for what they need while they work, on this machine.
    """

    def __init__(self, cluster: str | None, cores: int, tasks: int, scratch: Path) -> None:
        self._where = cluster
        self._cores = cores if cluster is None else 1
        self._workers = max(1, min(cores, tasks))
        self._scratch = scratch
        self._stack = ExitStack()
        self._client: Client | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            self._stack.close()
        except TimeoutError:  # on a busy machine; what was found is not lost for that
            end_children()

    def share(self, tasks: int) -> int:
        """Cores for each of so many tasks, so that few tasks do not leave cores idle."""
        return max(1, self._cores // max(1, tasks))

    def outcomes(
        self, function: Callable[[Task], Outcome], tasks: Sequence[Task]
    ) -> Iterator[tuple[int, Outcome]]:
        """What `function` makes of each task, as they are done: its index and its outcome.

        A worker that dies costs its task's time, for another does it again.

        Args:
            function: Of a module, since other processes import it.
            tasks: What to do.

        Raises:
            InputError: The cluster cannot be had.
            AirgroundError: Workers keep dying over a task, or the cluster went away.
        """
        if not tasks:
            return
        client = self._client or self._start()
        futures = {
            client.submit(function, task, pure=False, retries=RETRIES): index
            for index, task in enumerate(tasks)
        }
        try:
            for future, outcome in as_completed(futures, loop=client.loop, with_results=True):
                if isinstance(outcome, CancelledError):  # so Dask says that a cluster is gone
                    raise outcome
                yield futures[future], outcome
                future.release()  # so that nobody keeps what is already taken
        except KilledWorker:
            raise AirgroundError(
                f"{DEATHS + 1} processes died over the same task, perhaps for lack of memory; "
                "with fewer --threads less runs at a time"
            ) from None
        except (CancelledError, CommClosedError):
            raise AirgroundError(
                "the cluster went away; run the same again: what is finished is kept"
            ) from None

    def _start(self) -> Client:
        settings = {**SETTINGS, "temporary-directory": str(self._scratch)}
        self._stack.enter_context(dask.config.set(settings))
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        if self._where is None:
            client = self._stack.enter_context(Client(self._local(), set_as_default=False))
            worker = PreparedWorker(self.share(self._workers), str(self._scratch))
        else:
            client = self._stack.enter_context(_joined(self._where, self._stack))
            _check(client, self._where)
            worker = PreparedWorker(threads=1)
        client.register_plugin(worker)
        self._client = client
        return client

    def _local(self) -> LocalCluster:
        cluster = LocalCluster(
            n_workers=self._workers,
            threads_per_worker=1,
            processes=True,
            host="127.0.0.1",
            scheduler_kwargs=NO_DASHBOARD,
            memory_limit=0,
            silence_logs=logging.CRITICAL,
        )
        return self._stack.enter_context(cluster)


def _joined(where: str, stack: ExitStack) -> Client:
    """A client of a cluster that is there, or that a batch system starts."""
    if where.endswith((".yaml", ".yml")):
        return Client(stack.enter_context(batch_cluster(Path(where))), set_as_default=False)
    if "://" not in where:
        raise InputError(f"--cluster {where}: expected tcp://HOST:PORT or a .yaml file")
    try:
        return Client(where, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError(f"--cluster {where}: no Dask scheduler answers there ({error})") from None


def _check(client: Client, where: str) -> None:
    """Whether the workers that are there can do our tasks."""
    for address, fault in client.run(unfit).items():
        if fault is not None:
            raise InputError(f"--cluster {where}: worker {address} {fault}")


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
