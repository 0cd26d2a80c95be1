"""Images keep their poses when the keyframe that they hang on goes."""

from __future__ import annotations

import numpy as np

from airground.core.se3 import SE3
from airground.slam.rig_state import RigState
from airground.slam.sparse_map import Keyframe
from airground.slam.tracked_path import FIRST_IMAGES, TrackedPath

IMAGES_EACH = 4


def some_pose(rng: np.random.Generator) -> SE3:
    return SE3.from_rotation_vector(rng.normal(size=3), rng.normal(size=3))


def some_keyframe(stamp_ns: int, rng: np.random.Generator) -> Keyframe:
    state = RigState.at_origin().posed(some_pose(rng))
    nothing = np.empty(0, np.int64)
    return Keyframe(
        stamp_ns, np.zeros((4, 4), np.uint8), state, nothing, np.empty((0, 2)), np.empty(0)
    )


def path_over(count: int, rng: np.random.Generator) -> tuple[TrackedPath, list[Keyframe]]:
    """Some images on each of so many keyframes."""
    path, keyframes = TrackedPath(), []
    for k in range(count):
        keyframes.append(some_keyframe(100 * k, rng))
        for n in range(IMAGES_EACH):
            path.note(100 * k + n, some_pose(rng), keyframes)
    return path, keyframes


def poses(path: TrackedPath, keyframes: list[Keyframe]) -> np.ndarray:
    """(N, 4, 4) of all images."""
    trajectory = path.trajectory(keyframes)
    assert trajectory is not None
    return np.array([trajectory[n].matrix() for n in range(len(trajectory))])


def test_culling_moves_no_image() -> None:
    rng = np.random.default_rng(0)
    path, keyframes = path_over(5, rng)
    before = poses(path, keyframes)
    # The images of the second go on to the third, and from there to the fourth.
    for k in (1, 1):
        path.rehang(keyframes[k], keyframes[k + 1])
        del keyframes[k]
    assert len(before) == len(path) == 5 * IMAGES_EACH
    np.testing.assert_allclose(poses(path, keyframes), before, atol=1e-12)


def test_images_of_a_culled_keyframe_follow_the_one_that_took_them() -> None:
    rng = np.random.default_rng(1)
    path, keyframes = path_over(4, rng)
    path.rehang(keyframes[1], keyframes[0])
    del keyframes[1]
    before = poses(path, keyframes)
    moved = some_pose(rng)
    keyframes[0].state = keyframes[0].state.moved(moved)
    after = poses(path, keyframes)
    carried = 2 * IMAGES_EACH
    np.testing.assert_allclose(after[:carried], moved.matrix() @ before[:carried], atol=1e-12)
    np.testing.assert_array_equal(after[carried:], before[carried:])


def test_poses_are_those_of_a_slow_walk_along_the_chains_of_culled_keyframes() -> None:
    rng = np.random.default_rng(4)
    path, keyframes = path_over(12, rng)
    carried: dict[int, tuple[int, SE3]] = {}
    hung = {
        100 * k + n: (k, keyframes[k].state.pose().inverse() @ SE3.from_matrix(pose))
        for (k, n), pose in zip(
            ((k, n) for k in range(12) for n in range(IMAGES_EACH)),
            poses(path, keyframes),
            strict=True,
        )
    }
    alive = dict(enumerate(keyframes))
    for _ in range(8):
        culled, onto = rng.choice(list(alive), 2, replace=False)
        relative = alive[onto].state.pose().inverse() @ alive[culled].state.pose()
        carried[int(culled)] = int(onto), relative
        path.rehang(alive[culled], alive[onto])
        del alive[culled]
        for keyframe in alive.values():
            keyframe.state = keyframe.state.posed(some_pose(rng))
    for row, (k, relative) in enumerate(hung.values()):
        while k not in alive:
            k, before = carried[k]
            relative = before @ relative
        expected = (alive[k].state.pose() @ relative).matrix()
        found = poses(path, list(alive.values()))[row]
        np.testing.assert_allclose(found, expected, atol=1e-11)


def test_many_images_and_a_new_beginning() -> None:
    rng = np.random.default_rng(2)
    path, keyframes = TrackedPath(), [some_keyframe(0, rng)]
    pose = some_pose(rng)
    for n in range(2 * FIRST_IMAGES + 1):
        path.note(n + 1, pose, keyframes)
    trajectory = path.trajectory(keyframes)
    assert trajectory is not None
    assert trajectory.stamps_ns.tolist() == list(range(1, 2 * FIRST_IMAGES + 2))
    np.testing.assert_allclose(trajectory[-1].matrix(), pose.matrix(), atol=1e-12)
    path.clear()
    assert path.trajectory(keyframes) is None


def test_images_follow_a_map_that_grows() -> None:
    """Distances between cameras grow, the camera's place in the rig does not."""
    rng = np.random.default_rng(2)
    path, keyframes = path_over(4, rng)
    path.rehang(keyframes[1], keyframes[2])
    del keyframes[1]
    before = poses(path, keyframes)
    lever = np.array([0.1, -0.2, 0.3])
    path.scale(2.5, lever)
    for keyframe in keyframes:
        keyframe.state = keyframe.state.scaled(2.5, np.eye(3), lever)
    after = poses(path, keyframes)
    np.testing.assert_allclose(after[:, :3, 3], 2.5 * before[:, :3, 3], atol=1e-12)
    np.testing.assert_allclose(after[:, :3, :3], before[:, :3, :3], atol=1e-12)


def test_what_adjustment_changed_is_spread_over_the_images_between_keyframes() -> None:
    rng = np.random.default_rng(3)
    path = TrackedPath()
    keyframes = [some_keyframe(0, rng)]
    start = keyframes[0].state.pose()
    step = SE3.from_rotation_vector([0.0, 0.0, 0.02], [0.01, 0.0, 0.0])
    tracked = [start]
    for _ in range(IMAGES_EACH):
        tracked.append(tracked[-1] @ step)
    for n in range(IMAGES_EACH):
        path.note(n, tracked[n], keyframes)
    path.lead(IMAGES_EACH, tracked[IMAGES_EACH], keyframes)
    second = some_keyframe(IMAGES_EACH, rng)
    # Adjusted, the second keyframe is 4 cm from where it was tracked.
    moved = tracked[IMAGES_EACH] @ SE3.from_rotation_vector([0, 0, 0], [0.0, 0.04, 0.0])
    second.state = second.state.posed(moved)
    keyframes.append(second)
    path.note(IMAGES_EACH, moved, keyframes)
    found = poses(path, keyframes)
    np.testing.assert_allclose(found[0], start.matrix(), atol=1e-12)
    np.testing.assert_allclose(found[-1], moved.matrix(), atol=1e-12)
    steps = np.linalg.norm(np.diff(found[:, :3, 3], axis=0), axis=1)
    assert steps.max() < 0.016  # not 4 cm at once
