"""How a recording is to be lived through, and how that went."""

from __future__ import annotations

from dataclasses import dataclass, field

from airground.core.cloud import Source
from airground.io.recording import Recording
from evaluation.realtime.clock import PlaybackClock
from evaluation.realtime.drops import SCHEMA, DropList, Stamps, fingerprint
from evaluation.realtime.radio import RadioLimits
from evaluation.realtime.tracker_process import TrackerReport


@dataclass(frozen=True)
class Playback:
    """How a recording is played.

    Attributes:
        rate: Recorded seconds in one second.
        waiting_frames: How many images may wait before each tracker, 30 being a second at 30 Hz:
            adjusting a whole map of ten minutes takes two thirds of that, and what has waited is
            tracked several times as fast as it came.
        frames_under_way: How many tracked frames of each robot may wait before the mapper:
            five seconds at 30 Hz, some 360 MiB when all of it is full.
        radio: What lies between the MAV and the ground robot; None for one computer.
        patience_s: How long the mapper waits for a robot that is silent.
    """

    rate: float = 1.0
    waiting_frames: int = 30
    frames_under_way: int = 150
    radio: RadioLimits | None = None
    patience_s: float = 2.0

    def describe(self) -> str:
        """For labels: how this differs from a run that takes its time."""
        played = "live" if self.rate == 1.0 else f"live, played {self.rate:g} times as fast"
        return played if self.radio is None else f"{played}, radio: {self.radio.describe()}"

    @property
    def jpeg_quality(self) -> int | None:
        """Of the MAV's images as the mapper gets them; None where they are not compressed."""
        return None if self.radio is None else self.radio.jpeg_quality


@dataclass
class Lived:
    """What a live run leaves beside its result.

    Attributes:
        clock: What time it was.
        reports: Of each robot; None where its process did not live to tell.
        late_ns: Stamps of frames that came after the mapper had gone on without them.
        received_ns: Stamps of the frames that the mapper got.
        mapped_ns: For each of those: when the mapper was done with it.
        aligned_ms: For each surface: from its last image to its place in the ground map [ms].
        processor_s: Processor time of the mapper.
        peak_memory_mib: The most memory that the mapper held.
        wall_s: From the first image to the last event.
    """

    clock: PlaybackClock
    reports: dict[Source, TrackerReport | None] = field(default_factory=dict)
    late_ns: dict[Source, list[int]] = field(default_factory=dict)
    mapped_ns: dict[Source, dict[int, int]] = field(
        default_factory=lambda: {robot: {} for robot in Source}
    )
    aligned_ms: list[float] = field(default_factory=list)
    processor_s: float = 0.0
    peak_memory_mib: float = 0.0
    wall_s: float = 0.0

    def drops(self, recording: Recording, jpeg_quality: int | None) -> DropList:
        """The list with which a run offline gives the same result."""
        dropped, unmapped = {}, {}
        for robot, report in self.reports.items():
            name = robot.name.lower()
            if report is None:
                # Whatever it tracked, the mapper knows only this.
                everything = set(recording.stamps_ns(robot).tolist())
                dropped[name] = frozenset(everything - self.mapped_ns[robot].keys())
                continue
            dropped[name] = frozenset(report.played.dropped_ns)
            lost = (*report.shed_ns, *report.lost_ns, *self.late_ns[robot])
            unmapped[name] = frozenset(lost)
        return DropList(
            schema=SCHEMA,
            recording=fingerprint(recording),
            dropped=Stamps(**dropped),
            unmapped=Stamps(**unmapped),
            jpeg_quality=jpeg_quality,
        )
