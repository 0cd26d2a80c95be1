"""Workers of this machine take no orders from anyone who lacks the key of the run."""

from __future__ import annotations

import asyncio
import logging
import os
from pathlib import Path

import pytest
from distributed.security import Security

from airground.errors import InputError
from evaluation.measure.work.crew import Crew
from tests.evaluation.measure.connections import greeted, listening_ports


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
