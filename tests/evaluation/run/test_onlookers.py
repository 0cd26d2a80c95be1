"""An onlooker sees every event with its frame, and its time counts for no stage."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from airground.config import Config
from airground.core.cloud import Source
from airground.core.events import GroundMapExtended, GroundTracked, Initializing, TrackingLost
from airground.io.recording import Recording
from airground.slam.front_end import Tracking
from airground.tracking import TrackedFrame
from evaluation.run.driver import drive, pipeline_for
from evaluation.run.onlooker import Onlooker, Seen
from evaluation.run.recording import RunRows
from evaluation.run.tracking import TrackingReport
from evaluation.setup.setups import EXACT, Setup
from tests.evaluation.show.scripted_run import LENS, SECOND, TRUTH, ground_frame, mav_frame

ROBOT = SimpleNamespace(calibration=LENS, camera_stamps=[0])
RECORDING = cast(
    Recording,
    SimpleNamespace(
        of=lambda robot: ROBOT,
        mav=ROBOT,
        ground=ROBOT,
        scene="s",
        seed=0,
        flight=0,
        sensors="none",
        duration_s=3.0,
    ),
)
FRAMES = [
    ground_frame(SECOND, Tracking.INITIALIZING),
    ground_frame(2 * SECOND),
    mav_frame(3 * SECOND, Tracking.LOST),
]


class SlowOnlooker:
    """Keeps all events; each takes 100 s by the clock that times the stages."""

    def __init__(self) -> None:
        self.seen: list[Seen] = []
        self.now_s = 0.0

    def see(self, seen: Seen) -> None:
        self.seen.append(seen)
        self.now_s += 100.0


class Frames:
    """Tracking that yields the frames above."""

    def wait_until_ready(self) -> None:
        """Ready at once."""

    def frames(self) -> Iterator[TrackedFrame]:
        return iter(FRAMES)

    def report(self) -> TrackingReport:
        return TrackingReport({}, None)


def measured(*onlookers: Onlooker) -> RunRows:
    setup = Setup(Config(), "slam", EXACT)
    rows = RunRows(RECORDING, TRUTH, setup)
    pipeline = pipeline_for(RECORDING, setup, np.random.default_rng(0))
    drive(RECORDING, Frames(), pipeline, setup, [rows, *onlookers])
    rows.add_times()
    return rows


def test_every_event_comes_with_its_frame() -> None:
    watcher = SlowOnlooker()
    measured(watcher)
    kinds = [type(seen.event) for seen in watcher.seen]
    assert kinds == [Initializing, GroundTracked, GroundMapExtended, TrackingLost]
    assert [seen.frame for seen in watcher.seen] == [FRAMES[0], FRAMES[1], FRAMES[1], FRAMES[2]]
    assert watcher.seen[-1].frame.robot == Source.MAV
    assert all(seen.sighting is None for seen in watcher.seen)


def test_the_time_of_onlookers_counts_for_no_stage(monkeypatch: pytest.MonkeyPatch) -> None:
    watcher = SlowOnlooker()
    monkeypatch.setattr("evaluation.run.onlooker.time.perf_counter", lambda: watcher.now_s)
    measure = measured(watcher)
    assert [row.value for row in measure.out.rows if row.stage == "timing"] == [0.0]
    assert [seen.duration_ms for seen in watcher.seen] == [0.0] * len(watcher.seen)
