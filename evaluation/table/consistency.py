"""Consistency of a front end: its errors against the covariance that it reports."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from airground.core.se3 import SE3
from airground.slam.front_end import TrackedPose

MIN_POSES = 3
"""Fewer poses show nothing: they can be aligned almost at will."""


@dataclass(frozen=True)
class Consistency:
    """Normalized estimation error squared (NEES) of one part of the pose.

    Attributes:
        nees: Mean over the images, divided by the degrees of freedom: 1 where the covariance
            is right, above 1 where the front end is overconfident. NaN where none was reported.
        within_95: Share of the images whose error lies in the 95 % region; 0.95 is right.
    """

    nees: float
    within_95: float


def consistency(
    answers: Sequence[TrackedPose], true_pose: Callable[[int], SE3]
) -> tuple[Consistency, Consistency]:
    """Consistency of the live position (3 degrees of freedom) and of the live pose (6).

    A map is free in its origin and heading only, so the truth is aligned by those four over
    all images: scale error and tilt count as errors. Images without a usable covariance are
    left out.
    """
    known = [
        (answer.T_map_camera, true_pose(answer.stamp_ns), answer.covariance)
        for answer in answers
        if answer.T_map_camera is not None and answer.covariance is not None
    ]
    known = [entry for entry in known if _usable(entry[2])]
    if len(known) < MIN_POSES:
        nothing = Consistency(float("nan"), float("nan"))
        return nothing, nothing
    estimates, truths, covariances = zip(*known, strict=True)
    T_map_world = level_alignment(estimates, truths)
    errors = np.array([_error(e, T_map_world @ t) for e, t in zip(estimates, truths, strict=True)])
    covariance = np.array(covariances)
    return _normalized(errors[:, :3], covariance[:, :3, :3]), _normalized(errors, covariance)


def level_alignment(estimates: Sequence[SE3], truths: Sequence[SE3]) -> SE3:
    """`T_map_world` by shift and heading alone that brings the true positions closest."""
    here = np.array([pose.translation for pose in estimates])
    there = np.array([pose.translation for pose in truths])
    a, b = here - here.mean(axis=0), there - there.mean(axis=0)
    heading = np.arctan2((b[:, 0] * a[:, 1] - b[:, 1] * a[:, 0]).sum(), (b[:, :2] * a[:, :2]).sum())
    turn = SE3.from_heading(float(heading))
    return SE3.from_heading(float(heading), here.mean(axis=0) - turn @ there.mean(axis=0))


def _usable(covariance: NDArray[np.float64]) -> bool:
    """Whether a covariance can be inverted."""
    return bool(np.isfinite(covariance).all() and np.linalg.eigvalsh(covariance)[0] > 0)


def _error(estimate: SE3, true: SE3) -> NDArray[np.float64]:
    """(6,) position error, then rotation vector of estimate times inverse truth."""
    turn = SE3((estimate.rotation @ true.rotation.T), np.zeros(3))
    return np.concatenate([estimate.translation - true.translation, turn.rotation_vector()])


def _normalized(errors: NDArray[np.float64], covariances: NDArray[np.float64]) -> Consistency:
    freedom = errors.shape[1]
    solved = np.linalg.solve(covariances, errors[:, :, None])[:, :, 0]
    nees = np.einsum("ij,ij->i", errors, solved)
    inside = nees <= chi2.ppf(0.95, freedom)
    return Consistency(float(nees.mean() / freedom), float(inside.mean()))
