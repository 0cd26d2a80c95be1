"""KISS-Matcher (Lim et al., ICRA 2025), then ICP."""

from __future__ import annotations

import os
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from airground.core.se3 import SE3, nearest_rotation
from evaluation.measure.baselines.interface import Answer, Given
from evaluation.measure.baselines.registration import (
    VOXEL_M,
    searched_ground,
    settled_by_icp,
    thinned,
    too_few_points,
)

if TYPE_CHECKING:
    from kiss_matcher import KISSMatcher

MIN_INLIERS = 5
"""With fewer its authors regard a registration as failed."""

ABOVE_M = 10.0
"""Height of the sensor above a cloud [m]: normals are turned to it, and both clouds are seen from
above."""


def kiss_matcher_icp(given: Given) -> Answer:
    """Match Faster-PFH features, prune them by k-core, solve robustly, settle by ICP.
    Its solver Quatro assumes that both maps are level. Its own thinning is not used: the order of
    its points depends on the threads' speed, and the result on the order."""
    refusal = too_few_points(given)
    if refusal:
        return Answer(None, refusal)
    aerial = thinned(given.sighting.surface.cloud_mav.points, VOXEL_M)
    ground = thinned(searched_ground(given), VOXEL_M)
    above_aerial, above_ground = _above(aerial), _above(ground)
    _bind_to_one_thread()
    matcher = _matcher()
    solution = matcher.estimate(
        list((aerial - above_aerial).astype(np.float32)),
        list((ground - above_ground).astype(np.float32)),
    )
    inliers = matcher.get_num_final_inliers()
    found = np.column_stack([solution.rotation, solution.translation])
    if not (solution.valid and np.isfinite(found).all()) or inliers < MIN_INLIERS:
        return Answer(None, f"{inliers} features agree, at least {MIN_INLIERS} are needed")
    rotation = nearest_rotation(np.asarray(solution.rotation, np.float64))
    start = SE3(rotation, solution.translation + above_ground - rotation @ above_aerial)
    return settled_by_icp(given, start)


def _matcher() -> KISSMatcher:
    from kiss_matcher import KISSMatcher, KISSMatcherConfig

    settings = KISSMatcherConfig(voxel_size=VOXEL_M, use_voxel_sampling=False, use_quatro=True)
    return KISSMatcher(settings)


@cache
def _bind_to_one_thread() -> None:
    """Use it once while this process has one core: TBB then keeps one thread for it.
    With more, ties are resolved by the threads' speed: of 80 runs over the same clouds on a busy
    machine two differed by millimetres."""
    cores = {pid: os.sched_getaffinity(pid) for pid in (0, os.getpid())}
    cloud = list(np.random.default_rng(0).uniform(-1, 1, (500, 3)).astype(np.float32))
    try:
        for pid, usable in cores.items():
            os.sched_setaffinity(pid, {min(usable)})
        _matcher().estimate(cloud, cloud)
    finally:
        for pid, usable in cores.items():
            os.sched_setaffinity(pid, usable)


def _above(points: NDArray) -> NDArray[np.float64]:
    """(3,) a point high above the middle of a cloud, to which its normals are turned."""
    return points.mean(axis=0) + np.array([0.0, 0.0, ABOVE_M])
