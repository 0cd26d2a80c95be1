"""Dask clusters: a running scheduler, jobs of a batch system, and refusals."""

from __future__ import annotations

import asyncio
import logging
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import dask
import pytest
from distributed import Client, LocalCluster
from distributed.security import Security

from airground.errors import AirgroundError, InputError
from evaluation.measure.work.batch_system import batch_cluster, read_jobs
from evaluation.measure.work.crew import Crew
from tests.evaluation.measure.connections import greeted, listening_ports

SLURM = """
jobs: 8
jobqueue:
  slurm: {cores: 4, processes: 4, memory: 16GB, walltime: "02:00:00"}
"""


def square(number: int) -> int:
    return number * number


def nap(seconds: float) -> float:
    time.sleep(seconds)
    return seconds


def squares(cluster: str, scratch: Path) -> list[tuple[int, int]]:
    with Crew(cluster, 1, 3, scratch) as crew:
        return sorted(crew.outcomes(square, [1, 2, 3]))


@contextmanager
def scheduler(scratch: Path, threads: int = 1, daemon: bool = False) -> Iterator[str]:
    """The address of a cluster of one worker."""
    settings = {"distributed.worker.daemon": daemon, "temporary-directory": str(scratch)}
    with (
        dask.config.set(settings),
        LocalCluster(
            n_workers=1,
            threads_per_worker=threads,
            host="127.0.0.1",
            scheduler_kwargs={"dashboard": False, "dashboard_address": "127.0.0.1:0"},
        ) as cluster,
    ):
        yield cluster.scheduler_address


def test_a_running_scheduler_is_used_and_not_stopped(tmp_path: Path) -> None:
    with scheduler(tmp_path) as address:
        for _ in range(2):
            assert squares(address, tmp_path) == [(0, 1), (1, 4), (2, 9)]


@pytest.mark.slow
@pytest.mark.subject("evaluation/measure/work", "evaluation/setup", "airground/errors.py")
def test_a_cluster_that_stops_is_an_error(tmp_path: Path) -> None:
    with scheduler(tmp_path) as address, Crew(address, 1, 2, tmp_path) as crew:
        outcomes = crew.outcomes(nap, [0.0, 600.0])
        assert next(outcomes) == (0, 0.0)
        with Client(address, set_as_default=False) as other:
            other.shutdown()
        with pytest.raises(AirgroundError, match="the cluster stopped"):
            next(outcomes)


@pytest.mark.slow
@pytest.mark.subject("evaluation/measure/work", "evaluation/setup", "airground/errors.py")
@pytest.mark.parametrize(
    ("threads", "daemon", "message"),
    [(2, False, "--nthreads 1"), (1, True, "DASK_DISTRIBUTED__WORKER__DAEMON=False")],
)
def test_unfit_workers_are_refused(
    threads: int, daemon: bool, message: str, tmp_path: Path
) -> None:
    with scheduler(tmp_path, threads, daemon) as address, pytest.raises(InputError, match=message):
        squares(address, tmp_path)


@pytest.mark.parametrize(
    ("cluster", "message"),
    [
        ("somewhere", "expected tls://HOST:PORT, tcp://HOST:PORT"),
        ("tcp://127.0.0.1:1", "no Dask scheduler answers"),
    ],
)
def test_a_missing_cluster_is_an_error(
    cluster: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("evaluation.measure.work.crew.CONNECT_S", 1)
    with pytest.raises(InputError, match=message):
        squares(cluster, tmp_path)


def test_a_batch_system_is_configured_as_for_dask_jobqueue(tmp_path: Path) -> None:
    file = tmp_path / "slurm.yaml"
    file.write_text(SLURM)
    jobs = read_jobs(file)
    assert jobs.jobs == 8
    assert jobs.jobqueue["slurm"]["walltime"] == "02:00:00"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("jobs: 8", "", "jobs: Field required"),
        ("jobs: 8", "jobs: 0", "jobs: Input should be greater"),
        ("jobs: 8", "jobs: 8\nworkers: 3", "workers: Extra inputs"),
        ("slurm:", "slrm:", "unknown system 'slrm'; known: slurm"),
        ("jobqueue:", "jobqueue: [", "cannot be read"),
        ("8", "!!python/object/apply:os.system ['true']", "cannot be read"),
        ("jobqueue:", "jobqueue: " + 900 * "[", "nested too deep"),
        ("processes: 4", "processes: 2", "must be the same number"),
    ],
)
def test_an_invalid_file_is_an_error(old: str, new: str, message: str, tmp_path: Path) -> None:
    pytest.importorskip("dask_jobqueue")
    file = tmp_path / "slurm.yaml"
    with pytest.raises(InputError, match=r"slurm\.yaml: No such file"):
        read_jobs(file)
    assert old in SLURM
    file.write_text(SLURM.replace(old, new, 1))
    with pytest.raises(InputError, match=message):
        batch_cluster(file, tmp_path)


JOBS = """
jobs: 1
jobqueue:
  local: {cores: 1, processes: 1, memory: 4GB, interface: lo, local_directory: FOLDER}
"""


def modes_of_keys(_: int, folder: Path) -> set[str]:
    return {oct(path.stat().st_mode & 0o777) for path in folder.glob(".dask-jobqueue.worker.*")}


@pytest.mark.slow
@pytest.mark.subject("evaluation/measure/work", "evaluation/setup", "airground/errors.py")
def test_jobs_run_tasks_and_accept_only_the_key_of_the_run(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    pytest.importorskip("dask_jobqueue")
    file, keys = tmp_path / "local.yaml", tmp_path / "keys"
    keys.mkdir()
    file.write_text(JOBS.replace("FOLDER", str(tmp_path)))
    with caplog.at_level(logging.WARNING), Crew(str(file), 1, 3, keys) as crew:
        modes = [mode for _, mode in crew.outcomes(partial(modes_of_keys, folder=keys), [0])]
        assert modes == [{"0o600"}]
        assert sorted(crew.outcomes(square, [1, 2, 3])) == [(0, 1), (1, 4), (2, 9)]
        for port in listening_ports(os.getpid()):
            with pytest.raises((OSError, TimeoutError)):
                asyncio.run(greeted(f"tls://127.0.0.1:{port}", Security.temporary()))
            with pytest.raises((OSError, TimeoutError)):
                asyncio.run(greeted(f"tcp://127.0.0.1:{port}", Security()))
    assert "runs code as you" not in caplog.text


@pytest.mark.slow
@pytest.mark.subject("evaluation/measure/work", "evaluation/setup", "airground/errors.py")
def test_jobs_of_a_file_that_names_a_protocol_use_it(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    pytest.importorskip("dask_jobqueue")
    file = tmp_path / "local.yaml"
    lines = JOBS.replace("FOLDER", str(tmp_path)).replace("cores: 1", "cores: 1, protocol: tcp")
    file.write_text(lines)
    with caplog.at_level(logging.WARNING):
        assert squares(str(file), tmp_path) == [(0, 1), (1, 4), (2, 9)]
    assert "runs code as you" in caplog.text
