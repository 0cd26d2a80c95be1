"""What a run did, read back from its .rrd file and its trajectories, to hold against another."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from rerun.chunk import Chunk, RrdReader

from airground.core.events import Aligned, SurfaceCast
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.errors import InputError
from airground.io.tum import read_tum
from evaluation.judge.divergence import MadeAlignment, MadeBelief, MadeSurface, Trace
from evaluation.run.onlooker import STAGE_OF
from evaluation.show.rerun_view.sensor_stream import ROBOT, TIMELINE, TRUTH
from evaluation.show.rerun_view.timeline import ROOM

SPREAD = f"/{ROOM}/spread_m"
CAST, TRIED = (f"/{ROOM}/stage_ms/{STAGE_OF[event]}" for event in (SurfaceCast, Aligned))
"""Curves that have a point whenever a surface was made, and an alignment tried."""
PLACED, ALIGNED, POINTS = "/mav/surface/alignment", "/mav/alignment", "/mav/surface"
SCALAR, POSITIONS = "Scalars:scalars", "Points3D:positions"
TRANSLATION, QUATERNION = "Transform3D:translation", "Transform3D:quaternion"


@dataclass(frozen=True)
class RunFile:
    """The .rrd file of a run.

    Attributes:
        path: Of the file.
        name: The run's name for readers.
        recording: What the run was over.
        has_truth: Whether it was held against the truth.
    """

    path: Path
    name: str
    recording: str
    has_truth: bool

    @classmethod
    def open(cls, path: Path, name: str) -> RunFile:
        """Raises InputError where the file holds no run."""
        found = RrdReader(path).recordings()
        if not found:
            raise InputError(
                f"{path}: holds no recording of rerun; expected what run --rerun wrote"
            )
        entities = {chunk.entity_path for chunk in RrdReader(path).stream().filter(content="/**")}
        if not any(entity.endswith("/camera") for entity in entities):
            raise InputError(f"{path}: holds no camera; expected what run --rerun wrote")
        has_truth = any(entity.startswith(f"{TRUTH}/") for entity in entities)
        return cls(path, name, found[0].recording_id, has_truth)


def check_comparable(first: RunFile, second: RunFile) -> None:
    """Refuse two runs that cannot be held against each other.

    Raises:
        InputError: They are over different recordings, or one has no truth.
    """
    if first.recording != second.recording:
        raise InputError(
            f"{second.path}: is a run over {second.recording}, {first.path} over "
            f"{first.recording}; give two runs over one recording"
        )
    if first.has_truth != second.has_truth:
        without, other = (second, first) if first.has_truth else (first, second)
        raise InputError(
            f"{without.path}: has no truth, {other.path} has; give two runs over one recording"
        )


def read_traces(first: RunFile, second: RunFile) -> tuple[Trace, Trace]:
    """What both runs did. Poses are of every image where both folders keep `ROBOT_live.tum` on the
    file's clock, else those in the .rrd files, which their level thins."""
    one, other = (_read(file) for file in (first, second))
    kept = [_kept_poses(file, trace) for file, trace in ((first, one), (second, other))]
    if kept[0] is None or kept[1] is None:
        return one, other
    return _with_poses(one, kept[0]), _with_poses(other, kept[1])


def _with_poses(trace: Trace, poses: dict[str, Trajectory]) -> Trace:
    return Trace(trace.name, poses, trace.surfaces, trace.beliefs, trace.alignments)


def _kept_poses(file: RunFile, trace: Trace) -> dict[str, Trajectory] | None:
    """Poses of the bodies at every image; None where the folder has none on the file's clock."""
    found = {}
    for robot, thinned in trace.poses.items():
        kept = file.path.with_name(f"{robot}_live.tum")
        if not kept.is_file():
            return None
        found[robot] = read_tum(kept)
        if not np.isin(thinned.stamps_ns, found[robot].stamps_ns).all():
            return None
    return found


def _read(file: RunFile) -> Trace:
    rows = _Rows(file.path)
    points = dict(rows.of(POINTS, POSITIONS))
    placed = rows.poses(PLACED)
    beliefs = {
        stamp: MadeBelief(placed.get(stamp) if stamp in points else None, float(spread[0]))
        for stamp, spread in rows.of(SPREAD, SCALAR)
    }
    surfaces = {
        stamp: MadeSurface(np.array(points[stamp], np.float32) if stamp in points else None)
        for stamp, _ in rows.of(CAST, SCALAR)
    }
    accepted = rows.poses(ALIGNED)
    alignments = {stamp: MadeAlignment(accepted.get(stamp)) for stamp, _ in rows.of(TRIED, SCALAR)}
    poses: dict[str, Trajectory] = {}
    for robot in ROBOT.values():
        if seen := rows.poses(f"/{robot}/camera"):
            poses[robot] = Trajectory.from_poses(list(seen), list(seen.values()))
    return Trace(file.name, poses, surfaces, beliefs, alignments)


class _Rows:
    """Rows of the few entities that a trace needs, by time."""

    def __init__(self, path: Path) -> None:
        wanted = [SPREAD, CAST, TRIED, PLACED, ALIGNED, POINTS]
        wanted += [f"/{robot}/camera" for robot in ROBOT.values()]
        self._chunks: dict[str, list[Chunk]] = {}
        for chunk in RrdReader(path).stream().filter(content=wanted, has_timeline=TIMELINE):
            self._chunks.setdefault(chunk.entity_path, []).append(chunk)

    def of(self, entity: str, component: str) -> list[tuple[int, Any]]:
        """(stamp [ns], value) where there is one, in order of time."""
        return sorted(self._all(entity, component), key=lambda row: row[0])

    def poses(self, entity: str) -> dict[int, SE3]:
        """Poses by stamp [ns], in order of time."""
        places, turns = (dict(self.of(entity, part)) for part in (TRANSLATION, QUATERNION))
        return {
            stamp: SE3.from_quaternion_xyzw(turns[stamp][0], place[0])
            for stamp, place in places.items()
        }

    def _all(self, entity: str, component: str) -> Iterator[tuple[int, Any]]:
        for chunk in self._chunks.get(entity, ()):
            batch = chunk.to_record_batch()
            if component in batch.schema.names:
                stamps = batch.column(TIMELINE).cast(pa.int64()).to_pylist()
                values = batch.column(component).to_pylist()
                yield from (
                    (stamp, value)
                    for stamp, value in zip(stamps, values, strict=True)
                    if value is not None
                )
