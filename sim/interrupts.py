"""Who hears Ctrl-C when there are several processes."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def deaf_children() -> Iterator[None]:
    """Processes that start in here leave Ctrl-C to their parent, from their first import on."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def end_children() -> None:
    """Stop every process that this one started: nobody waits for their work any more."""
    for child in multiprocessing.active_children():
        child.terminate()
