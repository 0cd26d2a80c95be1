"""A heap that changes: the share that is asked for, nothing else, and no box inside another."""

from dataclasses import replace

import numpy as np
import pytest

from airground.core.se3 import SE3
from sim.geometry.box import Box
from sim.geometry.changes import KINDS, LEAST_SHIFT_M, LEAST_TURN_DEG, boxes_after, change_heap
from sim.geometry.lane import distance_to_footprint, lane_points
from sim.geometry.rubble import make_heap
from sim.scene import MAX_HEAP_HEIGHT_M, Scene, load_scene
from sim.world.world import World, build_world, flight_world

SHARES = [0.25, 0.5]


def changing(name: str, share: float) -> Scene:
    scene = load_scene(name)
    return scene.model_copy(update={"rubble": scene.rubble.model_copy(update={"changed": share})})


@pytest.fixture(scope="module", params=["tiny", "indoor_b"])
def drive(request: pytest.FixtureRequest) -> World:
    return build_world(load_scene(request.param), 0, pictures=False)


def changed(drive: World, share: float) -> World:
    scene = changing(drive.scene.name, share)
    return flight_world(replace(drive, scene=scene), pictures=False)


def poses(boxes: tuple[Box, ...]) -> dict[str, bytes]:
    return {box.name: box.T_world_box.matrix().tobytes() for box in boxes}


@pytest.mark.parametrize("share", SHARES)
def test_just_the_share_that_is_asked_for_has_changed(drive: World, share: float) -> None:
    flight = changed(drive, share)
    names = {change.before.name for change in flight.changes}
    assert len(names) == len(flight.changes) == round(share * len(drive.boxes))
    before, after = poses(drive.boxes), poses(flight.boxes)
    assert {name for name in before if before[name] != after.get(name)} == names
    assert {change.kind for change in flight.changes} == set(KINDS)
    for change in flight.changes:
        assert (
            (change.after is None) == (change.kind == "gone") == (change.before.name not in after)
        )
        if change.after is not None:
            assert after[change.before.name] == change.after.T_world_box.matrix().tobytes()
            motion = change.before.T_world_box.inverse() @ change.after.T_world_box
            shift = change.after.T_world_box.translation - change.before.T_world_box.translation
            turn_deg = np.rad2deg(motion.angle())
            assert np.linalg.norm(shift) >= LEAST_SHIFT_M or turn_deg >= LEAST_TURN_DEG
            assert (change.after.size_m == change.before.size_m).all()


def test_a_changed_heap_keeps_the_rules_of_a_heap(drive: World) -> None:
    """Points well inside one box lie in no other, and the ground robot's lane is free."""
    flight = changed(drive, 0.5)
    grid = np.stack(np.meshgrid(*[np.linspace(-0.48, 0.48, 9)] * 3), -1).reshape(-1, 3)
    lane = lane_points(drive.scene)
    moved = [change.after for change in flight.changes if change.after is not None]
    assert moved
    for a in moved:
        corners = a.corners()
        assert corners[:, 2].max() < MAX_HEAP_HEIGHT_M
        assert corners[:, 2].min() > -0.01
        assert distance_to_footprint(lane, corners) >= drive.scene.rubble.clearance_m
        points = a.T_world_box @ (grid * (a.size_m - 0.01))
        for b in flight.boxes:
            if b is not a:
                inside = np.abs(b.T_world_box.inverse() @ points) < b.size_m / 2 - 0.005
                assert not inside.all(axis=1).any(), (a.name, b.name)


def test_no_box_that_stays_loses_what_it_lies_on(drive: World) -> None:
    """Where a changed box was, nothing that stays hangs in the air above it."""
    flight = changed(drive, 0.5)
    kept = set(poses(drive.boxes)) - {change.before.name for change in flight.changes}
    just_above = SE3(np.eye(3), np.array([0, 0, 0.004]))
    for change in flight.changes:
        box = change.before
        for other in drive.boxes:
            if other.name in kept:
                raised = just_above @ box.T_world_box
                points = raised @ (np.array([[0, 0, 1.0], [0, 0, -1.0]]) * box.size_m / 2)
                top = points[np.argmax(points[:, 2])]
                inside = np.abs(other.T_world_box.inverse() @ top) < other.size_m / 2 - 0.004
                lower = other.T_world_box.translation[2] < box.T_world_box.translation[2]
                assert lower or not inside.all()


def test_a_larger_share_changes_the_same_boxes_and_more(drive: World) -> None:
    few, many = (
        {change.before.name for change in changed(drive, share).changes} for share in SHARES
    )
    assert few < many


def test_the_same_seed_gives_the_same_changes() -> None:
    scene = changing("tiny", 0.3)
    boxes = make_heap(scene, np.random.default_rng(2))
    first, again, other = (
        poses(boxes_after(boxes, change_heap(scene, boxes, np.random.default_rng(seed))))
        for seed in (7, 7, 8)
    )
    assert first == again != other


def test_without_changes_both_robots_see_one_world(drive: World) -> None:
    assert flight_world(drive, pictures=False) is drive
    terrain = build_world(load_scene("outdoor"), 0, pictures=False)
    assert flight_world(terrain, pictures=False) is terrain


def test_a_box_keeps_its_pictures_wherever_it_goes() -> None:
    """In even light, pictures do not depend on the place."""
    scene = changing("tiny", 0.5)
    dark = scene.light.model_copy(update={"main": 0.0, "fill": 0.0, "ambient": 0.5})
    rubble = scene.rubble.model_copy(update={"boxes": 6, "area_m": (2.4, 2.0)})
    room = scene.room.model_copy(update={"size_m": (4.8, 3.0), "wall_height_m": 0.0})
    scene = scene.model_copy(update={"rubble": rubble, "room": room, "light": dark})
    drive = build_world(scene, 1)
    flight = flight_world(drive)
    here = {box.name for box in flight.boxes}
    assert here < {box.name for box in drive.boxes}
    for name in here:
        one, other = (
            np.frombuffer(world.spec.texture(name).data, np.uint8).astype(float)
            for world in (drive, flight)
        )
        assert np.corrcoef(one, other)[0, 1] > 0.8
