"""Signals reach the process that they are meant for."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress

import pytest

from tests.kills.roles import Role, role, send, session

PARENT = """
import subprocess, sys, time
sleep = "import open3d, time; print(flush=True); time.sleep(600)"
draw = "import ctypes; ctypes.CDLL('libOSMesa.so.8'); " + sleep
tracker = sleep + " # resource_tracker"
below = [subprocess.Popen([sys.executable, "-c", one], stdout=-1) for one in (sleep, draw, tracker)]
for one in below:
    one.stdout.readline()
print(*(one.pid for one in below), flush=True)
time.sleep(600)
"""


@pytest.fixture
def family() -> Iterator[tuple[int, int, int, int]]:
    """Numbers of a parent, a worker, a renderer and a helper of the interpreter."""
    words = [sys.executable, "-c", PARENT]
    with subprocess.Popen(words, stdout=subprocess.PIPE, start_new_session=True) as parent:
        assert parent.stdout is not None
        worker, renderer, helper = map(int, parent.stdout.readline().split())
        yield parent.pid, worker, renderer, helper
        for pid in session(parent.pid):
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)


def wait_for(leader: int, alive: set[int]) -> None:
    end = time.monotonic() + 60
    while set(session(leader)) != alive:
        assert time.monotonic() < end
        time.sleep(0.02)


def test_each_role_gets_its_signal(family: tuple[int, int, int, int]) -> None:
    parent, worker, _, helper = family
    assert [role(pid, parent) for pid in family] == [
        Role.PARENT,
        Role.WORKER,
        Role.RENDERER,
        None,
    ]
    assert send(signal.SIGKILL, Role.RENDERER, parent, 5) is Role.RENDERER
    wait_for(parent, {parent, worker, helper})
    assert send(signal.SIGKILL, Role.RENDERER, parent, 5) is Role.WORKER
    wait_for(parent, {parent, helper})
    assert send(signal.SIGKILL, Role.WORKER, parent, 0) is Role.PARENT
    wait_for(parent, {helper})
    assert send(signal.SIGTERM, Role.GROUP, parent, 0) is Role.GROUP
    wait_for(parent, set())
    assert send(signal.SIGKILL, Role.WORKER, parent, 0) is None
