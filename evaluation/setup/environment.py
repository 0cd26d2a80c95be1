"""What must be settled before the first heavy import: threads, memory and how to render.

Policy: BLAS gets one thread, since the matrices here are small and its results would depend
on the number; numba's and OpenMP's loops, which give the same result however they are
split, get one per core, and OpenCV the same.
"""

from __future__ import annotations

import ctypes
import gc
import math
import os
from pathlib import Path

from airground.errors import InputError

CPU_QUOTA = Path("/sys/fs/cgroup/cpu.max")
"""Where a container says how much of the machine it may use: "QUOTA PERIOD" or "max PERIOD"."""
KEPT_BYTES = 256 * 2**20
"""Freed memory that a process keeps for itself."""
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # of glibc's malloc.h


def usable_cores(quota_file: Path = CPU_QUOTA) -> int:
    """Cores that this process may use: by affinity and by the container's quota."""
    cores = len(os.sched_getaffinity(0))
    try:
        quota, period = quota_file.read_text(encoding="ascii").split()
        return max(1, min(cores, math.ceil(int(quota) / int(period))))
    except (OSError, ValueError):  # no container, or "max"
        return cores


def prepare(threads: int | None = None) -> int:
    """Set the environment for this process and its children; what the user set stays.

    Args:
        threads: Threads to use; None for one per usable core.

    Returns:
        The number of threads.

    Raises:
        InputError: `threads` is less than 1.
    """
    if threads is not None and threads < 1:
        raise InputError(f"--threads {threads}: must be at least 1")
    count = threads or usable_cores()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("MKL_NUM_THREADS", "1")
    for name in ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"):
        if threads is not None:
            os.environ[name] = str(count)
        os.environ.setdefault(name, str(count))
    # Threads that wait for each other sleep: spinning, they take cores from whoever has work.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    # OpenMP first: an outdated TBB, which numba would prefer, makes it complain on every run.
    os.environ.setdefault("NUMBA_THREADING_LAYER_PRIORITY", "omp tbb workqueue")
    backend = "egl" if _loads("libEGL.so.1") else "osmesa"
    os.environ.setdefault("MUJOCO_GL", backend)
    os.environ.setdefault("PYOPENGL_PLATFORM", backend)
    _keep_freed_memory()
    return count


def settle() -> None:
    """To be called when all is loaded and compiled: what lives by then is there to stay.

    Libraries leave some 300 000 objects. Each full collection of garbage would go through all of
    them again, and for 0.13 s no image would be tracked. Only the first call of a process counts,
    since what a later one would keep may well become garbage.
    """
    if gc.get_freeze_count() == 0:
        gc.collect()
        gc.freeze()


def _keep_freed_memory() -> None:
    """Have the allocator keep what images and volumes leave for the next ones.

    By default glibc hands every array of more than some 100 kB back to the system, which has
    to clear its pages again for the next one: a fifth of the time of reading an image. Other C
    libraries have no such setting and are left alone. Children read theirs from the environment.
    """
    for name in ("MALLOC_MMAP_THRESHOLD_", "MALLOC_TRIM_THRESHOLD_"):
        os.environ.setdefault(name, str(KEPT_BYTES))
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError):
        return
    mallopt(_M_MMAP_THRESHOLD, KEPT_BYTES)
    mallopt(_M_TRIM_THRESHOLD, KEPT_BYTES)


def hand_back_memory() -> None:
    """Return to the system what was kept of freed memory, before other work begins."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # only glibc can be asked
    if trim is not None:
        trim(0)


def _loads(soname: str) -> bool:
    try:
        ctypes.CDLL(soname)
    except OSError:
        return False
    return True
