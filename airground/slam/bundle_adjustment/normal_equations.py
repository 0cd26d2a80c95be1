"""The linearized problem: its cost, its normal equations, and steps of the state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from airground.core.arrays import F64, I64
from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.slam import so3
from airground.slam.bundle_adjustment import inertial_residuals, priors, residuals, schur
from airground.slam.bundle_adjustment.chain import place
from airground.slam.bundle_adjustment.inertial_residuals import PackedMotions
from airground.slam.bundle_adjustment.sorting import SortedObservations


@dataclass(frozen=True, eq=False)
class Estimate:
    """The unknowns.

    Attributes:
        rotations: (K, 3, 3) rotations of the keyframes.
        vectors: (K, 12) position, velocity, gyro bias, accelerometer bias.
        points: (P, 3) points in the map [m].
    """

    rotations: F64
    vectors: F64
    points: F64


@dataclass(frozen=True, eq=False)
class Linearization:
    """Everything at one estimate.

    Attributes:
        cost: Half the sum of squares, robust.
        visual: (M, NUMBERS) result of `residuals.linearize`.
        motion_residuals, motion_jacobians: (F, 15) and (F, 15, 30) whitened inertial residuals.
        prior_residuals, headings: (K, ROWS) and (K, 3) whitened residuals of the priors.
    """

    cost: float
    visual: F64
    motion_residuals: F64
    motion_jacobians: F64
    prior_residuals: F64
    headings: F64


class NormalEquations(NamedTuple):
    """Normal equations of the F moving keyframes, points eliminated.

    Unknowns are the poses (rotation, position) of all keyframes and then, where there are
    inertial factors, velocity and biases of each. These couple in time only: `chain`.

    Attributes:
        poses: (6 F, 6 F) part of the Hessian, upper triangle.
        chain, links: (F, 9, 9) velocity and biases of a keyframe with themselves and with
            those of the next; F is 0 without inertial factors, here and below.
        coupling: (F, 9, 18) blocks with the poses of the previous, the same and the next keyframe.
        gradient: (N,) gradient, N = 6 F or 15 F.
        diagonal: (N,) diagonal of the Hessian before the points were eliminated.
    """

    poses: F64
    chain: F64
    links: F64
    coupling: F64
    gradient: F64
    diagonal: F64


class Model:
    """All that stays the same while the estimate moves.

    Args:
        sharpness: (K, ROWS) inverse standard deviations of the priors.
        slots: (K,) number of each moving keyframe, -1 for the others.
        start: Estimate at which the gauge is held.
        huber: Threshold of Huber's cost.
    """

    def __init__(
        self,
        observations: SortedObservations,
        motions: PackedMotions,
        sharpness: F64,
        slots: I64,
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
                *motions, at.rotations, at.vectors, motion_residuals, motion_jacobians
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
        """The normal equations, damped in the points' blocks only."""
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
            inertial_residuals.add_motions(
                self.motions.firsts,
                self.slots,
                at.motion_residuals,
                at.motion_jacobians,
                *out,
            )
        priors.add_priors(
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

    def moved(self, at: Estimate, linear: Linearization, damping: float, step: F64) -> Estimate:
        """The estimate after a step (N,) of the keyframes, its points following."""
        points = np.empty_like(at.points)
        seen = self.observations
        schur.move_points(linear.visual, seen.starts, seen.slots, damping, step, at.points, points)
        rotations, vectors = at.rotations.copy(), at.vectors.copy()
        _move_keyframes(self.slots, self.moving, self.inertial, step, rotations, vectors)
        return Estimate(rotations, vectors, points)


@njit(cache=True, nogil=True, error_model="numpy")
def _move_keyframes(
    slots: I64, moving: int, inertial: bool, step: F64, rotations: F64, vectors: F64
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
            vectors[k, n] += step[place(slot, moving, 3 + n)]
