"""A new keyframe puts points where they are, and takes back those the robot knew before."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from airground.config import KeyframeSlam
from airground.slam.feature_tracker import FeatureTracker
from airground.slam.frame import Frame
from airground.slam.local_mapping import LocalMapper
from airground.slam.map_adjustment import MapAdjuster
from airground.slam.sparse_map import CANDIDATE, SparseMap
from tests.slam.mapped_room import T_RIG_CAMERA, View, sees, true_points, view
from tests.slam.synthetic_world import CAMERA

PARAMETERS = KeyframeSlam(corners=120, corner_spacing_px=18, window=2, fixed_keyframes=2)
FIRST = view(0.9, 0.9)


class Mapping:
    """A mapper that is fed with views at true poses, corners followed by the truth."""

    def __init__(self, parameters: KeyframeSlam = PARAMETERS, max_depth_m: float = 6.0) -> None:
        self.map = SparseMap()
        self.tracker = FeatureTracker(parameters.patch_px, 1)
        adjuster = MapAdjuster(self.map, CAMERA, T_RIG_CAMERA, parameters, 0.003)
        self.mapper = LocalMapper(
            self.map, self.tracker, adjuster, CAMERA, T_RIG_CAMERA, parameters, max_depth_m
        )
        self.truth = np.empty((0, 3))
        self.clear = np.empty(0, bool)

    def insert(self, seen: View, depth: bool = False, follow: bool = True) -> None:
        """Follow all corners into a view by their true places, and make it a keyframe."""
        tracker = self.tracker
        if follow and len(tracker.ids):
            pixels, visible = sees(seen, self.truth[tracker.ids])
            tracker.pixels = pixels.astype(np.float32)
            tracker.keep(visible & self.clear[tracker.ids])
        else:
            tracker.clear()
        tracker.image = seen.image
        measured = seen.depth if depth else None
        before = len(self.map)
        self.mapper.insert(Frame(0, seen.image, measured), seen.state, None, False)
        truth, clear = true_points(seen, self.map.first_pixels[before : len(self.map)])
        self.truth = np.concatenate([self.truth, truth])
        self.clear = np.concatenate([self.clear, clear])

    def errors(self) -> np.ndarray:
        """Distances of mapped points, those on edges left out, from their true places [m]."""
        ids = np.flatnonzero(self.map.mapped(np.arange(len(self.map))) & self.clear)
        return np.linalg.norm(self.map.positions[ids] - self.truth[ids], axis=1)


def test_with_depth_corners_are_in_the_map_at_once_and_right() -> None:
    mapping = Mapping()
    mapping.insert(FIRST, depth=True)
    assert len(mapping.errors()) > 60
    # A pixel covers 1 cm at 2 m, and corners sit on whole ones.
    assert mapping.errors().max() < 2e-3


def test_beyond_the_greatest_depth_and_without_depth_they_wait() -> None:
    for mapping, depth in [(Mapping(max_depth_m=1.0), True), (Mapping(), False)]:
        mapping.insert(FIRST, depth)
        assert len(mapping.tracker.ids) > 40
        assert (mapping.map.states[mapping.tracker.ids] == CANDIDATE).all()


def test_corners_seen_from_two_places_are_triangulated() -> None:
    mapping = Mapping()
    mapping.insert(FIRST)
    mapping.insert(view(1.05, 0.8))
    errors = mapping.errors()
    assert len(errors) > 40
    assert np.median(errors) < 0.005
    assert errors.max() < 0.05


def test_with_too_little_parallax_none_is() -> None:
    mapping = Mapping()
    mapping.insert(FIRST)
    mapping.insert(view(0.92, 0.9))  # 2 cm over 2 m is 0.6 deg
    assert len(mapping.errors()) == 0
    mapping.insert(view(1.05, 0.8))  # the first sight still counts
    assert len(mapping.errors()) > 40


def test_a_corner_that_went_astray_is_not_triangulated() -> None:
    mapping = Mapping()
    mapping.insert(FIRST)
    ids = mapping.tracker.ids[mapping.clear[mapping.tracker.ids]][:30]
    mapping.truth[ids] += [0.0, 0.0, 0.4]  # followed as if it were elsewhere ...
    along = FIRST.T_map_camera.translation - mapping.truth[ids]
    mapping.truth[ids] += np.cross(along, [0.1, 0.2, 0.0]) * 0.4  # ... and off the ray
    mapping.insert(view(1.05, 0.8))
    astray = ids[np.isin(ids, mapping.map.keyframes[1].ids)]
    assert len(astray) < len(ids) or not mapping.map.mapped(astray).any()
    assert mapping.map.mapped(ids).mean() < 0.2


def test_old_points_come_back_after_another_place() -> None:
    mapping = Mapping(replace_reuse(3))
    mapping.insert(FIRST, depth=True)
    old = mapping.tracker.ids.copy()
    mapping.insert(view(1.0, 0.85), depth=True)
    for x, y in [(-1.5, -1.4), (-1.55, -1.3), (-1.6, -1.2)]:
        mapping.insert(view(x, y), depth=True, follow=False)
    assert not np.isin(mapping.tracker.ids, old).any()
    back = view(0.95, 0.86, heading=0.05, seed=1)
    mapping.insert(back, depth=True, follow=False)
    again = old[np.isin(old, mapping.tracker.ids)]
    assert len(again) > 0.4 * len(old)
    newest = mapping.map.keyframes[-1]
    rows = np.isin(newest.ids, again)
    truth, _ = sees(back, mapping.truth[newest.ids[rows]])
    assert np.median(np.linalg.norm(newest.pixels[rows] - truth, axis=1)) < 0.4
    assert len(np.unique(newest.ids)) == len(newest.ids)
    # Beside an edge of depth, what is found again may belong to the other side.
    assert np.percentile(mapping.errors(), 90) < 0.01


def test_without_reuse_they_stay_away() -> None:
    mapping = Mapping(replace_reuse(0))
    for x, y in [(0.9, 0.9), (1.0, 0.85), (-1.5, -1.4), (-1.55, -1.3), (-1.6, -1.2), (0.95, 0.86)]:
        mapping.insert(view(x, y), depth=True, follow=False)
    assert mapping.map.keyframes[-1].ids.min() > mapping.map.keyframes[-2].ids.max()


def test_a_wrong_belief_of_where_it_is_brings_no_wrong_points_back() -> None:
    mapping = Mapping(replace_reuse(3))
    for x, y in [(0.9, 0.9), (1.0, 0.85), (-1.5, -1.4), (-1.55, -1.3), (-1.6, -1.2)]:
        mapping.insert(view(x, y), depth=True, follow=False)
    count = len(mapping.map)
    elsewhere = view(-1.5, -1.4, seed=2)
    lost = replace(elsewhere, T_map_camera=view(0.95, 0.86).T_map_camera)
    mapping.insert(lost, depth=True, follow=False)
    assert mapping.map.keyframes[-1].ids.min() >= count


def test_the_map_follows_no_more_corners_than_configured() -> None:
    mapping = Mapping()
    for x in (0.9, 0.95, 1.0, 1.05):
        mapping.insert(view(x, 0.9))
        assert len(mapping.tracker.ids) <= PARAMETERS.corners
        assert len(np.unique(mapping.tracker.ids)) == len(mapping.tracker.ids)


def replace_reuse(count: int) -> KeyframeSlam:
    return PARAMETERS.model_copy(update={"reused_keyframes": count})
