"""Metric scale, gravity, velocities and biases of visual keyframes by their inertial motions.

The visual poses are measurements, each with white noise, and so are the inertial motions;
their maximum likelihood is found with the poses free, so that the deviation of the scale is
the true one (with the poses held, as in Campos, Montiel and Tardos, "Inertial-only
optimization for visual-inertial initialization", ICRA 2020, it is far too small).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

from airground.core.arrays import F64
from airground.core.messages import USUAL_BIAS_MPS2
from airground.core.se3 import SE3
from airground.slam import so3
from airground.slam.inertial.alignment_kernel import SHARED, STATE, Chain, normal_equations
from airground.slam.inertial.alignment_start import closed_form, tangent_basis
from airground.slam.inertial.preintegration import GRAVITY, GRAVITY_MAP, Preintegration
from airground.slam.inertial.stationarity import gravity_aligned

OBSERVABLE_SIGMA = 0.05
"""Scale known worse than this share counts as not observable."""
HOPELESS_SIGMA = 0.5
"""A closed form that leaves the scale this open is no start for a search."""
GYRO_BIAS_SIGMA = 0.1
"""Prior of the gyro's bias [rad/s]."""
VELOCITY_SIGMA = 100.0
"""Prior of velocity: none, but the equations stay regular where a chain has one keyframe [m/s]."""
MIN_KEYFRAMES = 4
MAX_STEPS = 12
SETTLED = 0.02
"""A step of scale and tilts below this share of their deviations is the last."""
NOISE_FLOOR = np.diag([1e-6] * 3 + [1e-5] * 3 + [1e-6] * 3) ** 2
"""Added to every motion's covariance, so that perfect sensors have one [rad], [m/s], [m]."""
WALK_FLOOR = 1e-6


@dataclass(frozen=True)
class VisualNoise:
    """How far a keyframe's visual pose may be off, independent of the others.

    Attributes:
        position_sigma: Standard deviation of the camera's centre per axis [visual units].
        rotation_sigma: Standard deviation of the rotation per axis [rad].
    """

    position_sigma: float
    rotation_sigma: float = 1e-3


@dataclass(frozen=True, eq=False)
class InertialAlignment:
    """How to make a visual map metric and upright: x_map = scale * R_map_v @ x_v.

    That holds for points and for the centres of cameras; the rig follows from its camera,
    since the lever between them is in metres already.

    Attributes:
        scale: Metres in a visual unit; NaN where the search failed.
        R_map_v: (3, 3) rotation into the map, whose z axis points up.
        velocities: (K, 3) velocities of the rig in the map [m/s].
        gyro_biases, accelerometer_biases: (K, 3) biases at each keyframe [rad/s], [m/s^2].
        scale_sigma: Standard deviation of the scale, as a share of it; infinite if unknown.
        tilt_sigma: Standard deviation of gravity's direction, the larger of two [rad].
        observable: Whether the motion shows the scale to 5 %; without it, believe nothing here.
        rms: Root mean square of the weighted residuals per degree of freedom: 1 where the stated
            noise is the true one. Above 1 the sigmas include it.
    """

    scale: float
    R_map_v: F64
    velocities: F64
    gyro_biases: F64
    accelerometer_biases: F64
    scale_sigma: float
    tilt_sigma: float
    observable: bool
    rms: float


def align(
    rotations: F64,
    centres: F64,
    T_rig_camera: SE3,
    motions: Sequence[Preintegration],
    noise: VisualNoise,
    bias_sigma: float = USUAL_BIAS_MPS2,
) -> InertialAlignment:
    """Scale and gravity of a map that began with vision alone.

    Args:
        rotations: (K, 3, 3) rotations `R_v_rig` of the keyframes, K >= 4.
        centres: (K, 3) centres of the cameras, in any unit.
        motions: K - 1 inertial motions between one keyframe and the next.
        noise: Noise of the visual poses [visual units], [rad].
        bias_sigma: Prior of the accelerometer's bias per axis [m/s^2].

    Returns:
        The alignment; its map is turned as the first camera's x axis is.

    Raises:
        ValueError: There are fewer than four keyframes, or the numbers do not match.
    """
    if len(rotations) < MIN_KEYFRAMES:
        raise ValueError(f"alignment needs {MIN_KEYFRAMES} keyframes, got {len(rotations)}")
    chain = _chain(rotations, centres, T_rig_camera, motions, noise, bias_sigma)
    start = closed_form(chain)
    state = _State(
        rotations=chain.rotations.copy(),
        vectors=np.zeros((len(rotations), 4, 3)),
        log_scale=-float(np.log(start.unit)) if start.unit > 0 else np.nan,
        gravity=start.gravity,
    )
    state.vectors[:, 1] = start.velocities
    state.vectors[:, 2] = start.gyro_bias
    state.vectors[:, 3] = start.accelerometer_bias
    right = rotations[0] @ T_rig_camera.rotation[:, 0]
    if not start.unit > 0 or start.unit_sigma > HOPELESS_SIGMA:
        return _result(state, gravity_aligned(-state.gravity, right), None)
    state.vectors[:, 0] = centres / start.unit - chain.rotations @ chain.lever
    solution = _search(chain, state)
    return _result(state, gravity_aligned(-state.gravity, right), solution)


def refine_scale(
    rotations: F64,
    centres: F64,
    T_rig_camera: SE3,
    motions: Sequence[Preintegration | None],
    noise: VisualNoise,
    bias_sigma: float = USUAL_BIAS_MPS2,
) -> InertialAlignment:
    """What is left to correct in scale and tilt of a metric, upright map.

    Args:
        rotations: (K, 3, 3) rotations `R_map_rig`, K >= 4.
        centres: (K, 3) centres of the cameras [m].
        motions: K - 1 inertial motions between neighbours, None where samples are missing.
        noise: Noise of the visual poses [m], [rad].
        bias_sigma: Prior of the accelerometer's bias per axis [m/s^2].

    Returns:
        The correction: `scale` near 1, and `R_map_v` the smallest turn that makes it upright.

    Raises:
        ValueError: Number of keyframes as in `align`.
    """
    if len(rotations) < MIN_KEYFRAMES:
        raise ValueError(f"refinement needs {MIN_KEYFRAMES} keyframes, got {len(rotations)}")
    chain = _chain(rotations, centres, T_rig_camera, motions, noise, bias_sigma)
    vectors = np.zeros((len(rotations), 4, 3))
    vectors[:, 0] = centres - chain.rotations @ chain.lever
    seconds = np.concatenate([[0.0], np.cumsum(chain.durations)])
    vectors[:, 1] = np.gradient(vectors[:, 0], seconds, axis=0)
    vectors[:-1, 2], vectors[:-1, 3] = chain.gyro_biases, chain.accelerometer_biases
    vectors[-1, 2:] = vectors[-2, 2:]
    state = _State(chain.rotations.copy(), vectors, 0.0, GRAVITY_MAP.copy())
    solution = _search(chain, state)
    axis = np.cross(state.gravity, GRAVITY_MAP)
    sine = np.linalg.norm(axis) / GRAVITY**2
    angle = np.arctan2(sine, state.gravity @ GRAVITY_MAP / GRAVITY**2)
    turn = so3.exp(axis * (angle / (sine * GRAVITY**2))) if sine > 0 else np.eye(3)
    return _result(state, turn, solution)


@dataclass
class _State:
    """The unknowns: (K, 3, 3) `R_v_rig`; (K, 4, 3) position, velocity, gyro's and accelerometer's
    bias, metric; logarithm of the metres in a visual unit; (3,) gravity in the axes of v."""

    rotations: F64
    vectors: F64
    log_scale: float
    gravity: F64


@dataclass(frozen=True, eq=False)
class _Solution:
    """What is known of the shared unknowns: (3, 3) covariance, and the residuals' rms."""

    covariance: F64
    rms: float


def _search(chain: Chain, state: _State) -> _Solution | None:
    """Gauss-Newton; None if it fails. Moves `state` to the optimum."""
    count = len(state.rotations)
    linked = int(chain.linked.sum())
    # Six measured a pose, fifteen a motion, nine at each beginning of a chain.
    freedom = 6 * count + STATE * linked + 9 * (count - linked) - STATE * count - SHARED
    settled = False
    for _ in range(MAX_STEPS):
        basis = tangent_basis(state.gravity)
        tilts = -so3.hat(state.gravity) @ basis
        unit = float(np.exp(-state.log_scale))
        band, border, top, cost = normal_equations(
            chain, state.rotations, state.vectors, unit, state.gravity, tilts
        )
        try:
            factor = cholesky_banded(band, lower=True, check_finite=True)
            solved = cho_solve_banded((factor, True), border)
            corner = top - border[:, :SHARED].T @ solved
            covariance = np.linalg.inv(corner[:, :SHARED])
        except (LinAlgError, ValueError):
            return None
        if settled:
            rms = float(np.sqrt(cost / max(freedom, 1)))
            return _Solution(covariance, rms)
        shared = -covariance @ corner[:, SHARED]
        step = -(solved[:, SHARED] + solved[:, :SHARED] @ shared).reshape(count, 5, 3)
        # A scale that wants to jump comes closer by factors of e.
        shared_step = float(np.clip(shared[0], -1.0, 1.0))
        for k in range(count):
            state.rotations[k] = state.rotations[k] @ so3.exp(step[k, 0])
        state.vectors += step[:, 1:]
        state.log_scale += shared_step
        state.gravity = so3.exp(basis @ shared[1:]) @ state.gravity
        settled = bool((np.abs(shared) < SETTLED * np.sqrt(np.diag(covariance))).all())
    return None


def _result(state: _State, R_map_v: F64, solution: _Solution | None) -> InertialAlignment:
    """The state in the map's axes, with honest deviations."""
    scale, scale_sigma, tilt_sigma, rms = np.nan, np.inf, np.inf, np.nan
    if solution is not None:
        scale = float(np.exp(state.log_scale))
        variances = np.diag(solution.covariance)
        inflation = max(1.0, solution.rms)
        scale_sigma = inflation * float(np.sqrt(variances[0]))
        tilt_sigma = inflation * float(np.sqrt(variances[1:].max()))
        rms = solution.rms
    return InertialAlignment(
        scale,
        R_map_v,
        state.vectors[:, 1] @ R_map_v.T,
        state.vectors[:, 2],
        state.vectors[:, 3],
        scale_sigma,
        tilt_sigma,
        scale_sigma < OBSERVABLE_SIGMA,
        rms,
    )


def _chain(
    rotations: F64,
    centres: F64,
    T_rig_camera: SE3,
    motions: Sequence[Preintegration | None],
    noise: VisualNoise,
    bias_sigma: float,
) -> Chain:
    """The measurements as arrays; a motion that is missing leaves zeros."""
    count = len(rotations) - 1
    if len(centres) != count + 1 or len(motions) != count:
        raise ValueError(
            f"{count + 1} rotations go with as many centres and {count} motions, "
            f"got {len(centres)} and {len(motions)}"
        )
    chain = Chain(
        # Copies, since the kernel would be compiled anew for read-only ones.
        np.array(rotations, dtype=np.float64, order="C"),
        np.array(centres, dtype=np.float64, order="C"),
        np.array(T_rig_camera.translation),
        np.zeros(count, bool),
        np.ones(count),
        np.zeros((count, 3, 3)),
        np.zeros((count, 3)),
        np.zeros((count, 3)),
        np.zeros((count, 5, 3, 3)),
        np.zeros((count, 9, 9)),
        np.zeros((count, 3)),
        np.zeros((count, 3)),
        np.ones((count, 2)),
        np.array(
            [
                noise.rotation_sigma,
                noise.position_sigma,
                VELOCITY_SIGMA,
                GYRO_BIAS_SIGMA,
                bias_sigma,
            ]
        ),
    )
    for k, motion in enumerate(motions):
        if motion is None:
            continue
        chain.linked[k] = True
        chain.durations[k] = motion.duration_s
        chain.turns[k], chain.velocities[k] = motion.rotation, motion.velocity
        chain.positions[k] = motion.position
        chain.jacobians[k] = (
            motion.rotation_by_gyro_bias,
            motion.velocity_by_gyro_bias,
            motion.velocity_by_accelerometer_bias,
            motion.position_by_gyro_bias,
            motion.position_by_accelerometer_bias,
        )
        chain.whitening[k] = motion.covariance
        chain.gyro_biases[k] = motion.gyro_bias
        chain.accelerometer_biases[k] = motion.accelerometer_bias
        chain.walks[k] = motion.gyro_bias_sigma, motion.accelerometer_bias_sigma
    chain.whitening[:] = np.linalg.inv(np.linalg.cholesky(chain.whitening + NOISE_FLOOR))
    np.maximum(chain.walks, WALK_FLOOR, out=chain.walks)
    return chain
