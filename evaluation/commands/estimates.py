"""Durations to be expected, for the line that a verb prints when it starts.

Rough factors from an idle machine of 2022 with two cores (docs/speed.md, docs/results.md), in
seconds of one core per recorded second, unless stated.
"""

from __future__ import annotations

from pathlib import Path

START_S = 20.0
"""Start of processes, compiled kernels from the cache, and the report [s]."""
RUN_S_PER_S = 0.6
"""Duration of `run` per recorded second, on two cores: 29 s for 52 s, and slower machines."""
TRACK_S_PER_S = 0.5
"""One front end over one robot's images: 15 ms per image at 30 Hz."""
RENDER_S_PER_S = 3.0
"""Images of both robots: 2 to 7 by the scene."""
MEASURE_S_PER_S = 3.0
"""The paper's protocol with one kind of maps: 2 without baselines, 4 with all of them."""


def work_s(core_s: float, cores: int) -> float:
    """Duration of work that is spread over cores [s]."""
    return START_S + core_s / max(1, cores)


def recorded(name: Path | str, seconds: float) -> str:
    """How messages name a recording: with its length."""
    return f"{name} ({seconds:.0f} s recorded)"
