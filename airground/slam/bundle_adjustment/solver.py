"""Bundle adjustment by Levenberg-Marquardt."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from typing import TypeVar

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from airground.core.arrays import F64, I64
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.slam.bundle_adjustment import inertial_residuals, residuals
from airground.slam.bundle_adjustment.chain import eliminate_chain
from airground.slam.bundle_adjustment.normal_equations import (
    Estimate,
    Linearization,
    Model,
    NormalEquations,
)
from airground.slam.bundle_adjustment.priors import prior_sharpness
from airground.slam.bundle_adjustment.problem import (
    Adjustment,
    InertialFactor,
    Observations,
    Role,
    Settings,
    States,
    check,
)
from airground.slam.bundle_adjustment.sorting import sort_observations

FIRST_DAMPING = 1e-5
"""Windows start close to their optimum, where Gauss-Newton is best."""
LEAST_DAMPING, MOST_DAMPING = 1e-9, 1e4
DAMPING_FACTOR = 10.0
OPEN = 1e7
"""Ratio of a variance to that with all other unknowns known, above which the unknown counts as
undetermined, such as the scale of a map without IMU and depth."""

T = TypeVar("T")
Pieces = Generator[None, None, T]
"""Work that pauses after each piece, and its result."""


def completed(pieces: Pieces[T]) -> T:
    """The result of work, all pieces done at once."""
    while True:
        try:
            next(pieces)
        except StopIteration as finished:
            result: T = finished.value
            return result


def adjust(
    states: States,
    roles: I64,
    points: F64,
    observations: Observations,
    inertial: Sequence[InertialFactor],
    camera: PinholeCamera,
    T_rig_camera: SE3,
    settings: Settings,
) -> Adjustment:
    """Move keyframes and points to where all measurements fit best.

    Without inertial factors velocities and biases stay as they are. A point without
    observations stays; one seen once and without depth moves onto its ray.

    Args:
        roles: (K,) `Role` of each.
        points: (P, 3) points in the map [m].
        inertial: Motions between neighbouring keyframes; the map's z axis must then point up.

    Returns:
        The optimum, or as near as the allowed steps came. The cost never rises.

    Raises:
        ValueError: The parts of the problem do not fit together, or are not finite.
    """
    parts = states, roles, points, observations, inertial, camera, T_rig_camera, settings
    return completed(adjusting(*parts))


def adjusting(
    states: States,
    roles: I64,
    points: F64,
    observations: Observations,
    inertial: Sequence[InertialFactor],
    camera: PinholeCamera,
    T_rig_camera: SE3,
    settings: Settings,
) -> Pieces[Adjustment]:
    """`adjust` in pieces, each of which takes a part of a step or less: the arguments are read
    before the first pause, and the result is the same to the last bit."""
    roles = np.asarray(roles, np.int64).reshape(len(states))
    model, start = prepare(
        states, roles, points, observations, inertial, camera, T_rig_camera, settings
    )
    yield
    best, linear, cost_before, iterations = yield from _descend(model, start, settings)
    covariance = None
    if settings.covariance:
        covariance = yield from _last_covariance(model, linear, model.slots[roles == Role.FREE])
    return Adjustment(
        _states(best, states),
        best.points,
        _residuals_px(model, best, observations),
        cost_before,
        linear.cost,
        iterations,
        covariance,
    )


def prepare(
    states: States,
    roles: I64,
    points: F64,
    observations: Observations,
    inertial: Sequence[InertialFactor],
    camera: PinholeCamera,
    T_rig_camera: SE3,
    settings: Settings,
) -> tuple[Model, Estimate]:
    """The arguments of `adjust`, checked and laid out for the kernels."""
    points = np.array(points, np.float64).reshape(-1, 3)
    check(states, roles, points, observations, inertial)
    slots = np.where(roles == Role.FIXED, -1, np.cumsum(roles != Role.FIXED) - 1)
    # Between two keyframes that stay, a motion says nothing.
    telling = [f for f in inertial if max(slots[f.first], slots[f.second]) >= 0]
    motions = inertial_residuals.pack(telling)
    start = _estimate(states, points)
    model = Model(
        sort_observations(observations, slots, len(points)),
        motions,
        prior_sharpness(states, roles, motions.firsts, settings),
        slots,
        camera,
        T_rig_camera,
        start,
        settings.huber,
    )
    return model, start


def _descend(
    model: Model, start: Estimate, settings: Settings
) -> Pieces[tuple[Estimate, Linearization, float, int]]:
    """Levenberg-Marquardt with damping in proportion to the diagonal."""
    best, linear = start, model.linearize(start)
    yield
    cost_before = linear.cost
    damping = FIRST_DAMPING
    tried = 0
    while tried < settings.iterations and damping <= MOST_DAMPING:
        tried += 1
        equations = model.normal_equations(linear, damping)
        yield
        step = yield from _solving(equations, damping)
        yield
        if step is None:
            damping *= DAMPING_FACTOR
            continue
        trial = model.moved(best, linear, damping, step)
        trial_linear = model.linearize(trial)
        # Written so that a cost of NaN counts as worse.
        if not trial_linear.cost <= linear.cost:
            damping *= DAMPING_FACTOR
            continue
        decrease = linear.cost - trial_linear.cost
        small = decrease <= settings.relative_decrease * linear.cost
        best, linear = trial, trial_linear
        damping = max(damping / DAMPING_FACTOR, LEAST_DAMPING)
        if small:
            break
    return best, linear, cost_before, tried


def solve(equations: NormalEquations, damping: float) -> F64 | None:
    """(N,) step of the keyframes; None where the matrix is not positive definite."""
    return completed(_solving(equations, damping))


def _solving(equations: NormalEquations, damping: float) -> Pieces[F64 | None]:
    reduced = yield from _reducing(equations, damping)
    if reduced is None:
        return None
    lower, toward, spread, offset = reduced
    poses = -_back(lower, toward)
    return np.concatenate([poses, -(offset + spread @ poses).ravel()])


def _reducing(
    equations: NormalEquations, damping: float
) -> Pieces[tuple[F64, F64, F64, F64] | None]:
    """Cholesky factor and gradient of the poses alone, Z and z of `eliminate_chain`; None where not
    positive definite. Overwrites the equations."""
    poses, chain = equations.poses, equations.chain
    width = len(poses)
    # An unknown that nothing touches stays where it is.
    added = np.where(equations.diagonal > 0.0, damping * equations.diagonal, 1.0)
    poses.ravel()[:: width + 1] += added[:width]
    chain[:, range(9), range(9)] += added[width:].reshape(-1, 9)
    toward = equations.gradient[:width].copy()
    try:
        spread, offset = eliminate_chain(
            chain,
            equations.links,
            equations.coupling,
            equations.gradient[width:].reshape(-1, 9),
            poses,
            toward,
        )
    except np.linalg.LinAlgError:
        return None
    yield
    if not width:
        return poses, toward, spread, offset
    # The upper triangle by rows is LAPACK's lower triangle by columns.
    lower, failed = dpotrf(poses.T, lower=1, overwrite_a=1, clean=0)
    return None if failed else (lower, toward, spread, offset)


def _back(lower: F64, right: F64) -> F64:
    return dpotrs(lower, right, lower=1)[0] if len(right) else right


def _last_covariance(model: Model, linear: Linearization, free_slots: I64) -> Pieces[F64 | None]:
    """(6, 6) of position and rotation of the last free keyframe."""
    if not len(free_slots):
        return None
    equations = model.normal_equations(linear, 0.0)
    unknowns = 6 * int(free_slots[-1]) + np.array([3, 4, 5, 0, 1, 2])
    alone = equations.diagonal[unknowns]
    reduced = yield from _reducing(equations, 0.0)
    if reduced is None:
        return None
    units = np.zeros((6 * model.moving, 6))
    units[unknowns, range(6)] = 1.0
    covariance = _back(reduced[0], units)[unknowns]
    if not ((alone > 0.0) & (np.diag(covariance) * alone < OPEN)).all():
        return None
    result: F64 = 0.5 * (covariance + covariance.T)
    return result


def _estimate(states: States, points: F64) -> Estimate:
    vectors = np.concatenate(
        [states.positions, states.velocities, states.gyro_biases, states.accelerometer_biases],
        axis=1,
    )
    return Estimate(states.rotations.copy(), vectors, points)


def _states(estimate: Estimate, before: States) -> States:
    positions, velocities, gyro, accelerometer = np.split(estimate.vectors, 4, axis=1)
    return States(estimate.rotations, positions, velocities, gyro, accelerometer, before.still)


def _residuals_px(model: Model, estimate: Estimate, observations: Observations) -> F64:
    """In the order the caller gave the observations in."""
    positions = np.ascontiguousarray(estimate.vectors[:, 0:3])
    poses = residuals.camera_poses(
        estimate.rotations, positions, model.R_rig_camera, model.t_rig_camera
    )
    return residuals.reprojection_errors_px(
        observations.keyframes,
        observations.points,
        observations.pixels,
        *poses,
        estimate.points,
        model.camera,
    )
