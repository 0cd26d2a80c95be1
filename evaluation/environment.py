"""What must be settled before the first heavy import: threads and how to render.

Policy: BLAS gets one thread, since the matrices here are small and its results would depend
on the number; numba's and OpenMP's loops, which give the same result however they are
split, get one per core, and OpenCV the same.
"""

from __future__ import annotations

import ctypes
import math
import os
from pathlib import Path

from airground.errors import InputError

CPU_QUOTA = Path("/sys/fs/cgroup/cpu.max")
"""Where a container says how much of the machine it may use: "QUOTA PERIOD" or "max PERIOD"."""


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
    return count


def _loads(soname: str) -> bool:
    try:
        ctypes.CDLL(soname)
    except OSError:
        return False
    return True
