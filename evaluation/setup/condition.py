"""Under what something was measured, and where results come from."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path


@dataclass(frozen=True)
class Condition:
    """The condition of a measurement.

    Attributes:
        preset: "best", "paper" or "paper_literal".
        poses: "slam", "oracle exact", "oracle with drift", or "slam, exact mav" (or ground).
        sensors: "none", "nominal", "harsh", "paper" or "real".
        heading: "known" or "search".
        variant: Other differences from the preset, as text; empty without any.
    """

    preset: str
    poses: str
    sensors: str
    heading: str
    variant: str = ""

    def parts(self) -> tuple[str, ...]:
        poses = {
            "slam": "poses from SLAM",
            "oracle exact": "exact poses",
            "oracle with drift": "poses with drift",
            "slam, exact mav": "exact poses of the MAV, the ground robot's from SLAM",
            "slam, exact ground": "exact poses of the ground robot, the MAV's from SLAM",
        }
        heading = {"known": "heading known", "search": "heading searched"}
        return (
            f"preset {self.preset}" + (f" ({self.variant})" if self.variant else ""),
            poses.get(self.poses, self.poses),
            f"{self.sensors} sensors" if self.sensors != "none" else "noise-free sensors",
            heading.get(self.heading, self.heading),
        )

    def label(self) -> str:
        """One line for captions."""
        return ", ".join(self.parts())


def short_labels(conditions: Sequence[Condition]) -> list[str]:
    """Labels that name only what differs between the conditions."""
    columns = list(zip(*(condition.parts() for condition in conditions), strict=True))
    differ = [len(set(column)) > 1 for column in columns]
    if not any(differ):
        return [condition.label() for condition in conditions]
    return [
        ", ".join(part for part, kept in zip(condition.parts(), differ, strict=True) if kept)
        for condition in conditions
    ]


def shared_parts(conditions: Sequence[Condition]) -> str:
    """The parts that all conditions share and short labels leave out."""
    columns = list(zip(*(condition.parts() for condition in conditions), strict=True))
    return ", ".join(column[0] for column in columns if len(set(column)) == 1)


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
