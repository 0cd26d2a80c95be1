"""References of refinement trials: the true relation of the robots, or one with stated errors.

Motion capture measures the poses of tracked bodies. To compare camera poses with it, either each
camera's pose in its body is calibrated, or the estimated path is aligned with the measured one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from evo.core.geometry import GeometryException, umeyama_alignment

from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from airground.core.trajectory import Trajectory
from airground.errors import InputError
from evaluation.setup.setups import Reference
from evaluation.table.truth_errors import true_T_ground_mav
from sim.recording.truth import Truth


def reference_of(
    reference: Reference,
    paths: Mapping[str, Trajectory | None],
    truth: Truth,
    rng: np.random.Generator,
) -> Callable[[Sighting], SE3]:
    """The `T_ground_mav` that a trial takes for the truth.

    Args:
        reference: Kind and errors of the reference.
        paths: Estimated camera poses of "mav" and "ground".
        truth: True poses of both cameras.
        rng: Draws the errors of the calibrations.

    Raises:
        InputError: A path cannot be aligned.
    """
    if reference.by == "paths":
        mav, ground = paths["mav"], paths["ground"]
        assert mav is not None
        assert ground is not None
        T_world_mav = _aligned(mav, truth.T_world_mav_camera)
        T_ground_mav = _aligned(ground, truth.T_world_ground_camera).inverse() @ T_world_mav
        return lambda sighting: T_ground_mav
    sizes = (reference.mav_camera_deg, reference.ground_camera_deg)
    mav_turn, ground_turn = (
        SE3.from_rotation_vector(rng.normal(0, np.deg2rad(size), 3)) for size in sizes
    )

    def by_cameras(sighting: Sighting) -> SE3:
        true = true_T_ground_mav(sighting, truth)
        if not any(sizes):
            return true
        T_mav_camera, T_ground_camera = sighting.T_mav_camera, sighting.T_ground_camera
        T_cameras = T_ground_camera.inverse() @ true @ T_mav_camera
        turned = ground_turn.inverse() @ T_cameras @ mav_turn
        return T_ground_camera @ turned @ T_mav_camera.inverse()

    return by_cameras


def _aligned(path: Trajectory, true_pose: Callable[[int], SE3]) -> SE3:
    """T_world_map of the rigid alignment of a path's positions with the true ones."""
    true = np.array([true_pose(int(stamp)).translation for stamp in path.stamps_ns])
    try:
        rotation, translation, _ = umeyama_alignment(path.translations.T, true.T, with_scale=False)
    except GeometryException:
        raise InputError("reference.by=paths: a robot that stays in place has no path") from None
    return SE3(rotation, translation)
