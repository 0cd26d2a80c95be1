"""A benchmark from the first row to the last."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import psutil

from airground.io.recording import Recording
from evaluation.bench.curves import CURVES, Curve, CurvePoint, exponent
from evaluation.bench.floors import Speed
from evaluation.bench.lane import Lane, LaneProcess, Opened, lane_processes
from evaluation.bench.machine import LoadAverage, LoadMeter
from evaluation.bench.recording_speed import DURATION_S, RECORDED, record_anew
from evaluation.bench.report import (
    SCHEMA,
    BenchReport,
    CurvePointTiming,
    CurveResult,
    LaneTiming,
    Machine,
    PeerTiming,
    RealTime,
    RecordingInfo,
    RowResult,
    Timing,
)
from evaluation.bench.rows import BY_NAME, LIVE, PIPELINE, PLAYED, Contender, Row
from evaluation.bench.work import interleaved, wall_ratio
from evaluation.setup.condition import RunInfo
from evaluation.setup.published import TimedStage

AnyLane = Lane | LaneProcess


def run_benchmark(
    path: Path,
    names: Sequence[str],
    threads: int,
    seconds_a_row: float,
    with_curves: bool,
    say: Callable[[str], None],
) -> BenchReport:
    """Time rows on one core and on all, over a recording of both robots.
    `seconds_a_row` is the time for a row with its peers; `say` takes a line about each step."""
    info = RunInfo.here(seed=0)
    recording = Recording.open(path)
    counts = sorted({1, threads})
    whole = any(name in PLAYED or name == PIPELINE for name in names)
    load_before, meter = LoadAverage(*psutil.getloadavg()), LoadMeter()
    live = None
    if LIVE in names:
        say(f"playing {recording.scene} at its own rate")
        with lane_processes([threads]) as (process,):
            live = process.live(path)
    recordings = []
    for name in names:
        if name in RECORDED:
            say(f"simulating {DURATION_S:.0f} s with {RECORDED[name]} sensors")
            recordings.append(record_anew(name, threads))
    with lane_processes(counts) as processes:
        opened: dict[int, Opened] = {}
        for process in processes:
            say(f"playing {recording.scene} through the pipeline, threads: {process.threads}")
            opened[process.threads] = process.open(path, whole)
        speeds = {count: one.speed.at_least(opened[1].speed) for count, one in opened.items()}
        lanes = {process.threads: process for process in processes}
        rows = [played_row(name, opened) for name in names if name in PLAYED]
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
        rows=tuple(rows),
        pipeline=_pipeline(opened) if PIPELINE in names else (),
        live=live,
        recordings=tuple(recordings),
        curves=tuple(curves),
    )


def timed_row(
    row: Row, lanes: Mapping[int, AnyLane], speeds: dict[int, Speed], seconds: float
) -> RowResult:
    """A row on all its lanes and its peers on the widest, in turns."""
    widest, own = max(lanes), Contender(row.name)
    facts = {count: lane.facts(row.name) for count, lane in lanes.items()}
    known = facts[widest]
    peers = {name: Contender(row.name, name) for name in known.peers}
    contenders = {(count, own): partial(lane.take_turn, own) for count, lane in lanes.items()}
    for peer in peers.values():
        contenders[widest, peer] = partial(lanes[widest].take_turn, peer)
    turns = interleaved(contenders, seconds)
    floor, differs = known.floor, {peer.name: peer.differs for peer in row.peers}
    lane_timings = (
        LaneTiming(
            threads=count,
            timing=Timing.of(turns[count, own]),
            floor_ms=None if floor is None else floor.least_ms(speeds[count]),
        )
        for count in sorted(lanes)
    )
    peer_timings = (
        PeerTiming(
            name=name,
            differs=differs[name],
            timing=Timing.of(turns[widest, peer]),
            times_ours=wall_ratio(turns[widest, peer], turns[widest, own]),
        )
        for name, peer in peers.items()
    )
    return _result(
        row.stage,
        row.target_ms,
        known.size,
        lane_timings,
        peers=tuple(peer_timings),
        missing_peers=known.missing,
        floor=floor,
        peak_memory_mib=lanes[widest].peak_memory_mib(row.name),
    )


def played_row(name: str, opened: dict[int, Opened]) -> RowResult:
    """A row that was timed image by image while the recording was played."""
    stage, robot, target_ms = PLAYED[name]
    lanes = [
        LaneTiming(threads=count, timing=Timing.of_times(one.played.frame_ms[robot]))
        for count, one in sorted(opened.items())
        if one.played is not None
    ]
    size = f"{lanes[0].timing.n} images, mapping included, processor time"
    return _result(stage, target_ms, size, lanes)


def _result(
    stage: TimedStage, target_ms: float | None, size: str, lanes: Iterable[LaneTiming], **more: Any
) -> RowResult:
    return RowResult(
        name=stage.metric,
        title=stage.title,
        group=stage.group,
        size=size,
        published_ms=stage.published_ms,
        published_on=stage.processor,
        target_ms=target_ms,
        lanes=tuple(lanes),
        **more,
    )


def timed_curve(curve: Curve, lane: AnyLane, seconds: float) -> CurveResult:
    """A curve's points, in turns."""
    points = [CurvePoint(curve.name, value) for value in curve.values]
    turns = interleaved({point: partial(lane.take_turn, point) for point in points}, seconds)
    lane.clear()
    timings = {point.value: Timing.of(turns[point]) for point in points}
    return CurveResult(
        name=curve.name,
        title=curve.title,
        parameter=curve.parameter,
        points=tuple(CurvePointTiming(value=v, timing=timing) for v, timing in timings.items()),
        exponent=exponent(curve.values, [timing.median_ms for timing in timings.values()]),
        cpu_exponent=exponent(
            curve.values, [timing.cpu_median_ms or math.nan for timing in timings.values()]
        ),
    )


def _pipeline(opened: dict[int, Opened]) -> tuple[RealTime, ...]:
    return tuple(one.played.pipeline for _, one in sorted(opened.items()) if one.played is not None)


def _machine(
    info: RunInfo, speeds: dict[int, Speed], load_before: LoadAverage, meter: LoadMeter
) -> Machine:
    return Machine(
        cpu=info.cpu,
        cores=info.cores,
        speeds=tuple(speed for _, speed in sorted(speeds.items())),
        load_before=load_before,
        load_after=LoadAverage(*psutil.getloadavg()),
        other_cores=meter.other_cores(),
    )
