"""Bodies that move and the MAV's shadow: images and truth agree on what was where, and when."""

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.errors import InputError
from airground.io.recording import Recording
from sim.geometry.body_shapes import body_mesh, body_pieces
from sim.recording import recorder
from sim.recording.drone_shadow import DISC_M, DroneShadow
from sim.recording.pixel_truth import flow, instance_ids, instances_of, pixel_truth
from sim.recording.recorder import record
from sim.recording.truth import Truth
from sim.robots.motion import ROBOTS, Robot
from sim.scene import Light, Scene, parse_scene
from sim.sensors.presets import NONE
from sim.world.world import build_world
from tests.sim.small_flight import SCENE, few_stamps, unpainted

BODIES = """
[[bodies]]
name = "walker"
speed_mps = 0.4
waypoints = [[-0.6, 0.7], [0.4, 0.7]]
[[bodies]]
name = "rover"
shape = "robot"
speed_mps = 0.5
waypoints = [[-0.2, -1.0], [-0.2, 0.6]]
"""


def moving() -> Scene:
    return parse_scene(SCENE + "visible = true\n" + BODIES, "small.toml")


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recorder, "image_stamps", few_stamps)
        patch.setattr(recorder, "painted", unpainted)
        out = tmp_path_factory.mktemp("moving") / "recording"
        yield record(moving(), 3, NONE, out, workers=1)


def stamps(recording: Path, robot: Robot) -> list[int]:
    opened = Recording.open(recording)
    return [int(s) for s in (opened.mav if robot == "mav" else opened.ground).camera_stamps]


def seen_names(truth: Truth, robot: Robot, stamp: int) -> set[str]:
    instances = instances_of(truth, robot)
    ids = instance_ids(pixel_truth(truth, robot, stamp), instances)
    return {instances.names[k - 1] for k in np.unique(ids) if k}


def test_depth_by_rays_against_the_bodies_is_what_is_drawn(recorded: Path) -> None:
    """The ground robot's depth images have no faults here, and show the bodies."""
    truth, recording = Truth.open(recorded), Recording.open(recorded)
    on_bodies = 0
    for index, stamp in enumerate(stamps(recorded, "ground")):
        drawn = recording.ground.read_image(index).depth
        seen = pixel_truth(truth, "ground", stamp)
        both = np.isfinite(seen.depth) & np.isfinite(drawn) & (drawn > 0)
        body = both & (seen.triangle >= len(truth.surface("ground").mesh.triangles))
        on_bodies += int(body.sum())
        assert np.quantile(np.abs(seen.depth - drawn)[body], 0.97) < 2e-3
        np.testing.assert_array_equal(truth.depth("ground", stamp), seen.depth)
    assert on_bodies > 3000


def test_each_robot_sees_the_bodies_that_it_should(recorded: Path) -> None:
    truth = Truth.open(recorded)
    seen = {
        robot: set().union(*(seen_names(truth, robot, s) for s in stamps(recorded, robot)))
        for robot in ROBOTS
    }
    assert {"walker", "rover"} <= seen["ground"]
    assert "ground_robot" not in seen["ground"]
    assert {"rover", "ground_robot"} <= seen["mav"]
    names = [instances_of(truth, robot).names for robot in ROBOTS]
    assert names[0] == names[1]


def test_bodies_keep_to_their_paths(recorded: Path) -> None:
    truth = Truth.open(recorded)
    with (truth.folder / "bodies.csv").open() as file:
        assert [row["name"] for row in csv.DictReader(file)] == ["walker", "rover", "ground_robot"]
    walker, rover, robot = truth.bodies.bodies
    assert walker.pose(0).translation == pytest.approx([-0.6, 0.7, 0], abs=1e-6)
    assert walker.pose(10**10).translation == pytest.approx([0.4, 0.7, 0], abs=1e-3)
    assert walker.pose(10**9).rotation == pytest.approx(np.eye(3), abs=1e-6)
    assert rover.pose(2 * 10**9).rotation[:, 0] == pytest.approx([0, 1, 0], abs=1e-6)
    steps = np.linalg.norm(np.diff(walker.path.translations, axis=0), axis=1)
    assert steps.max() / 0.02 == pytest.approx(0.4, rel=0.02)
    true = truth.motion.pose("ground", 1_500_000_000)
    assert robot.pose(1_500_000_000).translation == pytest.approx(true.translation, abs=1e-4)


def test_flow_carries_a_body_along(recorded: Path) -> None:
    """Where the flow of a body's pixel leads, the next image shows that body, at that depth."""
    truth = Truth.open(recorded)
    first, second = stamps(recorded, "ground")[1], stamps(recorded, "ground")[1] + 200_000_000
    seen, then = (pixel_truth(truth, "ground", stamp) for stamp in (first, second))
    still = len(truth.surface("ground").mesh.triangles)
    moved = flow(truth, "ground", seen, second)
    rows, columns = np.nonzero((seen.triangle >= still) & moved.visible)
    target = np.stack([columns, rows], 1) + moved.flow_px[rows, columns]
    column, row = np.rint(target).astype(int).T
    inside = (row >= 0) & (row < 480) & (column >= 0) & (column < 640)
    arrived = then.triangle[row[inside], column[inside]]
    assert inside.sum() > 1000
    assert np.mean(arrived == seen.triangle[rows, columns][inside]) > 0.8
    assert np.median(np.linalg.norm(moved.flow_px[rows, columns], axis=1)) > 1


def test_bodies_are_in_no_recording_without_them() -> None:
    scene = parse_scene(SCENE, "small.toml")
    assert not scene.bodies
    assert not scene.ground.visible
    assert not scene.mav.shadow


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"rover"', '"walker"', r"two bodies are named 'walker'"),
        ("[0.4, 0.7]", "[9.4, 0.7]", r"waypoint \[9\.4, 0\.7\] lies outside room\.size_m"),
        ('shape = "robot"', 'shape = "cow"', r"bodies\.1\.shape = 'cow'"),
        ("speed_mps = 0.4", "sped = 1", r"unknown key 'bodies\.0\.sped'; known here are name"),
    ],
)
def test_a_mistake_is_one_line(tmp_path: Path, old: str, new: str, message: str) -> None:
    text = SCENE + BODIES
    assert old in text
    with pytest.raises(InputError, match=message):
        record(parse_scene(text.replace(old, new), "small.toml"), 3, NONE, tmp_path / "out")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("shape", ["person", "robot"])
def test_shapes_are_closed_and_face_outward(shape: str) -> None:
    """Every side is run through in both directions, and the volume is positive."""
    for piece in body_pieces(shape):
        vertices, triangles = piece.mesh
        sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
        there, back = ({tuple(side) for side in s} for s in (sides, sides[:, ::-1]))
        assert there == back
        corners = vertices[triangles]
        assert np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) > 0
    vertices, _ = body_mesh(body_pieces(shape))
    assert vertices[:, 2].min() == pytest.approx(0, abs=1e-9)
    assert vertices[:, 2].max() == pytest.approx({"person": 1.75, "robot": 0.8}[shape])


@pytest.mark.parametrize(
    ("light", "middle"),
    [
        (Light(azimuth_deg=90, elevation_deg=60, radius_deg=0.5), (0.2, -2 / np.tan(np.pi / 3))),
        (Light(lamp_m=(0.2, 1.0, 4.0), radius_deg=0.5), (0.2, -1.0)),
    ],
)
def test_the_shadow_lies_where_the_light_meets_the_mav(
    light: Light, middle: tuple[float, float]
) -> None:
    """The MAV hovers at (0.2, 0, 2); the camera looks straight down on a white floor."""
    camera = PinholeCamera(400, 400, 200.0, 200.0, 199.5, 199.5)
    down = SE3(np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, -1]]), np.array([0.0, 0.0, 4.0]))
    picture = np.full((400, 400, 1), 200, np.uint8)
    depth = np.full((400, 400), 4.0, np.float32)
    mav = np.array([0.2, 0.0, 2.0])
    shaded = DroneShadow(light).cast(picture, depth, camera, down, mav)[..., 0]
    rows, columns = np.nonzero(shaded < 190)
    x, y = (columns - 199.5) / 50, -(rows - 199.5) / 50
    assert (x.mean(), y.mean()) == pytest.approx(middle, abs=0.02)
    scale = 2.0 if light.lamp_m else 1.0
    assert (x.max() - x.min()) / 2 == pytest.approx(scale * DISC_M, abs=0.05)
    direct = light.main / (light.main + light.fill + light.ambient)
    assert shaded.min() == pytest.approx(200 * (1 - direct) ** (1 / 2.2), abs=1)
    assert np.mean(shaded == 200) > 0.9


def test_a_larger_lamp_throws_a_softer_shadow() -> None:
    camera = PinholeCamera(400, 400, 200.0, 200.0, 199.5, 199.5)
    down = SE3(np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, -1]]), np.array([0.0, 0.0, 4.0]))
    picture = np.full((400, 400, 1), 200, np.uint8)
    depth = np.full((400, 400), 4.0, np.float32)
    darkest, wide = [], []
    for radius in (1.0, 20.0):
        light = Light(elevation_deg=90, radius_deg=radius)
        shaded = DroneShadow(light).cast(picture, depth, camera, down, np.array([0.0, 0, 2]))
        darkest.append(int(shaded.min()))
        wide.append(int((shaded < 200).sum()))
    assert darkest[1] > darkest[0] + 20
    assert wide[1] > 3 * wide[0]


def test_nothing_in_the_world_of_bodies_changes_the_still_world() -> None:
    plain = build_world(parse_scene(SCENE, "small.toml"), 3, pictures=False)
    with_bodies = build_world(moving(), 3, pictures=False)
    assert plain.vertices.tobytes() == with_bodies.vertices.tobytes()
    assert plain.parts == with_bodies.parts
