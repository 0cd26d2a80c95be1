"""Whole live runs: processes, sockets, results, and how they end."""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import cv2
import numpy as np
import pytest

from airground.config import Config, GroundMapping
from airground.core.cloud import Source
from airground.core.se3 import SE3
from airground.io.header import write_toml
from airground.io.recording import Recording
from airground.link.channel import Sender
from airground.tracking import TrackedFrame
from evaluation.judge.live_summary import LiveSummary, live_summary
from evaluation.run.claim_log import ClaimLog
from evaluation.run.drops import nothing_dropped
from evaluation.run.live import live_run
from evaluation.run.live.arrivals import Stream, in_order
from evaluation.run.live.live_run import run_live
from evaluation.run.live.playback import Playback, PlaybackClock
from evaluation.run.live.radio_link import Envelope, RadioLimits
from evaluation.run.onlooker import Seen
from evaluation.run.recording import RunResult, run_recording
from evaluation.setup import console
from evaluation.setup.setups import Setup
from evaluation.table.tracking_log import Tracked
from sim.recording.truth import Truth
from tests.io.recordings import HEIGHT, UNITS_PER_M, WIDTH, calibration, write_recording
from tests.sim.flights import simulate, small_scene

pytestmark = [
    pytest.mark.slow,
    pytest.mark.subject(but={"airground/slam": "poses are the true ones"}),
]

SETUP = Setup(Config(ground_mapping=GroundMapping(min_keyframes=1)), "oracle")
PATIENCE_S = 60.0


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """Four images per robot, with their true poses."""
    path = write_recording(tmp_path_factory.mktemp("live") / "recording")
    truth = path / "truth"
    truth.mkdir()
    write_toml(truth / "calibration.toml", calibration())
    simulate(small_scene()).save(truth / "motion.npz")
    for file in (path / "ground" / "depth").iterdir():
        cv2.imwrite(str(file), np.full((HEIGHT, WIDTH), 2 * UNITS_PER_M, np.uint16))
    return Recording.open(path)


def summarized(result: RunResult) -> LiveSummary:
    summary = live_summary(result.table)
    assert summary is not None
    return summary


def test_a_live_run_without_drops_equals_a_run_offline(recording: Recording) -> None:
    truth = Truth.open(recording.path)
    playback = Playback(rate=1000.0, waiting_frames=100, patience_s=PATIENCE_S)
    live, drops = run_live(recording, truth, SETUP, 0, playback)
    assert drops == nothing_dropped(recording)
    offline = run_recording(recording, truth, SETUP, 0)
    assert_same(live, offline)
    summary = summarized(live)
    for one in (summary.mav, summary.ground):
        assert (one.survived, one.images, one.dropped, one.posed_ms.n) == (1, 4, 0, 4)
        assert one.mapped_ms.n == 4
        assert one.mbit_s is not None
        assert one.mbit_s > 0


def test_a_live_run_with_drops_is_reproduced_offline(recording: Recording) -> None:
    """Images arrive every 33 us and the queue has no room: all but each robot's first may drop."""
    truth = Truth.open(recording.path)
    radio = RadioLimits(loss=1.0)
    live, drops = run_live(recording, truth, SETUP, 0, Playback(1000.0, 0, radio=radio))
    summary = summarized(live)
    assert summary.ground.dropped == len(drops.dropped.ground) >= 1
    assert summary.mav.dropped == len(drops.dropped.mav) >= 1
    assert summary.mav.lost == len(drops.unmapped.mav) == 4 - summary.mav.dropped
    assert summary.mav.mapped_ms.n == 0
    assert_same(live, run_recording(recording, truth, SETUP, 0, drops))


def test_the_mapper_is_idle_to_the_scheduler_and_the_trackers_are_not(
    recording: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[tuple[int, ...]] = []

    def watched(
        streams: Mapping[Source, Stream], clock: PlaybackClock, patience_s: float
    ) -> Iterator[TrackedFrame]:
        trackers = [child.pid or 0 for child in multiprocessing.active_children()]
        assert len(trackers) == 2
        for frame in in_order(streams, clock, patience_s):
            if not seen:  # by the last frames, a tracker may have ended
                seen.append(tuple(os.sched_getscheduler(pid) for pid in (0, *trackers)))
            yield frame

    def body() -> None:
        playback = Playback(rate=1.0, waiting_frames=100, patience_s=PATIENCE_S)
        run_live(recording, Truth.open(recording.path), SETUP, 0, playback)

    monkeypatch.setattr(live_run, "in_order", watched)
    usual = os.sched_getscheduler(0)
    with ThreadPoolExecutor(1) as pool:  # whose priority ends with it
        pool.submit(body).result()
    assert seen == [(os.SCHED_IDLE, usual, usual)]


def test_forged_messages_are_dropped_and_counted_at_the_end(
    recording: Recording, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """They change nothing else: each robot's own messages all arrive."""

    def with_forged(
        streams: Mapping[Source, Stream], clock: PlaybackClock, patience_s: float
    ) -> Iterator[TrackedFrame]:
        for message in ([b"xy"], Envelope(False, 0, 0).around([b"no frame"])):
            forger = Sender(streams[Source.GROUND]._receiver.address, capacity=1)
            forger.send(message)
            forger.close()
        return in_order(streams, clock, patience_s)

    monkeypatch.setattr(live_run, "in_order", with_forged)
    playback = Playback(rate=1000.0, waiting_frames=100, patience_s=PATIENCE_S)
    with caplog.at_level("WARNING"):
        live, drops = run_live(recording, Truth.open(recording.path), SETUP, 0, playback)
    assert [one.getMessage() for one in caplog.records if "malformed" in one.getMessage()] == [
        "ground: dropped messages that were malformed: 2"
    ]
    assert drops == nothing_dropped(recording)
    assert summarized(live).ground.mapped_ms.n == 4


def test_claims_of_a_live_run_count_from_when_they_were_computed(
    recording: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = [(5, SE3.identity())]
    computed_ns: list[int] = []
    stamps_ns: list[int] = []

    class Watched(ClaimLog):
        def see(self, seen: Seen) -> None:
            computed_ns.append(self._when(seen))
            stamps_ns.append(seen.frame.stamp_ns)

        def claims(self, tracked: Mapping[str, Tracked]) -> list[tuple[int, SE3]]:
            assert sorted(tracked) == ["ground", "mav"]
            return made

    monkeypatch.setattr(live_run, "ClaimLog", Watched)
    playback = Playback(rate=1000.0, waiting_frames=100, patience_s=PATIENCE_S)
    live, _ = run_live(recording, Truth.open(recording.path), SETUP, 0, playback)
    assert live.claims == made
    assert len(stamps_ns) >= 8, "the events of four images of each robot"
    assert all(late > stamp for late, stamp in zip(computed_ns, stamps_ns, strict=True))
    assert computed_ns == sorted(computed_ns)


def assert_same(one: RunResult, two: RunResult) -> None:
    """The map and every live pose are equal to the bit."""
    clouds = [result.augmented.cloud_ground for result in (one, two)]
    assert len(clouds[0]) > 100
    assert clouds[0].points.tobytes() == clouds[1].points.tobytes()
    for robot in ("mav", "ground"):
        live = [result.tracked[robot].front_end.live_poses() for result in (one, two)]
        assert live[0]
        for (one_ns, one_pose), (two_ns, two_pose) in zip(*live, strict=True):
            assert one_ns == two_ns
            assert one_pose.matrix().tobytes() == two_pose.matrix().tobytes()


class Running:
    """`airground live` in a process of its own, its images 3 s apart."""

    def __init__(self, recording: Recording, out: Path) -> None:
        words = ["live", str(recording.path), "--out", str(out), "--poses", "oracle"]
        log = recording.path.with_name(f"{out.parent.name}.log")
        words += ["--split", "--rate", "0.01", "--log", str(log)]
        script = (
            "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
            "from evaluation.cli import main; main()"
        )
        self.process = subprocess.Popen(
            [sys.executable, "-c", script, *words], stderr=subprocess.PIPE, text=True
        )
        wait_until(lambda: len(self.robots()) == 2)
        self.children = self.robots()
        # Before they play, the death of a robot ends the run.
        wait_until(lambda: log.exists() and "both robots play" in log.read_text())

    def robots(self) -> dict[str, int]:
        """The trackers' processes, spawned by the run."""
        pid = self.process.pid
        text = Path(f"/proc/{pid}/task/{pid}/children").read_text()
        named = {}
        for child in map(int, text.split()):
            with contextlib.suppress(FileNotFoundError, ProcessLookupError):  # ended meanwhile
                if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes():
                    named[f"{child}"] = child
        return named

    def finish(self) -> tuple[int, str]:
        _, errors = self.process.communicate(timeout=PATIENCE_S * 3)
        return self.process.returncode, errors


def wait_until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE_S * 3
    while not condition():
        assert time.monotonic() < deadline, "it took too long"
        time.sleep(0.1)


def is_gone(pid: int) -> bool:
    """Whether the process has ended, as a zombie or altogether."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except FileNotFoundError:
        return True


def test_an_interrupt_ends_all_processes_and_leaves_nothing(
    recording: Recording, tmp_path: Path
) -> None:
    running = Running(recording, tmp_path / "out")
    running.process.send_signal(signal.SIGINT)
    code, errors = running.finish()
    assert code == console.EXIT_INTERRUPTED, errors
    assert errors.splitlines()[-1] == "airground: error: interrupted"
    wait_until(lambda: all(is_gone(child) for child in running.children.values()))
    assert list(tmp_path.iterdir()) == []


def test_no_process_outlives_a_run_that_is_killed(recording: Recording, tmp_path: Path) -> None:
    running = Running(recording, tmp_path / "out")
    running.process.kill()
    running.finish()
    wait_until(lambda: all(is_gone(child) for child in running.children.values()))


def test_a_robot_that_dies_is_reported_and_the_run_goes_on(
    recording: Recording, tmp_path: Path
) -> None:
    running = Running(recording, tmp_path / "out")
    os.kill(max(running.children.values()), signal.SIGKILL)  # started last: the MAV
    code, errors = running.finish()
    assert code == console.EXIT_OK, errors
    assert "mav: its process died or fell silent" in " ".join(errors.split())
    live = json.loads((tmp_path / "out" / "summary.json").read_text())["realtime"]
    assert (live["mav"]["survived"], live["ground"]["survived"]) == (0, 1)
    assert live["ground"]["posed_ms"]["n"] == 4
    assert live["ground"]["mapped_ms"]["n"] == 4
