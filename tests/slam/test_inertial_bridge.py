"""When the map goes on from where inertia has led."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from airground.config import Config
from airground.slam.frame import Frame
from airground.slam.inertial_bridge import MAX_BRIDGE_NS, UNKNOWN_IMAGES, InertialBridge
from airground.slam.rig_state import RigState
from airground.slam.sparse_map import SparseMap

STEP_NS = 33_333_333
RNG = np.random.default_rng(0)
SCENE = RNG.integers(0, 255, (240, 320), dtype=np.uint8)
BLACK = np.zeros_like(SCENE)
STATE = RigState.at_origin()


def bridge(gap: bool = False) -> InertialBridge:
    """One behind a keyframe at 0 s, whose inertial samples since then are all there, or not."""
    known = None if gap else object()
    motion: Any = SimpleNamespace(preintegrate=lambda start_ns, end_ns, state: known)
    sparse_map: Any = SimpleNamespace(keyframes=[SimpleNamespace(stamp_ns=0)])
    return InertialBridge(sparse_map, motion, Config().rgbd_slam, 4.0)


def frame(index: int, image: NDArray[np.uint8] = SCENE, depth_m: float | None = 2.0) -> Frame:
    depth = None if depth_m is None else np.full(image.shape, depth_m, np.float32)
    return Frame(index * STEP_NS, image, depth)


def asked(one: InertialBridge, frames: list[Frame], seen_ns: int = 0) -> list[bool]:
    return [one.due(image, STATE, seen_ns) for image in frames]


def test_only_several_unknown_images_in_a_row_extend_the_map() -> None:
    waiting = [False] * (UNKNOWN_IMAGES - 1)
    frames = [frame(30 + k) for k in range(2 * UNKNOWN_IMAGES)]
    assert asked(bridge(), frames) == [*waiting, True, *waiting, True]


def test_a_black_image_or_one_with_a_pose_begins_the_count_anew() -> None:
    one = bridge()
    almost = [frame(30 + k) for k in range(UNKNOWN_IMAGES - 1)]
    assert not any(asked(one, [*almost, frame(40, BLACK), *almost]))
    assert not any(asked(one, almost, seen_ns=45 * STEP_NS))
    assert asked(one, [frame(50)], seen_ns=45 * STEP_NS) == [True]


@pytest.mark.parametrize("depth_m", [None, np.nan, 9.0])
def test_without_depth_in_range_nothing_extends_the_map(depth_m: float | None) -> None:
    frames = [frame(30 + k, depth_m=depth_m) for k in range(3 * UNKNOWN_IMAGES)]
    assert not any(asked(bridge(), frames))


def test_inertia_bridges_no_gap_of_its_own_and_no_long_time() -> None:
    frames = [frame(30 + k) for k in range(UNKNOWN_IMAGES)]
    assert not any(asked(bridge(gap=True), frames))
    late = [frame(MAX_BRIDGE_NS // STEP_NS + k) for k in range(1, 3 * UNKNOWN_IMAGES)]
    assert not any(asked(bridge(), late))


TILT = 0.005


def posed(one: InertialBridge, shown: int, origin: int) -> NDArray[np.float64]:
    """Covariance of a pose whose image shows points that a keyframe saw first."""
    ids = one.map.new_points(np.zeros((shown, 2)), origin)
    one.map.place(ids, np.zeros((shown, 3)))
    return one.covariance(ids, TILT)


def bridged() -> InertialBridge:
    """One that went on at 1.1 s without a pose since 0 s: keyframes at 0 s and 1.1 s."""
    one = bridge()
    frames = [frame(30 + k) for k in range(UNKNOWN_IMAGES)]
    assert asked(one, frames)[-1]
    keyframes: Any = [SimpleNamespace(stamp_ns=0), SimpleNamespace(stamp_ns=frames[-1].stamp_ns)]
    one.map = SparseMap()
    one.map.keyframes = keyframes
    return one


def test_poses_behind_a_bridge_say_how_far_a_tilted_map_falls() -> None:
    covariance = posed(bridged(), 50, origin=1)
    seconds = (30 + UNKNOWN_IMAGES - 1) * STEP_NS * 1e-9
    expected = np.diag([1, 1, 0, 0, 0, 0]) * (TILT * 0.5 * 9.81 * seconds**2) ** 2
    np.testing.assert_allclose(covariance, expected, rtol=1e-3)


def test_points_from_before_the_bridge_end_its_error() -> None:
    one = bridged()
    few = one.parameters.min_points - 1
    assert posed(one, few, origin=0)[0, 0] > 0
    assert not posed(one, few + 1, origin=0).any()
    assert not posed(one, 50, origin=1).any(), "the end is for good"


def test_bridges_add_up_and_one_that_is_tried_again_counts_once() -> None:
    one, again = bridged(), bridge()
    alone = posed(one, 50, origin=1)[0, 0]
    asked(again, [frame(30 + k) for k in range(2 * UNKNOWN_IMAGES)])
    assert again._bridged == {0: pytest.approx((30 + 2 * UNKNOWN_IMAGES - 1) * STEP_NS * 1e-9)}
    one._bridged[40 * STEP_NS] = one._bridged[0]
    assert posed(one, 50, origin=2)[0, 0] == pytest.approx(2 * alone)
