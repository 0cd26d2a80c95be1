"""The first run on a machine, which compiles, gives the same bytes as those after it.

A kernel that numba loads from its cache may round otherwise than when it was just compiled:
inlining across compiled functions differs, and with it what a fused multiply-add takes in.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


@pytest.mark.slow(minutes=1)
@pytest.mark.subject("tests/digest_of_results.py")
def test_kernels_from_the_cache_round_as_they_did_when_compiled(tmp_path: Path) -> None:
    words = [sys.executable, "-m", "tests.digest_of_results"]
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    first, second = (
        subprocess.run(words, cwd=ROOT, env=environment, capture_output=True, text=True, check=True)
        for _ in range(2)
    )
    assert any((tmp_path / "cache").rglob("*.nbc"))
    lines = first.stdout.splitlines()
    for kind in ("depth map", "surface", "ground map", "belief", "alignment", "bundle"):
        assert any(line.startswith(kind) for line in lines)
    assert second.stdout.splitlines() == lines
