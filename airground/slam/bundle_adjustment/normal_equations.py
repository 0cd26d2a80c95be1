"""The linearized problem: its cost, its normal equations, and steps of the state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.slam import so3
from airground.slam.bundle_adjustment import inertial_residuals, priors, residuals, schur
from airground.slam.bundle_adjustment.inertial_residuals import PackedMotions
from airground.slam.bundle_adjustment.sorting import SortedObservations


@dataclass(frozen=True, eq=False)
class Estimate:
    """The unknowns.

    Attributes:
        rotations: (K, 3, 3).
        vectors: (K, 12) position, velocity, gyro bias, accelerometer bias.
        points: (P, 3).
    """

    rotations: NDArray[np.float64]
    vectors: NDArray[np.float64]
    points: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Linearization:
    """Everything at one estimate.

    Attributes:
        cost: Half the sum of squares, robust.
        visual: (M, NUMBERS) of `residuals.linearize`.
        motion_residuals, motion_jacobians: (F, 15), (F, 15, 30), whitened.
        prior_residuals, headings: (K, ROWS), (K, 3), whitened.
    """

    cost: float
    visual: NDArray[np.float64]
    motion_residuals: NDArray[np.float64]
    motion_jacobians: NDArray[np.float64]
    prior_residuals: NDArray[np.float64]
    headings: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Of the moving keyframes, points eliminated.

    Poses (rotation, position) of all F moving keyframes come first, then, where there are
    inertial factors, velocity and biases of each.

    Attributes:
        hessian: (N, N), upper triangle; N is 6 F or 15 F.
        gradient: (N,).
        diagonal: (N,) of the Hessian before the points were eliminated.
    """

    hessian: NDArray[np.float64]
    gradient: NDArray[np.float64]
    diagonal: NDArray[np.float64]


class Model:
    """All that stays the same while the estimate moves.

    Args:
        observations: Sorted.
        motions: Inertial factors.
        sharpness: (K, ROWS) of the priors.
        slots: (K,) which moving keyframe each is, -1 for none.
        camera: Pinhole.
        T_rig_camera: Of the camera in the rig.
        start: Where the gauge is held.
        huber: Threshold.
    """

    def __init__(
        self,
        observations: SortedObservations,
        motions: PackedMotions,
        sharpness: NDArray[np.float64],
        slots: NDArray[np.int64],
        camera: PinholeCamera,
        T_rig_camera: SE3,
        start: Estimate,
        huber: float,
    ) -> None:
        self.observations = observations
        self.motions = motions
        self.sharpness = sharpness
        self.slots = slots
        self.camera = np.array([camera.fx, camera.fy, camera.cx, camera.cy])
        # Writable copies, so that the kernels are compiled for one type only.
        self.R_rig_camera = T_rig_camera.rotation.copy()
        self.t_rig_camera = T_rig_camera.translation.copy()
        self.start = start
        self.huber = huber
        self.moving = int(slots.max(initial=-1)) + 1
        self.inertial = len(motions.firsts) > 0
        self.size = (15 if self.inertial else 6) * self.moving

    def linearize(self, at: Estimate) -> Linearization:
        """Cost, residuals and Jacobians at an estimate."""
        seen, motions = self.observations, self.motions
        count = len(motions.firsts)
        visual = np.empty((len(seen.keyframes), residuals.NUMBERS))
        motion_residuals, motion_jacobians = np.empty((count, 15)), np.empty((count, 15, 30))
        prior_residuals, headings = np.empty(self.sharpness.shape), np.empty((len(self.slots), 3))
        positions = np.ascontiguousarray(at.vectors[:, 0:3])
        R_camera_map, centres = residuals.camera_poses(
            at.rotations, positions, self.R_rig_camera, self.t_rig_camera
        )
        cost = residuals.linearize(
            seen.keyframes,
            seen.points,
            seen.measured,
            positions,
            R_camera_map,
            centres,
            at.points,
            self.camera,
            self.huber,
            visual,
        )
        if self.inertial:
            cost += inertial_residuals.linearize_motions(
                motions.firsts,
                motions.durations,
                motions.rotations,
                motions.velocities,
                motions.positions,
                motions.biases,
                motions.by_biases,
                motions.whitening,
                at.rotations,
                at.vectors,
                motion_residuals,
                motion_jacobians,
            )
        cost += priors.linearize_priors(
            self.sharpness,
            self.start.rotations,
            self.start.vectors,
            at.rotations,
            at.vectors,
            prior_residuals,
            headings,
        )
        return Linearization(
            cost, visual, motion_residuals, motion_jacobians, prior_residuals, headings
        )

    def normal_equations(self, at: Linearization, damping: float) -> NormalEquations:
        """With the points' blocks damped, the keyframes' not yet."""
        n = self.size
        hessian, gradient, diagonal = np.zeros((n, n)), np.zeros(n), np.zeros(n)
        seen = self.observations
        schur.eliminate_points(
            at.visual, seen.starts, seen.slots, damping, hessian, gradient, diagonal
        )
        if self.inertial:
            _add_motions(
                self.motions.firsts,
                self.slots,
                at.motion_residuals,
                at.motion_jacobians,
                hessian,
                gradient,
                diagonal,
            )
        _add_priors(
            self.sharpness,
            self.slots,
            at.prior_residuals,
            at.headings,
            self.inertial,
            hessian,
            gradient,
            diagonal,
        )
        return NormalEquations(hessian, gradient, diagonal)

    def moved(
        self, at: Estimate, linear: Linearization, damping: float, step: NDArray[np.float64]
    ) -> Estimate:
        """The estimate after a step (N,) of the keyframes, its points following."""
        points = np.empty_like(at.points)
        seen = self.observations
        schur.move_points(linear.visual, seen.starts, seen.slots, damping, step, at.points, points)
        rotations, vectors = at.rotations.copy(), at.vectors.copy()
        _move_keyframes(self.slots, self.moving, self.inertial, step, rotations, vectors)
        return Estimate(rotations, vectors, points)


@njit(cache=True, error_model="numpy")
def _place(slot: int, moving: int, n: int) -> int:
    """Where number n of a keyframe's 15 stands among the unknowns."""
    return 6 * slot + n if n < 6 else 6 * moving + 9 * slot + n - 6


@njit(cache=True, error_model="numpy")
def _add_motions(
    firsts: NDArray,
    slots: NDArray,
    residual: NDArray,
    jacobian: NDArray,
    hessian: NDArray,
    gradient: NDArray,
    diagonal: NDArray,
) -> None:
    """Add J'J and J'r of the inertial factors, upper triangle."""
    moving = len(gradient) // 15
    places = np.empty(30, np.int64)
    for f in range(len(firsts)):
        for n in range(30):
            slot = slots[firsts[f] + n // 15]
            places[n] = _place(slot, moving, n % 15) if slot >= 0 else -1
        transposed = np.ascontiguousarray(jacobian[f].T)
        product = transposed @ jacobian[f]
        toward = transposed @ residual[f]
        for i in range(30):
            row = places[i]
            if row < 0:
                continue
            gradient[row] += toward[i]
            diagonal[row] += product[i, i]
            for j in range(30):
                column = places[j]
                if column >= row:
                    hessian[row, column] += product[i, j]


@njit(cache=True, error_model="numpy")
def _add_priors(
    sharpness: NDArray,
    slots: NDArray,
    residual: NDArray,
    headings: NDArray,
    inertial: bool,
    hessian: NDArray,
    gradient: NDArray,
    diagonal: NDArray,
) -> None:
    """Add J'J and J'r of the priors, upper triangle."""
    moving = len(gradient) // (15 if inertial else 6)
    for k in range(len(slots)):
        if slots[k] < 0:
            continue
        turn = 6 * slots[k]
        for i in range(3):
            gradient[turn + i] += headings[k, i] * residual[k, 3]
            diagonal[turn + i] += headings[k, i] ** 2
            for j in range(i, 3):
                hessian[turn + i, turn + j] += headings[k, i] * headings[k, j]
        for n in range(12 if inertial else 3):
            row = n if n < 3 else n + 1
            at = _place(slots[k], moving, 3 + n)
            gradient[at] += sharpness[k, row] * residual[k, row]
            diagonal[at] += sharpness[k, row] ** 2
            hessian[at, at] += sharpness[k, row] ** 2


@njit(cache=True, error_model="numpy")
def _move_keyframes(
    slots: NDArray,
    moving: int,
    inertial: bool,
    step: NDArray,
    rotations: NDArray,
    vectors: NDArray,
) -> None:
    """Apply a step to the moving keyframes, in place."""
    for k in range(len(slots)):
        slot = slots[k]
        if slot < 0:
            continue
        turned = so3.exp(step[6 * slot : 6 * slot + 3]) @ rotations[k]
        # One Newton step toward the nearest rotation: products drift away from it.
        rotations[k] = turned @ (1.5 * np.eye(3) - 0.5 * (turned.T @ turned))
        for n in range(12 if inertial else 3):
            vectors[k, n] += step[_place(slot, moving, 3 + n)]
