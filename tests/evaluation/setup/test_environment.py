"""What is settled before the first heavy import, seen from a child process."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from airground.errors import InputError
from evaluation.setup.environment import prepare, usable_cores

FAULTS = """
import resource
import numpy as np
frames = [np.ones(150_000) for _ in range(8)]
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(20):
    frames.clear()
    frames = [np.ones(150_000) for _ in range(8)]
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""
SETTLED = """
import gc, weakref
from evaluation.setup.environment import settle

class Ring:
    pass

def made():
    ring = Ring()
    ring.itself = ring
    return weakref.ref(ring)

alive = [[number] for number in range(300_000)]
looked_through = [len(gc.get_objects())]
settle()
looked_through.append(len(gc.get_objects()))
frozen = gc.get_freeze_count()
new = [[number] for number in range(10)]
settle()
ring = made()
gc.collect()
print(*looked_through, gc.get_freeze_count() == frozen, ring() is None)
"""
SETTINGS = ("MALLOC_MMAP_THRESHOLD_", "MALLOC_TRIM_THRESHOLD_")


def faults(environment: dict[str, str]) -> int:
    """Pages that a process of this environment is given while it makes and drops arrays."""
    command = [sys.executable, "-c", FAULTS]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return int(done.stdout)


def test_children_keep_what_they_free(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in SETTINGS:
        monkeypatch.delenv(name, raising=False)
    usual = faults(dict(os.environ))
    if usual < 5_000:
        pytest.skip("the allocator of this machine keeps what is freed anyway")
    prepare()
    assert faults(dict(os.environ)) < usual / 10


def test_what_is_there_to_stay_is_looked_through_once() -> None:
    command = [sys.executable, "-c", SETTLED]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    before, after, once, garbage_goes = done.stdout.split()
    assert int(before) > 300_000 > 100 * int(after)
    assert (once, garbage_goes) == ("True", "True")


def test_threads_are_set_for_every_library(monkeypatch: pytest.MonkeyPatch) -> None:
    names = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENCV_FOR_THREADS_NUM")
    environment = {"OMP_NUM_THREADS": "7", "OPENBLAS_NUM_THREADS": "7"}
    monkeypatch.setattr("os.environ", environment)
    prepare()
    assert environment["OMP_NUM_THREADS"] == "7"
    assert environment["OPENBLAS_NUM_THREADS"] == "1"
    prepare(threads=3)
    assert [environment[name] for name in names] == ["3", "3", "3"]
    assert environment["OPENBLAS_NUM_THREADS"] == "1"


@pytest.mark.parametrize(
    ("user", "platform"),
    [
        ({}, "egl"),
        ({"MUJOCO_GL": "egl"}, "egl"),
        ({"MUJOCO_GL": "osmesa"}, "osmesa"),
        ({"PYOPENGL_PLATFORM": "osmesa"}, "osmesa"),
    ],
)
def test_osmesa_is_used_where_asked_for(
    monkeypatch: pytest.MonkeyPatch, user: dict[str, str], platform: str
) -> None:
    monkeypatch.setattr("evaluation.setup.environment._loads", lambda _soname: True)
    monkeypatch.setattr("os.environ", user)
    prepare()
    assert user["PYOPENGL_PLATFORM"] == platform
    assert user["MUJOCO_GL"] == "disabled"


def test_osmesa_stands_in_for_a_missing_egl(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("evaluation.setup.environment._loads", lambda _soname: False)
    monkeypatch.setattr("os.environ", environment := {})
    prepare()
    assert environment["PYOPENGL_PLATFORM"] == "osmesa"


def test_a_container_bounds_the_cores(tmp_path: Path) -> None:
    cores = len(os.sched_getaffinity(0))
    quota = tmp_path / "cpu.max"
    for text, count in (("50000 100000\n", 1), ("max 100000\n", cores), ("nonsense", cores)):
        quota.write_text(text, encoding="ascii")
        assert usable_cores(quota) == count
    assert usable_cores(tmp_path / "none") == cores


def test_no_threads_is_refused() -> None:
    with pytest.raises(InputError, match="--threads 0: must be at least 1"):
        prepare(0)
