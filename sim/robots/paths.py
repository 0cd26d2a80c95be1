"""Smooth curves of time: waypoint paths, take-off, sway, random motion.

A curve is evaluated into a *jet*: an array (3, N, D) of value, first and second derivative
by time at N times. Jets of the same shape add up; `scale_jet` multiplies one by another.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from airground.core.arrays import read_only
from airground.errors import InputError

DEGREE = 5
ROUNDING_S = 0.5  # step of a path's spline where none is given
# The quintic B-spline of independent unit normals has this standard deviation at a knot.
_NOISE_GAIN = float(np.sqrt(np.sum((np.array([1, 26, 66, 26, 1]) / 120) ** 2)))


@dataclass(frozen=True, eq=False)
class SmoothCurve:
    """A uniform quintic B-spline: four times differentiable, exact derivatives.

    Value and derivatives are convex means of the control points and of their difference
    quotients: the curve stays in the hull of its controls and is nowhere faster than they
    are. It touches no corner but rounds it within three steps on either side.

    Attributes:
        controls: (M, D) float64, M > 5; control i has its greatest weight at
            `start + i * step`.
        start: Time (or travelled length) of the first control.
        step: Spacing of the controls, positive.
    """

    controls: NDArray[np.float64]
    start: float
    step: float

    def __post_init__(self) -> None:
        controls = read_only(self.controls, "controls", (None, None), np.float64)
        if len(controls) <= DEGREE:
            raise ValueError(f"a curve needs more than {DEGREE} controls, got {len(controls)}")
        if not self.step > 0:
            raise ValueError(f"step must be positive, got {self.step}")
        object.__setattr__(self, "controls", controls)

    def jet(self, times: ArrayLike) -> NDArray[np.float64]:
        """(3, N, D) value, first and second derivative; held constant outside its domain."""
        from scipy.interpolate import BSpline  # a tenth of a second, only where paths are planned

        times = np.asarray(times, np.float64)
        count = len(self.controls)
        half = (DEGREE + 1) / 2
        knots = self.start + (np.arange(count + DEGREE + 1) - half) * self.step
        spline = BSpline(knots, self.controls, DEGREE)
        first, last = knots[DEGREE], knots[count]
        inside = ((times >= first) & (times <= last))[:, None]
        clipped = np.clip(times, first, last)
        moving = [np.where(inside, spline.derivative(order)(clipped), 0.0) for order in (1, 2)]
        return np.stack([spline(clipped), *moving])


@dataclass(frozen=True, eq=False)
class WaypointPath:
    """A curve through the neighbourhood of waypoints, at rest at both ends.

    Attributes:
        curve: The path; columns as in the waypoints.
        start_s: Time at which the motion starts [s].
        end_s: Time of rest at the last waypoint [s].
    """

    curve: SmoothCurve
    start_s: float
    end_s: float

    def jet(self, times: ArrayLike) -> NDArray[np.float64]:
        """(3, N, D) value, velocity and acceleration."""
        return self.curve.jet(times)


def planar_path(
    waypoints: ArrayLike, speed_mps: float, start_s: float, rounding_s: float = ROUNDING_S
) -> WaypointPath:
    """A path over (x, y) waypoints whose speed never exceeds `speed_mps`.

    Args:
        waypoints: (K, 2) [m], K >= 2.
        speed_mps: Speed on straight stretches, and the limit everywhere.
        start_s: Time at which the motion starts [s].
        rounding_s: Step of the spline: a corner is rounded within about twice this time.

    Raises:
        InputError: Fewer than two waypoints, a number that is not finite, a speed or a
            rounding that is not positive.
    """
    points = _checked_waypoints(waypoints, 2, "waypoints must be [x, y]")
    _check_positive("speed_mps", speed_mps)
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return _timed_path(points, lengths / speed_mps, start_s, rounding_s)


def heading_path(
    waypoints: ArrayLike, speed_mps: float, turn_rps: float, start_s: float
) -> WaypointPath:
    """A path over (x, y, heading) waypoints that keeps to a speed and a yaw rate.

    From one waypoint to the next the heading turns the shorter way, at the constant rate
    that ends with the stretch; a stretch takes as long as the slower of the two needs.

    Args:
        waypoints: (K, 3) [m, m, rad], K >= 2.
        speed_mps: Limit of the speed.
        turn_rps: Limit of the yaw rate [rad/s].
        start_s: Time at which the motion starts [s].

    Raises:
        InputError: As for `planar_path`, or a yaw rate that is not positive.
    """
    points, durations = _timed_headings(waypoints, speed_mps, turn_rps)
    return _timed_path(points, durations, start_s, ROUNDING_S)


def cut_headings(
    waypoints: ArrayLike, speed_mps: float, turn_rps: float, driven_s: float
) -> NDArray[np.float64]:
    """(M, 3) the waypoints of a `heading_path` that ends after driving for so long.

    The last one lies where the path, its corners not rounded, is then.

    Raises:
        InputError: As for `heading_path`, or the time is not positive.
    """
    _check_positive("driven_s", driven_s)
    points, durations = _timed_headings(waypoints, speed_mps, turn_rps)
    passed = np.concatenate([[0.0], np.cumsum(durations)])
    last = [np.interp(driven_s, passed, column) for column in points.T]
    return np.append(points[passed < driven_s], [last], axis=0)


def _timed_headings(
    waypoints: ArrayLike, speed_mps: float, turn_rps: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(K, 3) checked waypoints with their headings unwrapped, and (K - 1,) durations [s]."""
    points = _checked_waypoints(waypoints, 3, "waypoints must be [x, y, heading]").copy()
    _check_positive("speed_mps", speed_mps)
    _check_positive("turn rate", turn_rps)
    points[:, 2] = np.unwrap(points[:, 2])
    moves = np.diff(points, axis=0)
    durations = np.maximum(
        np.linalg.norm(moves[:, :2], axis=1) / speed_mps, np.abs(moves[:, 2]) / turn_rps
    )
    return points, durations


def _timed_path(
    points: NDArray, durations: NDArray, start_s: float, rounding_s: float
) -> WaypointPath:
    """The polyline walked in the given durations, with its corners rounded by the spline."""
    _check_positive("rounding_s", rounding_s)
    reach = (DEGREE + 1) / 2 * rounding_s
    passed = start_s + reach + np.concatenate([[0.0], np.cumsum(durations)])
    first = start_s - reach
    count = int(np.ceil((passed[-1] - first + 2 * reach) / rounding_s)) + DEGREE
    times = first + np.arange(count) * rounding_s
    controls = np.stack([np.interp(times, passed, column) for column in points.T], axis=1)
    curve = SmoothCurve(controls, first, rounding_s)
    return WaypointPath(curve, start_s, float(passed[-1] + reach))


def random_curve(
    rng: np.random.Generator, start: float, end: float, step: float, deviations: ArrayLike
) -> SmoothCurve:
    """Smooth random motion around zero over [start, end].

    Args:
        rng: Source of randomness.
        start, end: Domain of the path [s, or m of travel].
        step: Spacing of its controls; it holds little beyond the frequency 1 / (3 step).
        deviations: (D,) standard deviations; no value exceeds four of them.
    """
    deviations = np.asarray(deviations, np.float64)
    count = int(np.ceil((end - start) / step)) + DEGREE + 1
    normals = np.clip(rng.standard_normal((count, len(deviations))), -2.5, 2.5)
    return SmoothCurve(normals * deviations / _NOISE_GAIN, start - DEGREE / 2 * step, step)


def minimum_jerk(times: ArrayLike, start: float, duration: float) -> NDArray[np.float64]:
    """(3, N, 1) jet from 0 to 1 with least jerk, at rest before and after."""
    _check_positive("duration", duration)
    raw = (np.asarray(times, np.float64) - start) / duration
    u = np.clip(raw, 0.0, 1.0)
    value = u**3 * (10 - 15 * u + 6 * u**2)
    rate = 30 * u**2 * (1 - u) ** 2 / duration
    bend = 60 * u * (1 - u) * (1 - 2 * u) / duration**2
    return np.stack([value, rate, bend])[..., None]


def sinusoids(
    times: ArrayLike, amplitudes: ArrayLike, frequencies_hz: ArrayLike, phases: ArrayLike
) -> NDArray[np.float64]:
    """(3, N, D) jet of one sine a column."""
    omega = 2 * np.pi * np.asarray(frequencies_hz, np.float64)
    amplitudes = np.asarray(amplitudes, np.float64)
    angle = np.asarray(times, np.float64)[:, None] * omega + np.asarray(phases, np.float64)
    sine, cosine = amplitudes * np.sin(angle), amplitudes * np.cos(angle)
    return np.stack([sine, omega * cosine, -(omega**2) * sine])


def scale_jet(jet: NDArray, factor: NDArray) -> NDArray[np.float64]:
    """The jet of the product of two curves; shapes broadcast (product rule)."""
    return np.stack(
        [
            jet[0] * factor[0],
            jet[1] * factor[0] + jet[0] * factor[1],
            jet[2] * factor[0] + 2 * jet[1] * factor[1] + jet[0] * factor[2],
        ]
    )


def _checked_waypoints(waypoints: ArrayLike, columns: int, what: str) -> NDArray[np.float64]:
    try:
        points = np.asarray(waypoints, np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{what} with the same length and only numbers in each") from None
    if points.ndim != 2 or points.shape[1] != columns:
        raise InputError(f"{what}, got an array of shape {points.shape}")
    if len(points) < 2:
        raise InputError(f"{what}: at least 2 are needed, got {len(points)}")
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        raise InputError(f"{what}: number {bad[0] + 1} is {points[bad[0]].tolist()}, not finite")
    return points


def _check_positive(name: str, value: float) -> None:
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"{name} must be positive and finite, got {value}")
