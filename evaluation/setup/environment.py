"""Settings that must precede the first heavy import: threads, memory and how to render.

Policy: BLAS gets one thread whatever is set, since the matrices here are small and its results
would depend on the number. Loops of numba, OpenMP and OpenCV, whose results do not depend on how
they are split, get one per core.
"""

from __future__ import annotations

import ctypes
import gc
import math
import os
import sys
from pathlib import Path

from airground.errors import InputError

CPU_QUOTA = Path("/sys/fs/cgroup/cpu.max")
"""The processor time that a container may use: "QUOTA PERIOD" or "max PERIOD"."""
KEPT_BYTES = 256 * 2**20
"""Freed memory that a process keeps for itself: some volumes and depth maps."""
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
    """Set the environment of this process and its children; variables that are set stay, except
    those of BLAS.

    Args:
        threads: Number of threads, which replaces what is set; None for one per usable core.

    Returns:
        The number of threads.

    Raises:
        InputError: `threads` is less than 1.
    """
    if threads is not None and threads < 1:
        raise InputError(f"--threads {threads}: must be at least 1")
    count = threads or usable_cores()
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"
    for name in ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"):
        if threads is not None:
            os.environ[name] = str(count)
        os.environ.setdefault(name, str(count))
    # Threads that wait for each other sleep: spinning, they take cores from threads with work.
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    # OpenMP first: with an outdated TBB, which numba would prefer, each run prints a warning.
    os.environ.setdefault("NUMBA_THREADING_LAYER_PRIORITY", "omp tbb workqueue")
    # A damaged image is reported by whoever reads it, in one line.
    os.environ.setdefault("OPENCV_LOG_LEVEL", "OFF")
    _choose_renderer()
    _keep_freed_memory()
    return count


def _choose_renderer() -> None:
    """EGL where its library loads, else OSMesa, for pyrender and for `sim.recording.render`.

    MuJoCo is kept from importing its own EGL module, which fails with PyOpenGL 3.1.0.
    """
    works = _loads("libEGL.so.1") and os.environ.get("MUJOCO_GL") != "osmesa"
    os.environ.setdefault("PYOPENGL_PLATFORM", "egl" if works else "osmesa")
    os.environ["MUJOCO_GL"] = "disabled"


def prepare_worker(threads: int) -> None:
    """Set the environment of a worker process; with one thread, bind it to one core.
    What libraries print goes to stderr, away from the results on stdout."""
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    if threads == 1:
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    prepare(threads)


def settle() -> None:
    """Exclude all present objects from garbage collection; call it when all is compiled.

    Libraries leave some 300 000 objects. A full collection would visit each of them, and no image
    would be tracked for 0.13 s. Only the first call of a process has an effect, since objects of
    later calls may become garbage.
    """
    if gc.get_freeze_count() == 0:
        gc.collect()
        gc.freeze()


def _keep_freed_memory() -> None:
    """Keep the memory of freed images and volumes for the next ones.

    By default glibc returns every array of more than some 100 kB to the system, which clears
    its pages again for the next one: a fifth of the time of reading an image. Other C libraries
    have no such setting. Children read theirs from the environment.
    """
    for name in ("MALLOC_MMAP_THRESHOLD_", "MALLOC_TRIM_THRESHOLD_"):
        os.environ.setdefault(name, str(KEPT_BYTES))
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError):
        return
    mallopt(_M_MMAP_THRESHOLD, KEPT_BYTES)
    mallopt(_M_TRIM_THRESHOLD, KEPT_BYTES)


def _loads(soname: str) -> bool:
    try:
        ctypes.CDLL(soname)
    except OSError:
        return False
    return True
