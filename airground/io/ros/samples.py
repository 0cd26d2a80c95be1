"""Inertial and magnetic samples, camera calibrations and mountings in ROS messages."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from airground.core.arrays import F64, I64
from airground.core.messages import ImuNoise, ImuSamples, MagneticSamples
from airground.core.se3 import SE3
from airground.errors import RecordingError
from airground.io.lens import Lens
from airground.io.plausibility import check_field
from airground.io.ros.bag import Bag
from airground.io.sensor_file import checked_lens

TF_STATIC = "/tf_static"
SECOND_NS = 1_000_000_000
ADIS16448 = ImuNoise(1.6968e-4, 1.9393e-5, 2.0e-3, 3.0e-3)
"""Noise of EuRoC's IMU, a good MEMS sensor: messages hold no random walk, and seldom true noise."""
BENT = ("equidistant", "fisheye")
"""Distortion models that bend with coefficients of zero, too."""


@dataclass(frozen=True, eq=False)
class Stamped:
    """Messages of one topic in order of their stamps, each stamp once.

    Attributes:
        stamps_ns: (N,) stamps [ns]: those of the headers, or of the bag where headers have none.
        order: (N,) index of each in the bag.
        times_ns: (M,) time of every message in the bag [ns].
        by_bag: Whether the headers have no stamps.
    """

    stamps_ns: I64
    order: I64
    times_ns: I64
    by_bag: bool


def stamped(times_ns: list[int], headers_ns: list[int]) -> Stamped:
    """Order messages by the stamps (M,) of their headers, or by their times (M,) in the bag."""
    times, stamps = np.array(times_ns, np.int64), np.array(headers_ns, np.int64)
    by_bag = not stamps.any()
    unique, order = np.unique(times if by_bag else stamps, return_index=True)
    return Stamped(unique, order.astype(np.int64), times, by_bag)


def stamp_of(message: Any) -> int:
    """Stamp of a message's header [ns]."""
    stamp = message.header.stamp
    return int(stamp.sec) * SECOND_NS + int(stamp.nanosec)


def read_stamps(bag: Bag, topic: str) -> Stamped:
    """Stamps of a topic's messages; raises RecordingError."""
    found = [(time_ns, stamp_of(message)) for time_ns, message in bag.messages(topic)]
    return stamped([time for time, _ in found], [stamp for _, stamp in found])


def read_imu(bag: Bag, topic: str) -> tuple[ImuSamples, str]:
    """All inertial samples and the name of their frame; raises RecordingError."""
    stamps, rows, frame = _vectors(bag, topic, "angular_velocity", "linear_acceleration")
    return ImuSamples(stamps, rows[:, :3], rows[:, 3:]), frame


def read_magnetic(bag: Bag, topic: str) -> MagneticSamples:
    """All samples of the magnetic field [T]; raises RecordingError."""
    stamps, rows, _ = _vectors(bag, topic, "magnetic_field")
    samples = MagneticSamples(stamps, rows)
    check_field(samples, Path(f"{bag.path}: {topic}"))
    return samples


def read_lens(bag: Bag, topic: str, image_topic: str) -> Lens:
    """The lens by a camera's calibration; RecordingError where it cannot be right.
    Images that were rectified have the projection matrix's focal lengths and no distortion."""
    info = bag.first(topic)
    path = Path(f"{bag.path}: {topic}")
    matrix, coefficients = _array(info, "k").reshape(3, 3), tuple(_array(info, "d").tolist())
    model = info.distortion_model
    if "rect" in PurePosixPath(image_topic).name:
        matrix, coefficients = _array(info, "p").reshape(3, 4)[:, :3], ()
    if not any(coefficients) and (model not in BENT or not coefficients):
        model, coefficients = "radtan", (0.0,) * 4
    intrinsics = tuple(float(matrix[at]) for at in ((0, 0), (1, 1), (0, 2), (1, 2)))
    if not np.isfinite((*intrinsics, *coefficients)).all():
        raise RecordingError(f"{path}: the calibration is not finite")
    return checked_lens(info.width, info.height, intrinsics, model, coefficients, path)


def mounting(bag: Bag, parent: str, child: str) -> SE3 | None:
    """`T_parent_child` by the static transforms; None where they do not connect the frames."""
    edges: dict[str, list[tuple[str, SE3]]] = {}
    if TF_STATIC not in bag.topics:
        return None
    for _, message in bag.messages(TF_STATIC):
        for one in message.transforms:
            a, b = one.header.frame_id.lstrip("/"), one.child_frame_id.lstrip("/")
            T_a_b = _pose(bag, one.transform)
            edges.setdefault(a, []).append((b, T_a_b))
            edges.setdefault(b, []).append((a, T_a_b.inverse()))
    start, goal = parent.lstrip("/"), child.lstrip("/")
    known, waiting = {start: SE3.identity()}, deque([start])
    while waiting:
        frame = waiting.popleft()
        for other, T_frame_other in edges.get(frame, ()):
            if other not in known:
                known[other] = known[frame] @ T_frame_other
                waiting.append(other)
    return known.get(goal)


def _array(info: Any, field: str) -> F64:
    """A field of a calibration, whose name ROS 1 writes large."""
    return np.asarray(getattr(info, field, getattr(info, field.upper(), None)), np.float64)


def _pose(bag: Bag, transform: Any) -> SE3:
    q, t = transform.rotation, transform.translation
    xyzw = np.array([q.x, q.y, q.z, q.w], np.float64)
    length = float(np.linalg.norm(xyzw))
    translation = np.array([t.x, t.y, t.z], np.float64)
    if not (abs(length - 1) < 1e-2 and np.isfinite(translation).all()):
        raise RecordingError(f"{bag.path}: {TF_STATIC}: a transform is no rigid motion")
    return SE3.from_quaternion_xyzw(xyzw / length, translation)


def _vectors(bag: Bag, topic: str, *fields: str) -> tuple[I64, F64, str]:
    """Stamps (N,) [ns], rows (N, 3 * fields), and the frame of a topic's messages."""
    times, headers, rows, frame = [], [], [], ""
    for time_ns, message in bag.messages(topic):
        times.append(time_ns)
        headers.append(stamp_of(message))
        vectors = [getattr(message, field) for field in fields]
        rows.append([value for v in vectors for value in (v.x, v.y, v.z)])
        frame = message.header.frame_id
    found = stamped(times, headers)
    table = np.array(rows, np.float64)[found.order]
    bad = ~np.isfinite(table).all(axis=1)
    if bad.any():
        stamp = found.stamps_ns[np.argmax(bad)]
        raise RecordingError(f"{bag.path}: {topic}: the sample at stamp {stamp} is not finite")
    return found.stamps_ns, table, frame
