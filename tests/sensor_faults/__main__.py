"""`python -m tests.sensor_faults`: a table of faults, and what became of the robots' poses."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from airground.io.recording import Recording
from sim.recording.recorder import Flight, record
from sim.scene import load_scene
from sim.sensors.faults import GROUND_ONLY, Fault, placed
from sim.sensors.presets import NOMINAL
from tests.sensor_faults.case import Outcome, drawn, outcome, outcome_in, unseen

SCENE, SEED = "tiny", 0
LASTING: dict[str, tuple[float, ...]] = {
    "black": (0.1, 1.0, 5.0),
    "frozen": (0.1, 1.0, 5.0),
    "repeated": (1.0, 5.0),
    "dropped": (0.1, 1.0, 5.0),
    "exposure": (0.1, 2.0),
    "depth_gone": (0.1, 1.0, 5.0),
    "imu_saturated": (0.1, 1.0),
    "imu_silent": (0.1, 1.0, 5.0),
    "imu_gap": (0.1, 1.0, 5.0),
    "two_imu_gaps": (0.5,),
    "clock": (0.0,),
    "carried": (1.0, 3.0),
}
"""Durations of each kind of fault [s]."""
APART_S = 2.0
"""Time from the start of one of two gaps to that of the next [s]."""
HEADINGS = (
    "fault",
    "lasts [s]",
    "robot",
    "images",
    "without a pose",
    "again after [s]",
    "step [cm]",
    "step [sigma]",
    "off [cm]",
    "off [deg]",
    "silently wrong [s]",
    "posed though unseen",
    "traceback",
)


def main() -> None:
    words = argparse.ArgumentParser(prog="python -m tests.sensor_faults", description=__doc__)
    words.add_argument("kinds", nargs="*", default=list(LASTING), help=", ".join(LASTING))
    words.add_argument("--count", type=int, default=1, help="moments of each fault")
    words.add_argument("--recording", type=Path, help=f"recording of {SCENE}, seed {SEED}, nominal")
    words.add_argument("--robot", choices=("mav", "ground"), help="only this one")
    asked = words.parse_args()
    with tempfile.TemporaryDirectory(prefix="airground-faults-") as folder:
        path = asked.recording or record(
            load_scene(SCENE), SEED, NOMINAL, Path(folder) / SCENE, workers=1
        )
        recording = Recording.open(path)
        print(f"| {' | '.join(HEADINGS)} |\n{'|---' * len(HEADINGS)}|", flush=True)
        for kind in asked.kinds:
            for robot in ("ground",) if kind in GROUND_ONLY else ("mav", "ground"):
                for duration_s in LASTING[kind] if asked.robot in (None, robot) else ():
                    moments = range(asked.count)
                    made = [faults_of(kind, robot, duration_s, recording, k) for k in moments]
                    outcomes = [outcome_of(recording, faults) for faults in made]
                    print(_row(kind, duration_s, robot, outcomes), flush=True)


def faults_of(
    kind: Any, robot: Any, duration_s: float, recording: Recording, number: int
) -> tuple[Fault, ...]:
    """The faults of a case; another number is another moment."""
    rng = np.random.default_rng([SEED, number])
    if kind != "two_imu_gaps":
        return placed([Fault(kind, robot, duration_s)], recording.duration_s, rng)
    (first,) = placed([Fault("imu_gap", robot, duration_s)], recording.duration_s, rng)
    assert first.start_s is not None
    return first, replace(first, start_s=first.start_s + APART_S)


def outcome_of(recording: Recording, faults: Sequence[Fault]) -> Outcome:
    """What becomes of the robot's poses. A robot that is carried has another motion, so that its
    images are rendered anew; other faults act on the stored images and samples."""
    if faults[0].kind == "carried":
        failing = replace(NOMINAL, faults=tuple(faults))
        with drawn(Flight(load_scene(SCENE), SEED, 0, failing)) as (part, truth):
            return outcome(part, truth, faults, unseen(part.camera_stamps, faults))
    return outcome_in(recording, faults)


def _row(kind: str, duration_s: float, robot: str, outcomes: list[Outcome]) -> str:
    def most(name: str) -> float:
        return float(np.max([getattr(one, name) for one in outcomes]))  # NaN if there is one

    cells = [
        kind,
        f"{duration_s:g}",
        robot,
        f"{sum(one.images for one in outcomes)}",
        f"{sum(one.lost for one in outcomes)}",
        f"{most('again_s'):.2f}".replace("nan", "never"),
        f"{1e2 * most('step_m'):.1f}",
        f"{most('step_sigmas'):.1f}",
        f"{1e2 * most('off_m'):.1f}",
        f"{most('off_deg'):.2f}",
        f"{most('silent_s'):.2f}",
        f"{sum(one.blind for one in outcomes)}",
        next((one.error for one in outcomes if one.error), "none"),
    ]
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    main()
