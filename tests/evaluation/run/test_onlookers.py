"""Who watches a run sees every event with its frame, and its time counts for no stage."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest

from airground.config import Config
from airground.core.cloud import Source
from airground.core.events import GroundMapExtended, GroundTracked, Initializing, TrackingLost
from airground.io.recording import Recording
from airground.slam.front_end import Tracking
from evaluation.run.onlooker import Onlooker, Seen
from evaluation.run.recording import Measure
from evaluation.setup.setups import EXACT, Setup
from tests.evaluation.show.scripted_run import LENS, SECOND, TRUTH, ground_frame, mav_frame

RECORDING = cast(
    Recording,
    SimpleNamespace(mav=LENS, ground=LENS, scene="s", seed=0, flight=0, sensors="none"),
)
FRAMES = [
    ground_frame(SECOND, Tracking.INITIALIZING),
    ground_frame(2 * SECOND),
    mav_frame(3 * SECOND, Tracking.LOST),
]


class Watching:
    """Remembers all; each event takes it 100 s by the clock that stages are timed with."""

    def __init__(self) -> None:
        self.seen: list[Seen] = []
        self.now_s = 0.0

    def see(self, seen: Seen) -> None:
        self.seen.append(seen)
        self.now_s += 100.0


def measured(*onlookers: Onlooker) -> Measure:
    measure = Measure(RECORDING, TRUTH, Setup(Config(), "slam", EXACT), 0, onlookers)
    measure.run(FRAMES)
    return measure


def test_every_event_comes_with_the_frame_that_it_is_of() -> None:
    watcher = Watching()
    measured(watcher)
    kinds = [type(seen.event) for seen in watcher.seen]
    assert kinds == [Initializing, GroundTracked, GroundMapExtended, TrackingLost]
    assert [seen.frame for seen in watcher.seen] == [FRAMES[0], FRAMES[1], FRAMES[1], FRAMES[2]]
    assert watcher.seen[-1].frame.robot == Source.MAV
    assert all(seen.sighting is None for seen in watcher.seen)


def test_watching_counts_for_no_stage(monkeypatch: pytest.MonkeyPatch) -> None:
    watcher = Watching()
    monkeypatch.setattr("evaluation.run.onlooker.time.perf_counter", lambda: watcher.now_s)
    measure = measured(watcher)
    assert [row.value for row in measure.out.rows if row.stage == "timing"] == [0.0]
    assert [seen.duration_ms for seen in watcher.seen] == [0.0] * len(watcher.seen)
