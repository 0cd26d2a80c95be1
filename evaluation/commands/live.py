"""`airground live`: a recording played at its own rate, as live robots would send it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

from tyro.conf import Positional

from evaluation.commands.options import (
    START_S,
    OutOption,
    PipelineOptions,
    SeedOption,
    Shown,
    Verb,
    in_range,
    recorded,
)
from evaluation.commands.run import simulated, write_measured
from evaluation.commands.sections import USED

if TYPE_CHECKING:
    from evaluation.run.live.playback import Playback

JPEG_QUALITY = 90
"""Quality of the radio's images, from 1 to 100, where it is not set."""


@dataclass(frozen=True, kw_only=True)
class PlaybackOptions:
    """How a recording is played."""

    heading: ClassVar[str] = "playback"

    rate: Annotated[float, Shown("FACTOR")] = 1.0
    """recorded seconds per second"""
    queue: Annotated[int, Shown("N")] = 30
    """images that may wait before each tracker; more are dropped"""


@dataclass(frozen=True, kw_only=True)
class RadioOptions:
    """The radio between the robots; any option but --split implies --split."""

    heading: ClassVar[str] = "radio from the MAV to the ground robot"

    split: bool = False
    """the MAV tracks on board and sends JPEG; implied by --link-..."""
    link_mbit: Annotated[float | None, Shown("MBIT/S", "no limit")] = None
    """data rate; what would wait longer than 0.5 s is lost"""
    link_latency_ms: Annotated[float | None, Shown("MS", "0")] = None
    """time that each message takes"""
    link_loss: Annotated[float | None, Shown("SHARE", "0")] = None
    """share of the messages that is lost, from 0 to 1"""
    link_quality: Annotated[int | None, Shown("Q", f"{JPEG_QUALITY}")] = None
    """JPEG quality of the images, from 1 to 100"""


@dataclass(frozen=True, kw_only=True)
class Live(PlaybackOptions, RadioOptions, PipelineOptions, SeedOption, OutOption, Verb):
    """Play a recording at its own rate through the pipeline, as live robots would send it.

    Each robot tracks in a process of its own. Leaves what run leaves, with the latencies, and
    dropped.json, which names the images that came too fast. To draw a live run, repeat it by
    run RECORDING --drops DIR/dropped.json --rerun, which gives the same result.
    """

    sections: ClassVar[tuple[str, ...]] = USED["live"]

    recording: Annotated[Positional[Path], Shown("RECORDING")]
    """folder that simulate has written"""

    def main(self) -> None:
        from evaluation.run.live.live_run import run_live
        from evaluation.run.own_recordings import warn_of_silence
        from evaluation.setup.output import fresh_folder
        from evaluation.setup.progress import announce
        from evaluation.show.report.screen import print_summary

        playback, seed = self.playback(), self.checked_seed()
        setup = replace(self.setup(), variant=playback.describe())
        with fresh_folder(self.out) as folder:
            recording, truth = simulated(self.recording)
            seconds = recording.duration_s
            what = f"plays {recorded(self.recording, seconds)}, at {playback.rate:g} times its rate"
            announce(what, START_S + seconds / playback.rate)
            result, drops = run_live(recording, truth, setup, seed, playback)
            summary = write_measured(folder, recording, result, drops, setup, seed)
        print_summary(summary)
        warn_of_silence(recording.mav, recording.ground)

    def playback(self) -> Playback:
        """How the recording is to be played.

        Raises:
            InputError: A number is out of range.
        """
        from evaluation.run.live.playback import Playback
        from evaluation.run.live.radio_link import RadioLimits

        rate = in_range("--rate", self.rate, low=0.01, high=1000)
        queue = int(in_range("--queue", self.queue, low=0, high=100_000))
        link = (self.link_mbit, self.link_latency_ms, self.link_loss, self.link_quality)
        if not self.split and link == (None,) * 4:
            return Playback(rate, queue)
        mbit_s, latency_ms, loss, quality = (
            default if value is None else value
            for value, default in zip(link, (math.inf, 0.0, 0.0, JPEG_QUALITY), strict=True)
        )
        if self.link_mbit is not None:
            in_range("--link-mbit", self.link_mbit, low=0.001)
        in_range("--link-latency-ms", latency_ms, high=60_000)
        in_range("--link-loss", loss, high=1)
        in_range("--link-quality", quality, low=1, high=100)
        return Playback(rate, queue, radio=RadioLimits(mbit_s, latency_ms, loss, int(quality)))
