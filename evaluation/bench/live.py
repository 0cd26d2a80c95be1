"""A live run for the benchmark: nothing may be dropped, and poses must come in time."""

from __future__ import annotations

from pathlib import Path

from airground.config import Config
from airground.errors import InputError
from airground.io.recording import Recording
from evaluation.judge.live_summary import LiveSummary, live_summary
from evaluation.run.live.live_run import run_live
from evaluation.run.live.playback import Playback
from evaluation.setup.setups import Setup
from sim.recording.truth import Truth


def play_live(path: Path) -> LiveSummary:
    """Play a recording at its own rate through the pipeline, as `run --realtime` does.

    Args:
        path: A recording of both robots, with its truth, which the run is measured against.

    Raises:
        InputError: There is no truth.
    """
    recording = Recording.open(path)
    result, _ = run_live(recording, Truth.open(path), Setup(Config()), 0, Playback())
    summary = live_summary(result.table)
    if summary is None:
        raise InputError(f"{path}: too short to be played live")
    return summary
