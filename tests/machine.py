"""The machine, as far as results depend on it: another processor or Python rounds otherwise.

`python -m tests.machine` prints its name.
"""

from __future__ import annotations

import platform
from pathlib import Path

from airground.io.digests import bytes_digest

PROCESSOR = ("model name", "flags")
"""The lines of /proc/cpuinfo that say what a processor is and can do."""


def machine(cpuinfo: Path = Path("/proc/cpuinfo")) -> str:
    """A name of 16 hexadecimal digits, the same for machines that give the same results."""
    known = cpuinfo.read_text(encoding="utf-8").splitlines() if cpuinfo.exists() else []
    of_cores = [line for line in known if line.startswith(PROCESSOR)]
    lines = [f"Python {platform.python_version()}", platform.machine(), *of_cores[:2]]
    return bytes_digest("".join(f"{line}\n" for line in lines).encode())[:16]


if __name__ == "__main__":
    print(machine())
