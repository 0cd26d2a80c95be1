"""Memory of processes, as the system counts it."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from evaluation.setup.memory import files_mib, peak_memory_mib, resident_mib

CHILD = "from evaluation.setup.memory import peak_memory_mib; print(peak_memory_mib())"


def test_a_process_does_not_inherit_the_peak_of_its_parent() -> None:
    held = np.ones(50_000_000)  # 381 MiB
    assert peak_memory_mib() > 381
    done = subprocess.run([sys.executable, "-c", CHILD], capture_output=True, text=True, check=True)
    assert float(done.stdout) < 200
    assert len(held) == 50_000_000


def test_resident_memory_is_summed_over_processes() -> None:
    one = resident_mib([os.getpid()])
    if one is None:
        pytest.skip("this system does not count memory")
    both = resident_mib([os.getpid(), os.getpid()])
    assert both == pytest.approx(2 * one, rel=0.1)
    assert 10 < one < peak_memory_mib() + 1
    assert 0 < files_mib() < peak_memory_mib()


def test_resident_memory_of_a_process_that_has_ended_is_unknown() -> None:
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait()
    assert resident_mib([child.pid]) is None
