"""Clear matches against OpenCV's brute force."""

import cv2
import numpy as np
import pytest

from evaluation.measure.baselines.feature_matching import RATIO, clear_matches


def by_opencv(aerial: np.ndarray, ground: np.ndarray) -> np.ndarray:
    matches = cv2.BFMatcher(cv2.NORM_L2).knnMatch(aerial, ground, k=2)
    pairs = [(a.queryIdx, a.trainIdx) for a, b in matches if a.distance < RATIO * b.distance]
    return np.array(pairs, np.int64).reshape(-1, 2)


def words(rng: np.random.Generator, count: int) -> np.ndarray:
    """Descriptors as SIFT makes them: whole numbers."""
    return rng.integers(0, 120, (count, 128)).astype(np.float32)


@pytest.mark.kernel
def test_the_same_pairs_as_by_brute_force() -> None:
    rng = np.random.default_rng(0)
    ground = words(rng, 300)
    # Of a third the like is there; of a third twice the same; the rest is like nothing.
    ground[200:] = ground[100:200]
    noise = rng.integers(-9, 10, (300, 128))
    aerial = np.concatenate([np.clip(ground + noise, 0, 255), words(rng, 250)]).astype("f4")
    pairs = clear_matches(aerial, ground)
    np.testing.assert_array_equal(pairs, by_opencv(aerial, ground))
    assert pairs[:, 0].tolist() == list(range(100))
    assert pairs[:, 1].tolist() == list(range(100))


@pytest.mark.parametrize(("aerial", "ground"), [(0, 5), (5, 0), (5, 1)])
def test_too_few_match_nothing(aerial: int, ground: int) -> None:
    rng = np.random.default_rng(0)
    assert clear_matches(words(rng, aerial), words(rng, ground)).shape == (0, 2)


def test_features_of_pictures_match_as_by_brute_force() -> None:
    rng = np.random.default_rng(1)
    coarse = rng.integers(0, 256, (30, 40)).astype(np.uint8)
    picture = cv2.resize(coarse, (320, 240), interpolation=cv2.INTER_CUBIC)
    turned = cv2.warpAffine(picture, cv2.getRotationMatrix2D((160, 120), 12, 0.9), (320, 240))
    described = [cv2.SIFT.create().detectAndCompute(one, None)[1] for one in (picture, turned)]
    pairs = clear_matches(*described)
    assert len(pairs) > 50
    np.testing.assert_array_equal(pairs, by_opencv(*described))
