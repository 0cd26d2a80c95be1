"""The priority of a mapper beside two trackers."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress

MOST_NICENESS = 19
"""Of systems without SCHED_IDLE."""

logger = logging.getLogger(__name__)


@contextmanager
def lowest_priority() -> Iterator[None]:
    """This thread, and those that it starts, take only the cores that no other thread wants.

    To the scheduler of Linux, a core whose threads are all SCHED_IDLE is idle: a tracker that wakes
    up is put there at once. Beside threads of the most niceness it may wait for the other tracker's
    core instead, some 30 ms at a time. Afterwards this thread is as it was, where the system lets
    it: without privileges it does not.
    """
    niceness = os.getpriority(os.PRIO_PROCESS, 0)
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
    except OSError as error:  # a container may forbid it
        logger.debug("no SCHED_IDLE for the mapper: %s", error)
        os.setpriority(os.PRIO_PROCESS, 0, max(niceness, MOST_NICENESS))
    try:
        yield
    finally:
        with suppress(OSError):
            os.sched_setscheduler(0, policy, parameters)
            os.setpriority(os.PRIO_PROCESS, 0, niceness)
