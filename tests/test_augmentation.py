"""The augmented map keeps every point's source and follows a better alignment."""

import numpy as np

from airground.augmentation import Augmentation
from airground.core.camera import PinholeCamera
from airground.core.cloud import PointCloud, Source
from airground.core.se3 import SE3
from airground.core.surface import AerialSurface

CAMERA = PinholeCamera(2, 2, 1.0, 1.0, 0.5, 0.5)


def cloud(points: list[list[float]], grey: int) -> PointCloud:
    return PointCloud(np.array(points, np.float32), np.full((len(points), 3), grey, np.uint8))


def surface(points: list[list[float]]) -> AerialSurface:
    depth = np.full((2, 2), np.nan, np.float32)
    return AerialSurface(1, 0, CAMERA, SE3.identity(), depth, cloud(points, 200), 3)


def test_without_an_alignment_the_map_is_the_ground_map() -> None:
    ground = cloud([[0, 0, 0], [1, 0, 0]], 10)
    augmented = Augmentation(0.02).map(ground)
    assert np.array_equal(augmented.cloud_ground.points, ground.points)
    assert (augmented.sources == Source.GROUND).all()


def test_points_know_their_source_and_follow_the_newest_alignment() -> None:
    augmentation = Augmentation(0.02)
    augmentation.add(surface([[0.51, 0.01, 0.01]]), SE3.from_heading(0.0, [5, 0, 0]))
    augmentation.add(surface([[0.71, 0.01, 0.01]]), SE3.from_heading(np.pi / 2, [1, 0, 0]))
    augmented = augmentation.map(cloud([[0, 0, 0]], 10))
    assert list(augmented.sources) == [Source.GROUND, Source.MAV, Source.MAV]
    aerial = augmented.cloud_ground.points[augmented.sources == Source.MAV]
    expected = [[0.99, 0.51, 0.01], [0.99, 0.71, 0.01]]
    assert np.allclose(aerial, expected, atol=1e-6)
    assert (augmented.cloud_ground.colours[augmented.sources == Source.MAV] == 200).all()
