"""What a front end said of every image, in a small part of the memory that its answers take."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import overload

import numpy as np
from numpy.typing import NDArray

from airground.core.se3 import SE3
from airground.slam.front_end import ScaleEstimate, TrackedPose, Tracking

RECORDS_A_CHUNK = 1024
_STATES = tuple(Tracking)
_RECORD = np.dtype(
    [
        ("stamp_ns", np.int64),
        ("tracking", np.uint8),
        ("corrected", np.bool_),
        ("rotation", np.float64, (3, 3)),
        ("translation", np.float64, (3,)),
        ("has_covariance", np.bool_),
        ("covariance", np.float64, (6, 6)),
        ("has_scale", np.bool_),
        ("scale_sigma", np.float64),
        ("scale_observable", np.bool_),
        ("has_depth_range", np.bool_),
        ("depth_range", np.float64, (2,)),
    ]
)


class AnswerLog(Sequence[TrackedPose]):
    """Answers in order of time, without their corners; each is made anew when it is asked for.

    As objects they took 3.3 kB each, which in ten minutes of two robots is 120 MB.

    Args:
        answers: The first ones.
    """

    def __init__(self, answers: Iterable[TrackedPose] = ()) -> None:
        self._chunks: list[NDArray[np.void]] = []
        self._count = 0
        for answer in answers:
            self.append(answer)

    def append(self, answer: TrackedPose) -> None:
        """Keep one more."""
        at = self._count % RECORDS_A_CHUNK
        if at == 0:
            self._chunks.append(np.zeros(RECORDS_A_CHUNK, _RECORD))
        record = self._chunks[-1][at]
        record["stamp_ns"] = answer.stamp_ns
        record["tracking"] = _STATES.index(answer.tracking)
        record["corrected"] = answer.corrected
        if answer.T_map_camera is not None:
            record["rotation"] = answer.T_map_camera.rotation
            record["translation"] = answer.T_map_camera.translation
        if answer.covariance is not None:
            record["has_covariance"], record["covariance"] = True, answer.covariance
        if answer.scale is not None:
            record["has_scale"], record["scale_sigma"] = True, answer.scale.sigma
            record["scale_observable"] = answer.scale.observable
        if answer.depth_range is not None:
            record["has_depth_range"], record["depth_range"] = True, answer.depth_range
        self._count += 1

    def __len__(self) -> int:
        return self._count

    @overload
    def __getitem__(self, index: int) -> TrackedPose: ...
    @overload
    def __getitem__(self, index: slice) -> list[TrackedPose]: ...
    def __getitem__(self, index: int | slice) -> TrackedPose | list[TrackedPose]:
        if isinstance(index, slice):
            return [self._answer(at) for at in range(*index.indices(self._count))]
        at = index + self._count if index < 0 else index
        if not 0 <= at < self._count:
            raise IndexError(f"answer {index} of {self._count}")
        return self._answer(at)

    def _answer(self, at: int) -> TrackedPose:
        record = self._chunks[at // RECORDS_A_CHUNK][at % RECORDS_A_CHUNK]
        tracking = _STATES[record["tracking"]]
        pose = covariance = scale = depth_range = None
        # Copies: a view would keep its whole chunk alive.
        if tracking is Tracking.TRACKED:
            pose = SE3(record["rotation"].copy(), record["translation"].copy())
        if record["has_covariance"]:
            covariance = record["covariance"].copy()
        if record["has_scale"]:
            sigma, observable = record["scale_sigma"], record["scale_observable"]
            scale = ScaleEstimate(float(sigma), bool(observable))
        if record["has_depth_range"]:
            near, far = record["depth_range"].tolist()
            depth_range = near, far
        return TrackedPose(
            int(record["stamp_ns"]),
            tracking,
            pose,
            covariance,
            scale,
            depth_range,
            bool(record["corrected"]),
        )
