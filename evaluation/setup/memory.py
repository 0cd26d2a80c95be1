"""Memory of processes: from psutil, and from Linux's /proc where psutil has no such number.

Read by hand are the high-water mark, which can also be set back, and the files in memory.
`getrusage` cannot replace the mark: `ru_maxrss` of a spawned process starts at what its parent
held, and cannot be set back.
"""

from __future__ import annotations

import gc
import resource
from collections.abc import Iterable
from pathlib import Path
from typing import Self

import psutil

from airground.core.freed_memory import hand_back_memory

STATUS, CLEAR_REFS = Path("/proc/self/status"), Path("/proc/self/clear_refs")
RESET_HIGH_WATER_MARK = "5"
"""Written to `CLEAR_REFS` (man proc_pid_clear_refs)."""


def peak_memory_mib() -> float:
    """The most memory that this process held at one time [MiB]."""
    most_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return _status_mib("VmHWM") or most_mib


def resident_mib(processes: Iterable[int]) -> float | None:
    """Memory that processes (PID) hold now, shared pages counted once [MiB].
    None where the system does not count it."""
    try:
        return sum(psutil.Process(pid).memory_full_info().pss for pid in processes) / 2**20
    except (psutil.Error, AttributeError):  # a process has ended; a system without this figure
        return None


def files_mib() -> float:
    """Files in this process's memory, mostly libraries, which other processes share [MiB].
    0 where the system does not count them."""
    return _status_mib("RssFile") or 0.0


class AddedMemory:
    """What a block adds to the resident memory of this process at its peak, in `mib` [MiB].

    Arrays of NumPy, of compiled kernels and of Open3D all count; pages that were allocated and
    never touched do not. Memory that the allocator kept of earlier work is handed back first:
    the block could use it unseen. `mib` is None where the system does not count it.
    """

    mib: float | None = None

    def __enter__(self) -> Self:
        gc.collect()
        hand_back_memory()
        try:
            CLEAR_REFS.write_text(RESET_HIGH_WATER_MARK, encoding="ascii")
            self._before_mib = _status_mib("VmRSS")
        except OSError:  # no Linux, or a container that hides it
            self._before_mib = None
        return self

    def __exit__(self, *_: object) -> None:
        peak_mib = _status_mib("VmHWM")
        if self._before_mib is not None and peak_mib is not None:
            self.mib = max(0.0, peak_mib - self._before_mib)


def _status_mib(key: str) -> float | None:
    """One line of what the kernel says of this process [MiB]; None if there is no such line."""
    try:
        lines = STATUS.read_text(encoding="ascii").splitlines()
    except OSError:
        return None
    return next((int(line.split()[1]) / 1024 for line in lines if line.startswith(f"{key}:")), None)
