"""Processes that start together compile each kernel once, and one of them twice."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
KERNELS = 5
ONE = """
@njit(cache=True)
def kernel_{n}(x):
    return (x * {n}.5).sum()
"""
CALLS = """
import numpy as np
import sys
print("ready", flush=True)
sys.stdin.readline()
kernels = [{names}]
with compiling_once("{group}"):
    for kernel in kernels:
        kernel(np.ones(3))
print(sum(sum(kernel.stats.cache_misses.values()) for kernel in kernels))
"""


def test_processes_that_start_together_do_not_compile_the_same(tmp_path: Path) -> None:
    names = ", ".join(f"kernel_{n}" for n in range(KERNELS))
    heads = "from numba import njit\nfrom airground.core.compile_once import compiling_once\n"
    source = heads + "".join(ONE.format(n=n) for n in range(KERNELS))
    (tmp_path / "program.py").write_text(
        source + CALLS.format(names=names, group=f"test-{os.getpid()}"), encoding="utf-8"
    )
    paths = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": paths}
    environment |= {"TMPDIR": str(tmp_path), "NUMBA_DISABLE_JIT": "0"}
    processes = [
        subprocess.Popen(
            [sys.executable, str(tmp_path / "program.py")],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for _ in range(2)
    ]
    for process in processes:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
    compiled = []
    for process in processes:
        assert process.stdin is not None
        process.stdin.write("\n")
        process.stdin.flush()
    for process in processes:
        said, _ = process.communicate()
        assert process.returncode == 0
        compiled.append(int(said))
    assert KERNELS <= sum(compiled) <= KERNELS + 1
