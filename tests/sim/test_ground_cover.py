"""Small stones and plants: on the ground, facing outward, and part of the world."""

from __future__ import annotations

import numpy as np
import pytest

from sim.geometry.ground_cover import LEAVES, GroundCover, grow_cover, patch_normals
from sim.geometry.rocks import scatter_rocks
from sim.geometry.surface import rectangle_mesh
from sim.geometry.terrain import HeightField, make_terrain
from sim.scene import Scene, Terrain, load_scene
from sim.world.world import build_world

SIZE_M = (4.0, 4.0)


def flat_ground() -> HeightField:
    return HeightField(np.zeros((5, 5)), np.array(SIZE_M))


def cover_of(stones: float, plants: float, seed: int = 0) -> GroundCover:
    terrain = Terrain(area_m=(1.0, 1.0), stones_per_m2=stones, plants_per_m2=plants)
    return grow_cover(terrain, flat_ground(), [], np.random.default_rng(seed))


def outdoor(**changes: object) -> Scene:
    scene = load_scene("outdoor")
    assert scene.terrain is not None
    return scene.model_copy(update={"terrain": scene.terrain.model_copy(update=changes)})


def test_there_are_as_many_as_asked_for() -> None:
    cover = cover_of(50, 10)
    assert len(cover.stones) == 200  # 1 m and 0.5 m on either side: 4 m^2
    assert len(cover.leaves) == 40 * LEAVES


def test_stones_stand_out_of_the_ground_and_their_rims_lie_in_it() -> None:
    stones = cover_of(100, 0).stones
    rims = np.concatenate([stones[:, 0], stones[:, -1], stones[:, :, 0], stones[:, :, -1]], axis=1)
    assert rims[..., 2].max() < 0
    tops = stones[..., 2].max(axis=(1, 2))
    assert np.mean(tops > 0.003) > 0.95
    assert tops.max() < 0.09


def test_stones_and_leaves_face_up_and_undersides_down() -> None:
    stones, leaves, undersides = cover_of(100, 20).patches()
    assert (patch_normals(stones)[:, 1:-1, 1:-1, 2] > 0).mean() > 0.9
    assert (patch_normals(leaves)[..., 2] > 0).all()
    assert (patch_normals(undersides)[..., 2] < 0).all()


def test_grass_stands_up_in_narrow_blades_and_counts_as_plants() -> None:
    terrain = Terrain(area_m=(1.0, 1.0), grass_per_m2=50)
    cover = grow_cover(terrain, flat_ground(), [], np.random.default_rng(0))
    assert len(cover.leaves) == 200 * LEAVES
    roots, tips = cover.leaves[:, :, 0].mean(1), cover.leaves[:, :, -1].mean(1)
    np.testing.assert_allclose(roots[:, 2], 0, atol=1e-6)
    assert 0.03 < tips[:, 2].min() < tips[:, 2].max() < 0.35
    rise = (tips - roots)[:, 2] / np.linalg.norm((tips - roots)[:, :2], axis=1)
    assert np.median(rise) > 1
    widths = np.linalg.norm(cover.leaves[:, 0] - cover.leaves[:, 1], axis=-1)
    assert 0.0005 < widths.min() < widths.max() < 0.02
    assert len({part.name for part in cover.parts()}) == 200


def test_grass_leaves_stones_and_plants_as_they_are() -> None:
    terrain = Terrain(area_m=(1.0, 1.0), stones_per_m2=20, plants_per_m2=5)
    grown = terrain.model_copy(update={"grass_per_m2": 10.0})
    plain, grassy = (
        grow_cover(one, flat_ground(), [], np.random.default_rng(1)) for one in (terrain, grown)
    )
    np.testing.assert_array_equal(plain.stones, grassy.stones)
    np.testing.assert_array_equal(plain.leaves, grassy.leaves[: len(plain.leaves)])
    assert grown.covered
    assert not Terrain().covered


def test_plants_grow_on_rocks_and_stones_lie_beneath_them() -> None:
    terrain = Terrain(area_m=(1.0, 1.0), stones_per_m2=50, plants_per_m2=50)
    table = rectangle_mesh(np.array([-2.0, -2, 0.5]), np.array([4.0, 0, 0]), np.array([0, 4.0, 0]))
    cover = grow_cover(terrain, flat_ground(), [table], np.random.default_rng(0))
    np.testing.assert_allclose(cover.leaves[:, :, 0, 2], 0.5, atol=1e-5)
    assert cover.stones[..., 2].max() < 0.1


def test_the_mesh_has_every_patch() -> None:
    cover = cover_of(10, 5)
    vertices, triangles = cover.mesh()
    assert len(vertices) == sum(patches[..., 0].size for patches in cover.patches())
    assert triangles.max() == len(vertices) - 1


def test_without_any_nothing_changes() -> None:
    plain = build_world(load_scene("outdoor"), 3, pictures=False)
    covered = build_world(outdoor(stones_per_m2=20.0), 3, pictures=False)
    count = len(plain.vertices)
    np.testing.assert_array_equal(covered.vertices[:count], plain.vertices)
    assert len(covered.vertices) > count
    assert [geom.name for geom in plain.spec.geoms][-1] != "cover"


@pytest.mark.parametrize("clods_m", [0.02, 0.06])
def test_clods_are_as_high_as_asked_for(clods_m: float) -> None:
    smooth, rough = (
        make_terrain(SIZE_M, 0.3, height, np.random.default_rng(1)) for height in (0.0, clods_m)
    )
    x, y = np.random.default_rng(2).uniform(-1.9, 1.9, (2, 2000))
    assert len(rough.heights) > len(smooth.heights)
    steps = rough.at(x, y) - rough.at(x + 0.05, y)
    # Over 5 cm clods of 10 to 16 cm change about as much as they are high.
    assert 0.3 * clods_m < np.std(steps) < 1.2 * clods_m


def test_rough_rocks_lie_where_smooth_ones_do() -> None:
    ground = HeightField(np.zeros((5, 5)), np.array([10.0, 10.0]))
    smooth, rough = (
        scatter_rocks(outdoor(rock_roughness_m=height), ground, np.random.default_rng(4))
        for height in (0.0, 0.01)
    )
    assert [rock.diameter_m for rock in smooth][:20] == [rock.diameter_m for rock in rough][:20]
    shift = np.linalg.norm(smooth[0].vertices - rough[0].vertices, axis=-1)
    assert 0.003 < np.sqrt(np.mean(shift**2)) < 0.03
