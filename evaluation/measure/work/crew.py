"""Worker processes: on this machine by default, or on any Dask cluster."""

from __future__ import annotations

import logging
import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self, TypeVar

import dask
from distributed import Client, Future, KilledWorker, LocalCluster, Worker, as_completed
from distributed.comm import CommClosedError
from distributed.security import Security

from airground.errors import AirgroundError, InputError
from evaluation.measure.work.batch_system import NO_DASHBOARD, batch_cluster
from evaluation.measure.work.prepared_worker import PreparedWorker
from sim.interrupts import end_children

Task = TypeVar("Task")
Outcome = TypeVar("Outcome")

DEATHS = 3
"""Worker deaths that one task may survive: after more, the task itself is taken as the cause."""
RETRIES = 2
"""Further attempts at a task that failed with an error other than `InputError`."""
CONNECT_S = 30
"""Longest wait for a scheduler [s]."""
SETTINGS = {
    # Workers render images in processes of their own, which daemons may not start.
    "distributed.worker.daemon": False,
    "distributed.scheduler.allowed-failures": DEATHS,
    # A compiled loop can block a live worker for minutes.
    "distributed.scheduler.worker-ttl": None,
    "distributed.admin.tick.limit": "1h",
}


logger = logging.getLogger(__name__)


class Crew:
    """Workers that start with the first task and end with the block.

    Args:
        cluster: None for processes on this machine; `tls://HOST:PORT` or `tcp://HOST:PORT` of a
            running Dask scheduler; or a YAML file that describes jobs of a batch system.
        cores: Cores of this machine for all workers; a worker of a cluster uses one.
        tasks: Largest number of tasks at a time, and so of processes here.
        scratch: Folder for temporary files of the workers on this machine, and for the key of jobs
            of a batch system.
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
        except TimeoutError:  # on a busy machine; the results are here already
            end_children()

    def share(self, tasks: int) -> int:
        """Cores for each of `tasks` tasks, so that few tasks leave no core idle."""
        return max(1, self._cores // max(1, tasks))

    def outcomes(
        self, function: Callable[[Task], Outcome], tasks: Sequence[Task]
    ) -> Iterator[tuple[int, Outcome]]:
        """Index and outcome of each task, in the order in which they finish.

        Tasks that are appended meanwhile are done too, after those before them. The task of a
        worker that dies is repeated by another. Other processes import `function`.

        Raises:
            InputError: The cluster cannot be reached or used.
            AirgroundError: Too many workers died over a task, or the cluster stopped.
        """
        if not tasks:
            return
        client = self._client or self._start()
        indices: dict[Future, int] = {}
        running = as_completed(loop=client.loop, with_results=True)
        try:
            while len(indices) < len(tasks) or not running.is_empty():
                for task in tasks[len(indices) :]:
                    future = client.submit(function, task, pure=False, retries=RETRIES)
                    indices[future] = len(indices)
                    running.add(future)
                future, outcome = next(running)
                if isinstance(outcome, CancelledError):  # the cluster has stopped
                    raise outcome
                yield indices[future], outcome
                future.release()  # frees the outcome in the cluster
        except KilledWorker:
            raise AirgroundError(
                f"{DEATHS + 1} processes died over the same task, perhaps for lack of memory; "
                "give fewer --threads"
            ) from None
        except (CancelledError, CommClosedError):
            raise AirgroundError(
                "the cluster stopped; run the same command again to go on: finished units are kept"
            ) from None

    def _start(self) -> Client:
        settings = {**SETTINGS, "temporary-directory": str(self._scratch)}
        self._stack.enter_context(dask.config.set(settings))
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        if self._where is None:
            client = self._stack.enter_context(Client(self._local(), set_as_default=False))
            worker = PreparedWorker(self.share(self._workers), str(self._scratch))
        else:
            client = self._stack.enter_context(_joined(self._where, self._stack, self._scratch))
            _check(client, self._where)
            worker = PreparedWorker(threads=1)
        client.register_plugin(worker)
        self._client = client
        return client

    def _local(self) -> LocalCluster:
        # Whoever reaches a port of Dask runs code as this user, and other users of the machine
        # reach the loopback interface: only holders of this run's own key may connect.
        try:
            cluster = LocalCluster(
                n_workers=self._workers,
                threads_per_worker=1,
                processes=True,
                host="127.0.0.1",
                protocol="tls",
                security=Security.temporary(),
                scheduler_kwargs=NO_DASHBOARD,
                memory_limit=0,
                silence_logs=logging.CRITICAL,
            )
        except RuntimeError as error:  # of Dask, where a worker dies before it is ready
            logger.debug("Dask: %s", error)
            raise AirgroundError(
                "the worker processes did not start, perhaps for lack of memory; "
                "give fewer --threads"
            ) from None
        return self._stack.enter_context(cluster)


def _joined(where: str, stack: ExitStack, keys: Path) -> Client:
    """A client of a running cluster, or of one that a batch system starts, with its key in the
    folder `keys`."""
    if where.endswith((".yaml", ".yml")):
        cluster = stack.enter_context(batch_cluster(Path(where), keys))
        _warn_unless_encrypted(where, cluster.scheduler_address)
        return Client(cluster, set_as_default=False)
    if "://" not in where:
        raise InputError(
            f"--cluster {where}: expected tls://HOST:PORT, tcp://HOST:PORT or a .yaml file"
        )
    _warn_unless_encrypted(where, where)
    try:
        return Client(where, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(f"--cluster {where}: no Dask scheduler answers there ({error})") from None


def _warn_unless_encrypted(where: str, address: str) -> None:
    if not address.startswith("tls://"):
        logger.warning(
            "--cluster %s: not encrypted; whoever reaches a port of this cluster runs code as you "
            "(docs/sweep.md has tls://)",
            where,
        )


def _check(client: Client, where: str) -> None:
    """Raise InputError if a worker of the cluster cannot do our tasks."""
    for address, fault in client.run(unfit).items():
        if fault is not None:
            raise InputError(f"--cluster {where}: worker {address} {fault}")


def unfit(dask_worker: Worker) -> str | None:
    """Reason for which a worker cannot do our tasks, None without; called in the worker."""
    if dask_worker.state.nthreads != 1:
        return "does several tasks in one process; start workers with --nthreads 1"
    if multiprocessing.current_process().daemon:
        return (
            "may start no processes, which render images; "
            "start workers with DASK_DISTRIBUTED__WORKER__DAEMON=False in their environment"
        )
    return None
