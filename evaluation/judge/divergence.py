"""Where two runs of one recording part: the first pose, surface, belief and alignment that differ.

A difference is small up to what the table of metrics calls small: `Metric.matters` of the accepted
figure for errors, of the whole for shares. No truth is needed: the runs are held against each
other.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from evaluation.judge.accepted import Measured, figure
from evaluation.judge.metrics import METRICS
from evaluation.setup.text import degrees, metres, percent

Kind = Literal["MAV's pose", "ground robot's pose", "surface", "belief", "alignment"]
ROBOT_OF: dict[str, Kind] = {"mav": "MAV's pose", "ground": "ground robot's pose"}
Made = TypeVar("Made")


@dataclass(frozen=True, eq=False)
class MadeSurface:
    """An aerial surface; `points_mav` are (N, 3) in the MAV's map [m], none where it was not
    placed."""

    points_mav: NDArray[np.float32] | None


@dataclass(frozen=True, eq=False)
class MadeBelief:
    """The particles' belief after an aerial map; `T_ground_mav` is None where it was refused."""

    T_ground_mav: SE3 | None
    spread_m: float


@dataclass(frozen=True, eq=False)
class MadeAlignment:
    """An alignment; `T_ground_mav` is None where it was refused."""

    T_ground_mav: SE3 | None


@dataclass(frozen=True, eq=False)
class Trace:
    """What a run did, by time [ns].

    Attributes:
        name: The run's name for readers.
        poses: Poses as given while running, by robot ("mav", "ground"); none of one that was never
            tracked.
        surfaces, beliefs, alignments: By the time at which they were made.
    """

    name: str
    poses: Mapping[str, Trajectory]
    surfaces: Mapping[int, MadeSurface]
    beliefs: Mapping[int, MadeBelief]
    alignments: Mapping[int, MadeAlignment]

    def mav_position(self, stamp_ns: int) -> NDArray[np.float64]:
        """(3,) the MAV in its own map at its newest pose [m]; the origin before its first one."""
        path = self.poses.get("mav")
        newest = -1 if path is None else int(np.searchsorted(path.stamps_ns, stamp_ns, "right")) - 1
        return np.zeros(3) if path is None or newest < 0 else path.translations[newest]


@dataclass(frozen=True)
class Limits:
    """The largest differences that are small.

    Attributes:
        pose_m: Of positions, by robot [m].
        surface_m: Median distance from one surface to the other [m].
        surface_share: Change of the number of points.
        belief_m, spread_m: Of the MAV's horizontal position, and of the spread [m].
        aligned_m, aligned_deg: Of the MAV's aligned position [m] and of the rotation [deg].
    """

    pose_m: Mapping[str, float]
    surface_m: float
    surface_share: float
    belief_m: float
    spread_m: float
    aligned_m: float
    aligned_deg: float

    @classmethod
    def of(cls, accepted: Measured) -> Limits:
        """The limits by the table of metrics and the accepted figures."""

        def small(name: str) -> float:
            metric = METRICS[name]
            if not metric.relative:
                return metric.matters
            return metric.matters * figure(metric, accepted.samples[name])

        return cls(
            pose_m={robot: small(f"{robot}_trajectory") for robot in ROBOT_OF},
            surface_m=small("surface_median"),
            surface_share=small("completeness"),
            belief_m=small("localization_1"),
            spread_m=small("spread_1"),
            aligned_m=small("refined_translation"),
            aligned_deg=small("refined_rotation"),
        )


@dataclass(frozen=True)
class Difference:
    """The first one of its kind: when [ns], and how much in words."""

    stamp_ns: int
    how_much: str


@dataclass(frozen=True)
class Held:
    """One kind of thing in both runs.

    Attributes:
        kind: What was compared.
        number: How many there are, in both runs together and common ones once.
        small: The limits in words.
        first: Where they part; None where no difference is beyond the limits.
    """

    kind: Kind
    number: int
    small: str
    first: Difference | None


def hold(one: Trace, other: Trace, limits: Limits) -> list[Held]:
    """Both runs, kind by kind in the order of the pipeline."""
    return [
        *(_poses(one, other, robot, limits) for robot in ROBOT_OF),
        _surfaces(one, other, limits),
        _beliefs(one, other, limits),
        _alignments(one, other, limits),
    ]


def first_divergence(helds: Iterable[Held]) -> Held | None:
    """The earliest difference of any kind; of two at one time the earlier in the pipeline."""
    parted = [held for held in helds if held.first is not None]
    return min(parted, key=lambda held: held.first.stamp_ns if held.first else 0, default=None)


def _poses(one: Trace, other: Trace, robot: str, limits: Limits) -> Held:
    limit = limits.pose_m[robot]
    mine, its = (_positions(trace, robot) for trace in (one, other))
    differences = (
        Difference(stamp, f"{_fine(float(np.linalg.norm(a - b)))} apart")
        if a is not None and b is not None
        else _alone(stamp, "tracked", one if b is None else other)
        for stamp, a, b in _pairs(mine, its)
        if a is None or b is None or np.linalg.norm(a - b) > limit
    )
    return _held(ROBOT_OF[robot], mine, its, _fine(limit), differences)


def _positions(trace: Trace, robot: str) -> dict[int, NDArray[np.float64]]:
    path = trace.poses.get(robot)
    if path is None:
        return {}
    return dict(zip(path.stamps_ns.tolist(), path.translations, strict=True))


def _surfaces(one: Trace, other: Trace, limits: Limits) -> Held:
    def differences() -> Iterator[Difference]:
        for stamp, a, b in _pairs(one.surfaces, other.surfaces):
            if a is None or b is None:
                yield _made_once(stamp, one, other, one.surfaces, other.surfaces)
            elif a.points_mav is not None and b.points_mav is not None:
                off_m, share = surface_difference(a.points_mav, b.points_mav)
                if off_m > limits.surface_m or abs(share) > limits.surface_share:
                    yield Difference(
                        stamp, f"{_fine(off_m)} apart, {percent(share, 1, '+')} points"
                    )

    small = f"{_fine(limits.surface_m)}, {percent(limits.surface_share)} of the points"
    return _held("surface", one.surfaces, other.surfaces, small, differences())


def surface_difference(one: NDArray[np.float32], other: NDArray[np.float32]) -> tuple[float, float]:
    """Median distance of the points (N, 3) of each to the nearest of the other, the larger of both
    directions [m], and the change of their number as a share."""
    if not len(one) or not len(other):
        return (0.0 if len(one) == len(other) else float("inf")), float(len(other) > len(one))
    there, back = KDTree(other).query(one)[0], KDTree(one).query(other)[0]
    return float(max(np.median(there), np.median(back))), len(other) / len(one) - 1


def _beliefs(one: Trace, other: Trace, limits: Limits) -> Held:
    def differences() -> Iterator[Difference]:
        for stamp, a, b in _pairs(one.beliefs, other.beliefs):
            if a is None or b is None:
                yield _made_once(stamp, one, other, one.beliefs, other.beliefs)
            elif a.T_ground_mav is None or b.T_ground_mav is None:
                if (a.T_ground_mav is None) != (b.T_ground_mav is None):
                    yield _alone(stamp, "claimed", one if b.T_ground_mav is None else other)
            else:
                mine = a.T_ground_mav @ one.mav_position(stamp)
                its = b.T_ground_mav @ other.mav_position(stamp)
                off_m = float(np.linalg.norm((mine - its)[:2]))
                wider_m = b.spread_m - a.spread_m
                if off_m > limits.belief_m or abs(wider_m) > limits.spread_m:
                    spread = metres(wider_m, 2, "+")
                    yield Difference(stamp, f"{_fine(off_m)} apart, spread {spread}")

    small = f"{_fine(limits.belief_m)}, spread {_fine(limits.spread_m)}"
    return _held("belief", one.beliefs, other.beliefs, small, differences())


def _alignments(one: Trace, other: Trace, limits: Limits) -> Held:
    def differences() -> Iterator[Difference]:
        for stamp, a, b in _pairs(one.alignments, other.alignments):
            if a is None or b is None:
                yield _made_once(stamp, one, other, one.alignments, other.alignments)
            elif a.T_ground_mav is None or b.T_ground_mav is None:
                if (a.T_ground_mav is None) != (b.T_ground_mav is None):
                    yield _alone(stamp, "accepted", one if b.T_ground_mav is None else other)
            else:
                mine = a.T_ground_mav @ one.mav_position(stamp)
                its = b.T_ground_mav @ other.mav_position(stamp)
                off_m = float(np.linalg.norm(mine - its))
                turned_deg = float(np.rad2deg((a.T_ground_mav.inverse() @ b.T_ground_mav).angle()))
                if off_m > limits.aligned_m or turned_deg > limits.aligned_deg:
                    yield Difference(stamp, f"{_fine(off_m)} and {degrees(turned_deg, 3)} apart")

    small = f"{_fine(limits.aligned_m)}, {degrees(limits.aligned_deg, 3)}"
    return _held("alignment", one.alignments, other.alignments, small, differences())


def _pairs(
    one: Mapping[int, Made], other: Mapping[int, Made]
) -> Iterator[tuple[int, Made | None, Made | None]]:
    """What both made at each time, in order of time; None where only the other made one."""
    for stamp in sorted(one.keys() | other.keys()):
        yield stamp, one.get(stamp), other.get(stamp)


def _alone(stamp_ns: int, done: str, by: Trace) -> Difference:
    return Difference(stamp_ns, f"{done} only in {by.name}")


def _made_once(
    stamp_ns: int,
    one: Trace,
    other: Trace,
    ones: Mapping[int, object],
    others: Mapping[int, object],
) -> Difference:
    """What only one run made at a time, and when the other makes its next."""
    by, lacks, its = (one, other, others) if stamp_ns in ones else (other, one, ones)
    later = min((stamp for stamp in its if stamp > stamp_ns), default=None)
    when = "makes no more" if later is None else f"next at {later / 1e9:.3f} s"
    return Difference(stamp_ns, f"made only in {by.name}; {lacks.name}: {when}")


def _held(
    kind: Kind,
    one: Mapping[int, object],
    other: Mapping[int, object],
    small: str,
    differences: Iterator[Difference],
) -> Held:
    return Held(kind, len(one.keys() | other.keys()), small, next(differences, None))


def _fine(value_m: float) -> str:
    return metres(value_m, 2)
