"""Freed memory goes back to the system when it is asked for."""

from __future__ import annotations

import subprocess
import sys

import pytest

KEEPS_AND_HANDS_BACK = """
from evaluation.setup.environment import prepare
prepare(1)
from airground.core.freed_memory import hand_back_memory

def resident():
    return int(open("/proc/self/statm").read().split()[1]) * 4096 // 2**20

held = [bytearray(100_000) for _ in range(2000)]
top = bytearray(100_000)  # what lies above the freed memory keeps glibc from returning it
del held
kept = resident()
hand_back_memory()
print(kept, resident())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="glibc's allocator")
def test_what_was_freed_is_handed_back() -> None:
    done = subprocess.run(
        [sys.executable, "-c", KEEPS_AND_HANDS_BACK], capture_output=True, text=True, check=True
    )
    kept, left = map(int, done.stdout.split())
    assert kept - left > 150
