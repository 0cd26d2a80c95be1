"""Where results come from: version, revision, seed, machine."""

from __future__ import annotations

import os
import subprocess
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path


@dataclass(frozen=True)
class RunInfo:
    """Where results come from."""

    version: str
    git_revision: str
    seed: int
    cpu: str
    cores: int

    @classmethod
    def here(cls, seed: int) -> RunInfo:
        """This machine and this checkout."""
        try:
            own_version = version("airground")
        except PackageNotFoundError:
            own_version = "unknown"
        return cls(own_version, _git_revision(), seed, _cpu_name(), os.cpu_count() or 1)


def _git_revision() -> str:
    command = ["git", "-C", str(Path(__file__).parent), "describe", "--always", "--dirty"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return done.stdout.strip()


def _cpu_name() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return "unknown"
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else "unknown"
