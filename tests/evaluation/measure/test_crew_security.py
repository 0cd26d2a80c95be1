"""Workers of this machine take no orders from anyone who lacks the key of the run."""

from __future__ import annotations

import asyncio
import logging
import os
from pathlib import Path

import psutil
import pytest
from distributed.comm import connect
from distributed.security import Security

from airground.errors import InputError
from evaluation.measure.work.crew import Crew


def listening_ports(of: int) -> list[int]:
    """Ports on which a process's children and their children listen."""
    family = [psutil.Process(of), *psutil.Process(of).children(recursive=True)]
    return [
        place.laddr.port
        for process in family
        for place in process.net_connections("tcp")
        if place.status == psutil.CONN_LISTEN
    ]


async def greeted(address: str, security: Security) -> None:
    """Connect as Dask's processes do: both ends say which protocol they speak."""
    arguments = security.get_connection_args("client")
    async with asyncio.timeout(5):
        comm = await connect(address, timeout=3, **arguments)
        comm.abort()


def own_process(_: int) -> int:
    return os.getpid()


@pytest.mark.parametrize("scheme", ["tcp", "tls"])
def test_a_stranger_is_refused(scheme: str, tmp_path: Path) -> None:
    with Crew(None, 1, 1, tmp_path) as crew:
        ((_, worker),) = crew.outcomes(own_process, [0])
        assert worker != os.getpid()
        ports = listening_ports(os.getpid())
        assert len(ports) >= 3  # scheduler, nanny, worker
        # With the key of another run, where the address asks for one.
        security = Security.temporary() if scheme == "tls" else Security()
        for port in ports:
            with pytest.raises((OSError, TimeoutError)):
                asyncio.run(greeted(f"{scheme}://127.0.0.1:{port}", security))


def test_a_cluster_without_encryption_is_named(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("evaluation.measure.work.crew.CONNECT_S", 1)
    with (
        caplog.at_level(logging.WARNING),
        pytest.raises(InputError, match="no Dask scheduler answers"),
        Crew("tcp://127.0.0.1:1", 1, 1, tmp_path) as crew,
    ):
        list(crew.outcomes(os.path.abspath, ["."]))
    assert "runs code as you" in caplog.text


def test_tls_without_certificates_is_one_line(tmp_path: Path) -> None:
    crew = Crew("tls://127.0.0.1:1", 1, 1, tmp_path)
    with pytest.raises(InputError, match="tls://127"), crew:
        list(crew.outcomes(os.path.abspath, ["."]))
