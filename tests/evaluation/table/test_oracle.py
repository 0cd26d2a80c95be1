"""An oracle is exact without noise, and off by the stated noise with it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from evo.core import metrics, sync
from evo.core.trajectory import PoseTrajectory3D

from airground.core.messages import MavImage
from airground.core.se3 import SE3
from evaluation.setup.setups import PAPER_DRIFT, PoseNoise
from evaluation.table.oracle import oracle_front_ends

STAMPS = np.arange(0, 40_000_000_000, 33_333_333, dtype=np.int64)


def true_pose(stamp_ns: int) -> SE3:
    """A loop of 3 m radius, 2 m up, camera looking down and turning."""
    angle = 2 * np.pi * stamp_ns / 40e9
    down = SE3.from_rotation_vector([np.pi, 0, 0], [3 * np.cos(angle), 3 * np.sin(angle), 2.0])
    return SE3(SE3.from_heading(0.3 * angle).rotation @ down.rotation, down.translation)


def front_ends(noise: PoseNoise):
    robot = SimpleNamespace(camera_stamps=STAMPS)
    recording = SimpleNamespace(mav=robot, ground=robot)
    truth = SimpleNamespace(T_world_mav_camera=true_pose, T_world_ground_camera=true_pose)
    return oracle_front_ends(recording, truth, noise, np.random.default_rng(3))


def tracked(front_end) -> list[SE3]:
    image = np.zeros((2, 2), np.uint8)
    return [front_end.track(MavImage(int(t), image)).T_map_camera for t in STAMPS]


def evo_path(poses: list[SE3]) -> PoseTrajectory3D:
    quaternions = np.array([np.roll(pose.quaternion_xyzw(), 1) for pose in poses])
    positions = np.array([pose.translation for pose in poses])
    return PoseTrajectory3D(positions, quaternions, STAMPS / 1e9)


def aligned_rmse(poses: list[SE3]) -> float:
    """Absolute trajectory error after SE3 alignment, by evo."""
    reference = evo_path([true_pose(int(t)) for t in STAMPS])
    reference, estimate = sync.associate_trajectories(reference, evo_path(poses))
    estimate.align(reference)
    ape = metrics.APE(metrics.PoseRelation.translation_part)
    ape.process_data((reference, estimate))
    return ape.get_statistic(metrics.StatisticsType.rmse)


def test_exact_poses_are_exact_up_to_the_map_frame() -> None:
    poses = tracked(front_ends(PoseNoise()).mav)
    assert aligned_rmse(poses) < 1e-9
    T_map_world = poses[0] @ true_pose(0).inverse()
    for pose, stamp in zip(poses[::100], STAMPS[::100], strict=True):
        assert np.allclose((T_map_world @ true_pose(int(stamp))).matrix(), pose.matrix())


def test_the_map_starts_at_the_first_image_with_z_up() -> None:
    pose = tracked(front_ends(PoseNoise()).ground)[0]
    assert np.allclose(pose.translation, 0)
    assert np.allclose(pose.rotation[:, 2], true_pose(0).rotation[:, 2])  # still straight down
    assert pose.rotation[1, 0] == pytest.approx(0)  # camera x lies along map x


def test_drift_has_the_stated_rms_after_alignment() -> None:
    ends = front_ends(PAPER_DRIFT)
    assert aligned_rmse(tracked(ends.mav)) == pytest.approx(0.012, rel=0.02)
    assert aligned_rmse(tracked(ends.ground)) == pytest.approx(0.038, rel=0.02)


def test_drift_is_smooth() -> None:
    poses, exact = (tracked(front_ends(n).ground) for n in (PAPER_DRIFT, PoseNoise()))
    error = np.array([a.translation - b.translation for a, b in zip(poses, exact, strict=True)])
    assert np.linalg.norm(np.diff(error, axis=0), axis=1).max() < 0.005


def test_orientation_drift_has_the_stated_rms_and_leaves_positions_alone() -> None:
    turned = replace(PAPER_DRIFT, drift_mav_deg=2.0, drift_ground_deg=1.0)
    for robot, rms_deg in (("mav", 2.0), ("ground", 1.0)):
        poses, straight = (
            tracked(getattr(front_ends(noise), robot)) for noise in (turned, PAPER_DRIFT)
        )
        for a, b in zip(poses, straight, strict=True):
            assert np.array_equal(a.translation, b.translation)
        turns = [a.rotation @ b.rotation.T for a, b in zip(poses, straight, strict=True)]
        angles_deg = np.rad2deg([SE3(turn, np.zeros(3)).angle() for turn in turns])
        assert angles_deg[0] == pytest.approx(0, abs=1e-5)
        assert np.abs(np.diff(angles_deg)).max() < 0.1  # smooth
        assert np.sqrt((angles_deg**2).mean()) == pytest.approx(rms_deg, rel=1e-3)


def test_white_noise_has_the_stated_size() -> None:
    noise = PoseNoise(white_m=0.004, white_deg=0.5)
    poses, exact = (tracked(front_ends(n).mav) for n in (noise, PoseNoise()))
    offsets = [a.inverse() @ b for a, b in zip(exact, poses, strict=True)]
    shift = np.array([offset.translation for offset in offsets])
    turn = np.rad2deg([offset.rotation_vector() for offset in offsets])
    assert shift.std() == pytest.approx(0.004, rel=0.05)
    assert turn.std() == pytest.approx(0.5, rel=0.05)


def test_same_seed_same_poses() -> None:
    one, two = (tracked(front_ends(PAPER_DRIFT).mav) for _ in range(2))
    assert all(np.array_equal(a.matrix(), b.matrix()) for a, b in zip(one, two, strict=True))
