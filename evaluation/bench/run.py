"""A benchmark from the first row to the last."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Protocol

from airground.io.recording import Recording
from evaluation.bench.curves import CURVES, Curve, CurvePoint, exponent
from evaluation.bench.lane import Facts, Opened
from evaluation.bench.lane_process import lane_processes
from evaluation.bench.load import LoadAverage, LoadMeter, load_average
from evaluation.bench.material import Played
from evaluation.bench.report import (
    SCHEMA,
    BenchReport,
    CurvePointTiming,
    CurveResult,
    FloorCounts,
    LaneSpeed,
    LaneTiming,
    Machine,
    PeerTiming,
    RealTime,
    RecordingInfo,
    RowResult,
    Timing,
)
from evaluation.bench.row import Contender, Row, Speed
from evaluation.bench.rows import BY_NAME, LIVE, PIPELINE, PLAYED
from evaluation.bench.sampler import Turn, interleaved, wall_ratio
from evaluation.setup.run_info import RunInfo

Say = Callable[[str], None]
"""Is told what is being done."""


class AnyLane(Protocol):
    """A lane, here or in another process."""

    def facts(self, row: str) -> Facts: ...
    def take_turn(self, contender: Contender | CurvePoint, seconds: float) -> Turn: ...
    def peak_memory_mib(self, row: str) -> float | None: ...
    def clear(self) -> None: ...


def run_benchmark(
    path: Path,
    names: Sequence[str],
    threads: int,
    seconds_a_row: float,
    with_curves: bool,
    say: Say,
) -> BenchReport:
    """Time rows on one core and on all.

    Args:
        path: A recording of both robots.
        names: Of the rows.
        threads: Of the lane that uses all cores.
        seconds_a_row: For a row with its peers.
        with_curves: Also vary the sizes.
        say: Is told what is being done.
    """
    info = RunInfo.here(seed=0)
    recording = Recording.open(path)
    counts = sorted({1, threads})
    whole = any(name in PLAYED or name == PIPELINE for name in names)
    load_before, meter = load_average(), LoadMeter()
    live = None
    if LIVE in names:
        say(f"playing {recording.scene} at its own rate")
        with lane_processes([threads]) as (process,):
            live = process.live(path)
    with lane_processes(counts) as processes:
        opened: dict[int, Opened] = {}
        for process in processes:
            say(f"playing {recording.scene} through the pipeline, threads: {process.threads}")
            opened[process.threads] = process.open(path, whole)
        one_core = opened[1].speed
        speeds = {count: one.speed.at_least(one_core) for count, one in opened.items()}
        lanes: dict[int, AnyLane] = {process.threads: process for process in processes}
        played = {count: one.played for count, one in opened.items() if one.played is not None}
        rows = [played_row(name, played) for name in names if name in PLAYED]
        for name in names:
            if name in BY_NAME:
                say(BY_NAME[name].stage.title)
                rows.append(timed_row(BY_NAME[name], lanes, speeds, seconds_a_row))
        curves = []
        for curve in CURVES if with_curves else ():
            say(f"{curve.title} over {curve.parameter}")
            curves.append(timed_curve(curve, lanes[threads], seconds_a_row))
    return BenchReport(
        schema=SCHEMA,
        version=info.version,
        git_revision=info.git_revision,
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        seconds_a_row=seconds_a_row,
        machine=_machine(info, speeds, load_before, meter),
        recording=RecordingInfo(
            scene=recording.scene,
            seed=recording.seed,
            sensors=recording.sensors,
            duration_s=recording.duration_s,
        ),
        rows=rows,
        pipeline=_real_time(opened) if PIPELINE in names else [],
        live=live,
        curves=curves,
    )


def timed_row(
    row: Row, lanes: dict[int, AnyLane], speeds: dict[int, Speed], seconds: float
) -> RowResult:
    """A row on all its lanes and its peers on the widest, in turns."""
    facts = {count: lane.facts(row.name) for count, lane in lanes.items()}
    widest = max(lanes)
    known = facts[widest]
    own = Contender(row.name)
    contenders = {(count, own): partial(lane.take_turn, own) for count, lane in lanes.items()}
    for name in known.peers:
        peer = Contender(row.name, name)
        contenders[widest, peer] = partial(lanes[widest].take_turn, peer)
    turns = interleaved(contenders, seconds)
    floor = known.floor
    lane_timings = [
        LaneTiming(
            threads=count,
            timing=Timing.of(turns[count, own]),
            floor_ms=None if floor is None else floor.least_ms(speeds[count]),
        )
        for count in sorted(lanes)
    ]
    peers = [
        PeerTiming(
            name=name,
            differs=row.peer(name).differs,
            timing=Timing.of(turns[widest, Contender(row.name, name)]),
            times_ours=wall_ratio(turns[widest, Contender(row.name, name)], turns[widest, own]),
        )
        for name in known.peers
    ]
    return RowResult(
        name=row.name,
        title=row.stage.title,
        group=row.stage.group,
        size=known.size,
        published_ms=row.stage.published_ms,
        published_on=row.stage.processor,
        target_ms=row.target_ms,
        lanes=lane_timings,
        peers=peers,
        missing_peers=list(known.missing),
        floor=None
        if floor is None
        else FloorCounts(bytes_moved=floor.bytes_moved, operations=floor.operations),
        peak_memory_mib=lanes[widest].peak_memory_mib(row.name),
    )


def played_row(name: str, played: dict[int, Played]) -> RowResult:
    """A row that was timed image by image while the recording was played."""
    stage, robot, target_ms = PLAYED[name]
    lanes = [
        LaneTiming(threads=count, timing=Timing.of_times(one.frame_ms[robot]))
        for count, one in sorted(played.items())
    ]
    return RowResult(
        name=name,
        title=stage.title,
        group=stage.group,
        size=f"{lanes[0].timing.n} images, mapping included, processor time",
        published_ms=stage.published_ms,
        published_on=stage.processor,
        target_ms=target_ms,
        lanes=lanes,
    )


def timed_curve(curve: Curve, lane: AnyLane, seconds: float) -> CurveResult:
    """A curve's points, in turns."""
    lane.clear()
    points = [CurvePoint(curve.name, value) for value in curve.values]
    turns = interleaved({point: partial(lane.take_turn, point) for point in points}, seconds)
    lane.clear()
    timings = {point.value: Timing.of(turns[point]) for point in points}
    return CurveResult(
        name=curve.name,
        title=curve.title,
        parameter=curve.parameter,
        points=[CurvePointTiming(value=v, timing=timing) for v, timing in timings.items()],
        exponent=exponent(curve.values, [timing.median_ms for timing in timings.values()]),
        cpu_exponent=exponent(
            curve.values, [timing.cpu_median_ms or math.nan for timing in timings.values()]
        ),
    )


def _real_time(opened: dict[int, Opened]) -> list[RealTime]:
    return [
        RealTime(
            threads=count,
            recorded_s=played.recorded_s,
            processing_s=played.processing_s,
            cpu_s=played.cpu_s,
            real_time_factor=played.recorded_s / played.processing_s,
            peak_memory_mib=one.peak_memory_mib,
            resident_mib=played.resident_mib,
        )
        for count, one in sorted(opened.items())
        if (played := one.played) is not None
    ]


def _machine(
    info: RunInfo, speeds: dict[int, Speed], load_before: LoadAverage, meter: LoadMeter
) -> Machine:
    return Machine(
        cpu=info.cpu,
        cores=info.cores,
        speeds=[
            LaneSpeed(
                threads=count,
                bandwidth_gb_s=speed.bytes_per_s / 1e9,
                arithmetic_gflop_s=speed.operations_per_s / 1e9,
            )
            for count, speed in sorted(speeds.items())
        ],
        load_before=load_before,
        load_after=load_average(),
        other_cores=meter.other_cores(),
    )
