"""`python -m tests.hour`: memory, latencies and drops over an hour of recorded flight in laps."""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from sim.scene import load_scene
from sim.sensors.presets import PRESETS
from tests.hour.recording import record_laps
from tests.hour.watched import Poses, Watched, poses, watch

SETTLED_S = 600.0
"""From this time on the memory must not grow [s]."""
MAX_GROWTH_MIB = 50.0
MAX_LATE_MS = 100.0


def main() -> int:
    words = argparse.ArgumentParser(prog="python -m tests.hour", description=__doc__)
    words.add_argument("verb", nargs="?", default="live", choices=("live", "run"))
    words.add_argument("--duration", type=float, default=3600.0, help="length of the recording [s]")
    words.add_argument("--scene", default="indoor_a")
    words.add_argument("--seed", type=int, default=0)
    words.add_argument("--recording", type=Path, help="made there, or taken if it is there")
    words.add_argument("--workers", type=int, default=2, help="processes that draw images")
    asked = words.parse_args()
    with tempfile.TemporaryDirectory(prefix="airground-hour-") as name:
        recording = asked.recording or Path(name) / "recording"
        if not recording.exists():
            began_s = time.monotonic()
            preset = PRESETS["nominal"]
            flight = load_scene(asked.scene), asked.seed, preset, recording, asked.duration
            lap_s = record_laps(*flight, asked.workers)
            print(f"recorded laps of {lap_s:g} s in {time.monotonic() - began_s:.0f} s", flush=True)
        out = Path(name) / "out"
        watched = watch([asked.verb, str(recording), "--out", str(out)], asked.duration)
        if watched.code:
            print(watched.said, file=sys.stderr)
            return 1
        found = poses(out)
    print(memory_table(watched, asked.duration))
    print(pose_table(found))
    print(f"The machine lost {1e-3 * watched.stolen_ms(0.0, np.inf):.1f} s to its hypervisor.\n")
    failures = failed(watched, found)
    print("\n".join(failures))
    return int(bool(failures))


def memory_table(watched: Watched, duration_s: float) -> str:
    """Memory after the first minute and every tenth, and how it grew after the tenth."""
    minutes = [1, *range(10, math.ceil(duration_s / 60), 10)]
    rows = [(f"{minute}", watched.held_mib(60.0 * minute)) for minute in minutes]
    rows.append(
        ("largest before the last image", max((m for _, m in watched.memory), default=None))
    )
    rows.append(("growth after the tenth", watched.growth_mib(SETTLED_S)))
    rows.append(("after the last image", watched.at_end_mib))
    lines = [f"| {label} | {'-' if mib is None else f'{mib:.0f}'} |" for label, mib in rows]
    return "\n".join(["| minute | memory [MiB] |", "|---|---|", *lines, ""])


def pose_table(found: dict[str, Poses]) -> str:
    """How the poses of each robot came."""
    lines = ["| | median, 95 %, most [ms] | later than 100 ms | dropped | RMS error [cm] |"]
    lines.append("|---|---|---|---|---|")
    for robot, one in found.items():
        times = "-"
        if len(one.late_ms):
            times = ", ".join(f"{ms:.0f}" for ms in np.percentile(one.late_ms, [50, 95, 100]))
        late = len(one.later_than(MAX_LATE_MS))
        lines.append(f"| {robot} | {times} | {late} | {one.dropped} | {100 * one.final_m:.2f} |")
    return "\n".join([*lines, ""])


def failed(watched: Watched, found: dict[str, Poses]) -> list[str]:
    """What is beyond its limit, a line each."""
    lines = []
    growth = watched.growth_mib(SETTLED_S)
    if growth is not None and growth > MAX_GROWTH_MIB:
        lines.append(f"memory grew by {growth:.0f} MiB after the tenth minute")
    for robot, one in found.items():
        late = one.later_than(MAX_LATE_MS)
        if late:
            lines.append(f"{robot}: {len(late)} poses came later than {MAX_LATE_MS:.0f} ms")
            lines += [
                f"  {late_ms:.0f} ms at {at_s:.2f} s; "
                f"the machine lost {watched.stolen_ms(at_s):.0f} ms around it"
                for at_s, late_ms in late
            ]
        if one.dropped:
            lines.append(f"{robot}: {one.dropped} images were dropped")
    return lines


if __name__ == "__main__":
    sys.exit(main())
