"""How much memory a stage needs at its peak, as the kernel counts it.

The resident set's high-water mark is set back (`/proc/self/clear_refs`) before the stage
makes its working memory, and read after one call: arrays of numpy, of compiled kernels and of
Open3D all count, pages that were asked for and never touched do not. What the allocator had
kept of earlier work is handed back first, or a stage could live on it unseen.
"""

from __future__ import annotations

import gc
from collections.abc import Callable
from pathlib import Path

from evaluation.setup.environment import hand_back_memory
from evaluation.setup.memory import held_kib

CLEAR_REFS = Path("/proc/self/clear_refs")
RESET_HIGH_WATER_MARK = "5"


def peak_memory_mib(call: Callable[[], object]) -> float | None:
    """What a call adds to the resident memory at its peak [MiB]; None where nobody counts it."""
    gc.collect()
    hand_back_memory()
    try:
        CLEAR_REFS.write_text(RESET_HIGH_WATER_MARK, encoding="ascii")
        before = held_kib("VmRSS")
        call()
        return max(0, held_kib("VmHWM") - before) / 1024
    except OSError:  # no Linux, or a container that hides it
        return None
