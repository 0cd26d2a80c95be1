"""`airground run --realtime`: the recording is played at its own rate, as live robots would."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from airground.errors import InputError
from evaluation.commands.words import in_range

if TYPE_CHECKING:
    from evaluation.run.live.playback import Playback
    from evaluation.run.live.radio_link import RadioLimits


@dataclass(frozen=True, kw_only=True)
class RealtimeWords:
    """How a recording is lived through, and what a live run did without."""

    realtime: bool = False
    """Play the recording at its own rate; each robot tracks in a process of its own."""
    rate: Annotated[float, arg(metavar="FACTOR")] = 1.0
    """With --realtime: recorded seconds in one second."""
    queue: Annotated[int, arg(metavar="N")] = 30
    """With --realtime: images that may wait before each tracker; more are dropped."""
    split: bool = False
    """With --realtime: the MAV sends compressed images and poses over the link set below."""
    link_mbit: Annotated[
        float | None, arg(metavar="MBIT/S", help_behavior_hint="(default: no limit)")
    ] = None
    """With --split: what the link carries; what would wait longer than 0.5 s is lost."""
    link_latency_ms: Annotated[float, arg(metavar="MS")] = 0.0
    """With --split: how long a message is on its way."""
    link_loss: Annotated[float, arg(metavar="SHARE")] = 0.0
    """With --split: share of the messages that the link loses, from 0 to 1."""
    link_quality: Annotated[int, arg(metavar="Q")] = 90
    """With --split: JPEG quality of the images, from 1 to 100."""
    drops: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="(optional)")] = None
    """dropped.json of a live run: do without the same frames, and get the same result."""

    def check_realtime_words(self, only: str | None) -> None:
        """Raises InputError where a word has no meaning, or a number is out of range."""
        if only is not None and (self.realtime or self.drops is not None):
            raise InputError("--only: without --realtime and --drops, which are for both robots")
        if self.realtime and self.drops is not None:
            raise InputError("--drops: without --realtime, whose frames drop as they do")
        unset = RealtimeWords()
        if not self.realtime:
            self._refuse(("rate", "queue", "split"), unset, "--realtime")
        if not self.split:
            names = ("link_mbit", "link_latency_ms", "link_loss", "link_quality")
            self._refuse(names, unset, "--split")
        in_range("--rate", self.rate, low=0.01, high=1000)
        in_range("--queue", self.queue, low=0, high=100_000)
        if self.link_mbit is not None:
            in_range("--link-mbit", self.link_mbit, low=0.001)
        in_range("--link-latency-ms", self.link_latency_ms, high=60_000)
        in_range("--link-loss", self.link_loss, high=1)
        in_range("--link-quality", self.link_quality, low=1, high=100)

    def playback(self) -> Playback:
        """How the recording is to be played."""
        from evaluation.run.live.playback import Playback

        return Playback(self.rate, self.queue, radio=self.radio())

    def variant(self) -> str:
        """How results name what these words change."""
        if self.realtime:
            return self.playback().describe()
        return "" if self.drops is None else "with frames left out"

    def radio(self) -> RadioLimits | None:
        """What lies between the MAV and the ground robot; None for one computer."""
        from evaluation.run.live.radio_link import RadioLimits

        if not self.split:
            return None
        mbit_s = math.inf if self.link_mbit is None else self.link_mbit
        return RadioLimits(mbit_s, self.link_latency_ms, self.link_loss, self.link_quality)

    def _refuse(self, names: tuple[str, ...], unset: RealtimeWords, needed: str) -> None:
        for name in names:
            if getattr(self, name) != getattr(unset, name):
                raise InputError(f"--{name.replace('_', '-')}: only with {needed}")
