"""A sequence gives the same bytes whatever threads libraries have and which was imported first."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from tests.sources import ROOT

REAL = ROOT.parent / "shared" / "real" / "tum_fr1_rpy_head"
TRACK = """
import hashlib, sys
for name in sys.argv[2:]:
    __import__(name)
from pathlib import Path
import numpy as np
from airground.config import Config
from airground.core.cloud import Source
from airground.core.messages import GroundImage
from airground.io.open_recording import open_robot
from airground.slam.front_ends import GROUND, Ingredients, make_front_end

recording = open_robot(Path(sys.argv[1]), Source.GROUND)
given = Ingredients(recording.calibration, Config(), np.random.default_rng(0))
slam = make_front_end(GROUND, "slam", given)
for stamped in recording.messages():
    if isinstance(stamped.message, GroundImage):
        slam.track(stamped.message)
slam.finish()
found = slam.trajectory()
print(hashlib.sha256(found.rotations.tobytes() + found.translations.tobytes()).hexdigest())
"""


def digest(threads: int, *first: str) -> str:
    """Of the final trajectory, found by a process of its own."""
    names = ("OPENBLAS", "OMP", "MKL", "NUMBA")
    settings = {f"{name}_NUM_THREADS": str(threads) for name in names}
    environment = {**os.environ, **settings, "OPENCV_FOR_THREADS_NUM": str(threads)}
    environment["PYTHONPATH"] = str(ROOT)
    command = [sys.executable, "-c", TRACK, str(REAL), *first]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return done.stdout.strip()


@pytest.mark.slow
@pytest.mark.skipif(not REAL.is_dir(), reason=f"real recording {REAL.name} is not here")
def test_threads_and_order_of_imports_change_no_byte() -> None:
    assert digest(1) == digest(4, "open3d", "scipy.linalg")
