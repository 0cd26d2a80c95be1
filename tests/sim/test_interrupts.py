"""No process outlives its parent."""

import multiprocessing
import os
import signal
import time
from multiprocessing.connection import Connection

import pytest

from sim.interrupts import end_with_parent

SPAWN = multiprocessing.get_context("spawn")


def child(ready: Connection) -> None:
    end_with_parent()
    ready.send(os.getpid())
    time.sleep(60)


def parent(ready: Connection) -> None:
    SPAWN.Process(target=child, args=(ready,)).start()
    time.sleep(60)


def test_a_child_ends_with_a_parent_that_is_killed() -> None:
    mine, theirs = SPAWN.Pipe()
    process = SPAWN.Process(target=parent, args=(theirs,))
    process.start()
    theirs.close()
    assert mine.poll(30)
    mine.recv()
    assert process.pid is not None
    os.kill(process.pid, signal.SIGKILL)
    # The pipe ends when the last process that holds its other end does.
    assert mine.poll(10)
    with pytest.raises(EOFError):
        mine.recv()
    process.join()
