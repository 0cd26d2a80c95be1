"""Set-up that every test shares.

Markers (declared in pyproject.toml):
    slow: takes more than a few seconds; `make test` leaves it out, .ci/run takes it in.
    kernel: compares a compiled kernel with its slow twin. .ci/run repeats these with
        NUMBA_DISABLE_JIT=1, where coverage and debuggers see inside; so their data must be
        small enough to take under a second a test without the compiler.
"""

from __future__ import annotations

from evaluation.setup.environment import prepare

# Before any test module imports a library that reads it.
prepare()
