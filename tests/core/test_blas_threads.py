"""BLAS with one thread, and as before afterwards."""

from __future__ import annotations

import os
import subprocess
import sys

COUNTS = """
import numpy, scipy.linalg
from airground.core.blas_threads import _libraries, one_blas_thread
counts = lambda: [get() for get, _ in _libraries()]
@one_blas_thread()
def within():
    print(counts())
    raise ValueError
print(counts())
try:
    within()
except ValueError:
    print(counts())
"""


def test_blas_has_one_thread_within_and_the_number_that_was_set_afterwards() -> None:
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "2"}
    command = [sys.executable, "-c", COUNTS]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    before, within, after = done.stdout.splitlines()
    assert before == after
    assert before == "[]" or (set(before), set(within)) == (set("[2, 2]"), set("[1, 1]"))
