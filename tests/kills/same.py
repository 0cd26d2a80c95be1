"""What two whole runs of a command must have in common: all that depends on no clock.

`simulate`, `export`: the bytes of every file. The others: those of every file but the ones named
here, tables without the rows of the clock, and summaries without their times.
"""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pandas as pd

from evaluation.table.rows import CLOCK_STAGES, LIVE_STAGE

EXACT = ("simulate", "export")
TIMES = ("report.html", "figures/table1_timing.*", "tables/timing.tex")
"""Hold times of the machine on every line or pixel."""
DRAWN = ("figures/fig05_15_augmented.*",)
"""Drawn by OpenGL in threads: the colour of some pixels varies."""
LIVE = ("mav_live.tum", "ground_live.tum", "claims.tum", "tables/live.tex")
"""Of `live`: poses and claims as they were given at the time, with what was known by then."""
SPEED = "recorded over processing seconds"
"""The row of tables that holds a speed."""
CLOCK_KEYS = frozenset({"timing_ms", "real_time_factor", "realtime"})
"""Parts of `summary.json`."""


def differences(verb: str, expected: Path, found: Path) -> list[str]:
    """Names of what differs between two outputs, or is in one only."""
    one, other = names(expected), names(found)
    wrong = [f"{name} is in one only" for name in sorted(one ^ other)]
    for name in sorted(one & other):
        read = _reader(verb, name)
        if read is not None and read(expected / name) != read(found / name):
            wrong.append(f"{name} differs")
    return wrong


def lacks_a_robot(output: Path) -> bool:
    """Whether it is of a live run that goes on without a robot whose process died, and says so."""
    summary = output / "summary.json"
    live = json.loads(summary.read_text("utf-8")).get("realtime") if summary.exists() else None
    return live is not None and any(live[name]["survived"] == 0 for name in ("mav", "ground"))


def compared(verb: str, output: Path) -> tuple[list[str], list[str]]:
    """Files that are compared, and those that are not."""
    every = sorted(names(output))
    left_out = [name for name in every if _reader(verb, name) is None]
    return [name for name in every if name not in left_out], left_out


def names(folder: Path) -> set[str]:
    """All names of files below a folder."""
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if not path.is_dir()}


def _reader(verb: str, name: str) -> Callable[[Path], Any] | None:
    """What is compared of a file; None for nothing."""
    path = Path(name)
    if verb in EXACT:
        return Path.read_bytes
    if any(path.match(one) for one in _left_out(verb)):
        return None
    if path.suffix == ".parquet":
        return rows_without_clock
    if path.name == "summary.json":
        return summary_without_clock
    if path.suffix == ".tex":
        return lines_without_speed
    return Path.read_bytes


def _left_out(verb: str) -> tuple[str, ...]:
    return TIMES + DRAWN + (LIVE if verb == "live" else ())


def rows_without_clock(path: Path) -> bytes:
    """A table without the rows that hold times, memory or speed."""
    frame = pd.read_parquet(io.BytesIO(path.read_bytes()))
    kept = frame[~frame["stage"].isin(CLOCK_STAGES | {LIVE_STAGE})]
    return bytes(kept.to_parquet(index=False))


def summary_without_clock(path: Path) -> dict[str, Any]:
    content = json.loads(path.read_text(encoding="utf-8"))
    return {key: value for key, value in content.items() if key not in CLOCK_KEYS}


def lines_without_speed(path: Path) -> list[str]:
    lines = path.read_text(encoding="utf-8").splitlines()
    return [line for line in lines if not line.startswith(SPEED)]
