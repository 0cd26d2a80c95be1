"""References of refinement trials: exact by default, off by the stated errors, loose for paths."""

from types import SimpleNamespace

import numpy as np
import pytest

from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.errors import InputError
from evaluation.setup.setups import TRUE_POSES, Reference
from evaluation.table.reference import reference_of
from evaluation.table.truth_errors import relative_error, true_T_ground_mav

STAMPS = np.arange(0, 200, dtype=np.int64)
T_WORLD_MAV_MAP = SE3.from_heading(0.3, [1.0, 0.5, 0.0])
T_WORLD_GROUND_MAP = SE3.from_heading(-0.7, [-1.0, 0.2, 0.4])


def mav_camera(stamp_ns: int) -> SE3:
    """A loop of 1.5 m radius, 2 m up, looking down."""
    angle = 2 * np.pi * stamp_ns / len(STAMPS)
    return SE3.from_rotation_vector(
        [np.pi, 0, 0], [1.5 * np.cos(angle), 1.5 * np.sin(angle), 2.0 + 0.2 * np.cos(3 * angle)]
    )


def ground_camera(stamp_ns: int) -> SE3:
    """4 m along a corridor, in curves 10 cm wide."""
    return winding(stamp_ns, 0.05)


def winding(stamp_ns: int, half_width_m: float) -> SE3:
    along = 4 * stamp_ns / len(STAMPS) - 2
    return SE3(np.eye(3), np.array([along, half_width_m * np.sin(9 * along), 0.7]))


def standing(stamp_ns: int) -> SE3:
    return ground_camera(0)


def truth_of(ground=ground_camera):
    return SimpleNamespace(T_world_mav_camera=mav_camera, T_world_ground_camera=ground)


def path(T_world_map: SE3, pose, drift_m=0.0) -> Trajectory:
    """Estimated poses that are too high in every left curve."""
    poses = []
    for stamp in STAMPS:
        true = pose(int(stamp))
        up = np.array([0.0, 0.0, drift_m * np.sin(9 * true.translation[0])])
        poses.append(T_world_map.inverse() @ SE3(true.rotation, true.translation + up))
    return Trajectory.from_poses(STAMPS.tolist(), poses)


def sighting_at(stamp: int, ground: Trajectory):
    return SimpleNamespace(
        mav_stamp_ns=stamp,
        ground_stamp_ns=stamp,
        T_mav_camera=T_WORLD_MAV_MAP.inverse() @ mav_camera(stamp),
        T_ground_camera=ground[stamp],
    )


def found(reference: Reference, drift_m=0.0, ground=ground_camera) -> list[tuple[SE3, SE3, object]]:
    """Reference and true relation, at three places."""
    paths = {
        "mav": path(T_WORLD_MAV_MAP, mav_camera),
        "ground": path(T_WORLD_GROUND_MAP, ground, drift_m),
    }
    truth = truth_of(ground)
    of = reference_of(reference, paths, truth, np.random.default_rng(2))
    sightings = [sighting_at(stamp, paths["ground"]) for stamp in (30, 90, 160)]
    return [(of(s), true_T_ground_mav(s, truth), s) for s in sightings]


def errors(reference: Reference, drift_m=0.0, ground=ground_camera):
    return [relative_error(a, b, s.T_mav_camera) for a, b, s in found(reference, drift_m, ground)]


def test_the_true_poses_are_the_default() -> None:
    for given, true, _ in found(TRUE_POSES, drift_m=0.03):
        assert np.array_equal(given.matrix(), true.matrix())


def test_a_turned_camera_of_the_mav_changes_no_position() -> None:
    turned = errors(Reference(mav_camera_deg=2.0))
    assert max(error.translation_m for error in turned) < 1e-9
    assert turned[0].rotation_deg > 0.5
    assert np.ptp([error.rotation_deg for error in turned]) < 1e-6  # constant over the flight


def test_a_turned_camera_of_the_ground_robot_moves_the_mav_by_their_distance() -> None:
    places = found(Reference(ground_camera_deg=2.0))
    for given, true, sighting in places:
        error = relative_error(given, true, sighting.T_mav_camera)
        apart_m = np.linalg.norm(
            mav_camera(sighting.mav_stamp_ns).translation
            - ground_camera(sighting.ground_stamp_ns).translation
        )
        assert 0 < error.translation_m <= apart_m * np.deg2rad(error.rotation_deg) * 1.001


def test_exact_paths_give_the_true_relation() -> None:
    for error in errors(Reference("paths")):
        assert error.translation_m < 1e-6
        assert error.rotation_deg < 1e-3


def test_a_drifting_path_through_a_corridor_leaves_its_roll_open() -> None:
    in_corridor = errors(Reference("paths"), drift_m=0.02)
    in_wide_curves = errors(Reference("paths"), 0.02, lambda stamp: winding(stamp, 1.0))
    assert min(error.rotation_deg for error in in_corridor) > 10
    assert max(error.rotation_deg for error in in_wide_curves) < 2


def test_a_robot_that_stays_in_place_has_no_path() -> None:
    with pytest.raises(InputError, match="stays in place"):
        found(Reference("paths"), ground=standing)
