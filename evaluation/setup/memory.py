"""How much memory processes hold, as the kernel counts it."""

from __future__ import annotations

import resource
from pathlib import Path

STATUS = Path("/proc/self/status")


def peak_memory_mib() -> float:
    """The most memory that this process ever held [MiB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def resident_mib(*processes: int | str) -> float | None:
    """What these processes ("self", or by number) hold now [MiB]; None where nobody counts it.

    What several share counts once.
    """
    try:
        return sum(held_kib("Pss", Path(f"/proc/{one}/smaps_rollup")) for one in processes) / 1024
    except OSError:
        return None


def files_mib() -> float:
    """Files in this process's memory, mostly libraries, which other processes share [MiB].

    0 where nobody counts them.
    """
    try:
        return held_kib("RssFile") / 1024
    except OSError:
        return 0.0


def held_kib(key: str, status: Path = STATUS) -> int:
    """One line of what the kernel says of a process [KiB].

    Raises:
        OSError: There is no such line: no Linux, or a container that hides it.
    """
    for line in status.read_text(encoding="ascii").splitlines():
        if line.startswith(f"{key}:"):
            return int(line.split()[1])
    raise OSError(f"{status} has no {key}")
