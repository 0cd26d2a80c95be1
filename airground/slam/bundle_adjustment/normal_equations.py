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
    """Of the F moving keyframes, points eliminated.

    Unknowns are the poses (rotation, position) of all keyframes and then, where there are
    inertial factors, velocity and biases of each. These couple in time only: `chain`.

    Attributes:
        poses: (6 F, 6 F) of the Hessian, upper triangle.
        chain, links: (F, 9, 9) velocity and biases of a keyframe with themselves and with
            those of the next; F is 0 without inertial factors, here and below.
        coupling: (F, 9, 18) with the poses of the keyframe before, the same, and the next.
        gradient: (N,), N is 6 F or 15 F.
        diagonal: (N,) of the Hessian before the points were eliminated.
    """

    poses: NDArray[np.float64]
    chain: NDArray[np.float64]
    links: NDArray[np.float64]
    coupling: NDArray[np.float64]
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
        width, links = 6 * self.moving, self.moving if self.inertial else 0
        out = NormalEquations(
            np.zeros((width, width)),
            np.zeros((links, 9, 9)),
            np.zeros((links, 9, 9)),
            np.zeros((links, 9, 18)),
            np.zeros(self.size),
            np.zeros(self.size),
        )
        seen = self.observations
        schur.eliminate_points(
            at.visual, seen.starts, seen.slots, damping, out.poses, out.gradient, out.diagonal
        )
        if self.inertial:
            _add_motions(
                self.motions.firsts,
                self.slots,
                at.motion_residuals,
                at.motion_jacobians,
                out.poses,
                out.chain,
                out.links,
                out.coupling,
                out.gradient,
                out.diagonal,
            )
        _add_priors(
            self.sharpness,
            self.slots,
            at.prior_residuals,
            at.headings,
            out.poses,
            out.chain,
            out.gradient,
            out.diagonal,
        )
        return out

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
    poses: NDArray,
    chain: NDArray,
    links: NDArray,
    coupling: NDArray,
    gradient: NDArray,
    diagonal: NDArray,
) -> None:
    """Add J'J and J'r of the inertial factors."""
    moving = len(chain)
    for f in range(len(firsts)):
        transposed = np.ascontiguousarray(jacobian[f].T)
        product = transposed @ jacobian[f]
        toward = transposed @ residual[f]
        for one in range(2):
            s, i = slots[firsts[f] + one], 15 * one
            if s < 0:
                continue
            chain[s] += product[i + 6 : i + 15, i + 6 : i + 15]
            for n in range(15):
                at = _place(s, moving, n)
                gradient[at] += toward[i + n]
                diagonal[at] += product[i + n, i + n]
            for other in range(2):
                t, j = slots[firsts[f] + other], 15 * other
                if t < 0:
                    continue
                # Neighbours in time have neighbouring slots.
                c = 6 * (t - s + 1)
                coupling[s, :, c : c + 6] += product[i + 6 : i + 15, j : j + 6]
                if t >= s:
                    pose, next_pose = 6 * s, 6 * t
                    poses[pose : pose + 6, next_pose : next_pose + 6] += product[
                        i : i + 6, j : j + 6
                    ]
                if t > s:
                    links[s] += product[i + 6 : i + 15, j + 6 : j + 15]


@njit(cache=True, error_model="numpy")
def _add_priors(
    sharpness: NDArray,
    slots: NDArray,
    residual: NDArray,
    headings: NDArray,
    poses: NDArray,
    chain: NDArray,
    gradient: NDArray,
    diagonal: NDArray,
) -> None:
    """Add J'J and J'r of the priors."""
    for k in range(len(slots)):
        if slots[k] < 0:
            continue
        s, turn = slots[k], 6 * slots[k]
        for i in range(3):
            gradient[turn + i] += headings[k, i] * residual[k, 3]
            diagonal[turn + i] += headings[k, i] ** 2
            for j in range(i, 3):
                poses[turn + i, turn + j] += headings[k, i] * headings[k, j]
        for n in range(12 if len(chain) else 3):
            row = n if n < 3 else n + 1
            at = _place(s, len(chain), 3 + n)
            information = sharpness[k, row] ** 2
            gradient[at] += sharpness[k, row] * residual[k, row]
            diagonal[at] += information
            if n < 3:
                poses[at, at] += information
            else:
                chain[s, n - 3, n - 3] += information


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
