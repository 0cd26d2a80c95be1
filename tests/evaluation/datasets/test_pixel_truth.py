"""Truth of every pixel: its modalities against each other, and its files as others read them."""

import csv
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from airground.core.se3 import SE3
from airground.errors import InputError, RecordingError
from evaluation.cli import answer
from evaluation.datasets.pixel_truth_files import (
    Wanted,
    count_images,
    flow_image,
    normals_image,
    parse_modalities,
    render_truth,
)
from evaluation.datasets.simulated import Simulated
from sim.geometry.parts import KINDS, Instances, Part, read_parts, write_parts
from sim.recording.pixel_truth import PixelTruth, flow, instance_ids, instances_of, pixel_truth
from sim.recording.row_poses import RowPoses
from sim.recording.truth import Truth
from sim.robots.motion import ROBOTS, Robot

ALL = "depth,normals,segmentation,flow"


def seen_by(simulated: Simulated, robot: Robot, index: int = 0) -> PixelTruth:
    return pixel_truth(simulated.truth, robot, simulated.stamps_ns(robot)[index])


@pytest.mark.parametrize("robot", ROBOTS)
def test_depth_is_that_of_the_evaluator(simulated: Simulated, robot: Robot) -> None:
    depth = seen_by(simulated, robot).depth
    expected = simulated.truth.depth(robot, simulated.stamps_ns(robot)[0])
    np.testing.assert_array_equal(depth, expected)
    assert np.isfinite(depth).mean() > 0.3


@pytest.mark.parametrize("robot", ROBOTS)
def test_normals_are_those_of_the_depth(simulated: Simulated, robot: Robot) -> None:
    seen = seen_by(simulated, robot)
    assert np.nanmax(np.abs(np.linalg.norm(seen.normals, axis=-1) - 1)) < 1e-5
    points = seen.lens.rays() * seen.depth.astype(np.float64)[..., None]
    assert np.nanmax(np.einsum("ijk,ijk->ij", points, seen.normals)) < 0
    # Both neighbours of a pixel on the same triangle lie in its plane.
    same = seen.triangle[1:-1, 1:-1] >= 0
    for row, column in ((0, 1), (2, 1), (1, 0), (1, 2)):
        neighbour = seen.triangle[row : row + same.shape[0], column : column + same.shape[1]]
        same &= neighbour == seen.triangle[1:-1, 1:-1]
    across = points[1:-1, 2:] - points[1:-1, :-2]
    down = points[2:, 1:-1] - points[:-2, 1:-1]
    from_depth = np.cross(down, across)
    from_depth /= np.linalg.norm(from_depth, axis=-1, keepdims=True)
    agreement = np.einsum("ijk,ijk->ij", from_depth, seen.normals[1:-1, 1:-1])
    assert same.mean() > 0.2
    assert agreement[same].min() > np.cos(np.radians(1.0))


def test_normals_face_a_camera_behind_a_surface_too(
    simulated: Simulated, monkeypatch: pytest.MonkeyPatch
) -> None:
    below = SE3(np.eye(3), np.array([0.0, 0.0, -1.0]))  # looks up at the floor's back
    monkeypatch.setattr(Truth, "row_poses", lambda *_: RowPoses.same(below, 480))
    seen = seen_by(simulated, "mav")
    floor = seen.normals[np.isfinite(seen.depth)]
    assert len(floor) > 100_000
    # But for rays that meet the edge of a box that stands on the floor.
    assert (floor[:, 2] < -0.999999).mean() > 0.9999


def test_things_are_where_the_list_of_boxes_says(simulated: Simulated) -> None:
    seen, instances = seen_by(simulated, "mav"), instances_of(simulated.truth, "mav")
    ids, points = instance_ids(seen, instances), seen.points_world()
    assert instances.names == ["floor", "box_000", "box_001"]
    with (simulated.truth.folder / "boxes.csv").open() as file:
        boxes = {row["name"]: row for row in csv.DictReader(file)}
    shown = 0
    for index, name in enumerate(instances.names[1:], start=2):
        box = boxes[name]
        centre = np.array([float(box[f"t{axis} [m]"]) for axis in "xyz"])
        reach = np.linalg.norm([float(box[f"s{axis} [m]"]) for axis in "xyz"]) / 2
        apart = np.linalg.norm(points - centre, axis=-1)
        assert (apart[ids == index] < reach + 1e-4).all()
        shown += int((ids == index).sum())
    assert shown > 1000
    assert np.nanmax(np.abs(points[ids == 1][:, 2])) < 1e-4
    assert ((ids == 0) == np.isnan(seen.depth)).all()
    np.testing.assert_array_equal(instances.class_ids(), [0, 1, 3, 3])


@pytest.mark.parametrize("robot", ROBOTS)
def test_flow_carries_depth_to_the_next_image(simulated: Simulated, robot: Robot) -> None:
    seen, other = seen_by(simulated, robot, 5), seen_by(simulated, robot, 10)
    stamp = simulated.stamps_ns(robot)[10]
    moved = flow(simulated.truth, robot, seen, stamp)
    rows, columns = np.nonzero(moved.visible)
    assert len(rows) > 10_000
    to = moved.flow_px[rows, columns] + np.stack([columns, rows], axis=1)
    pose = simulated.truth.T_world_camera(robot, stamp)
    places = pose.inverse() @ seen.points_world()[rows, columns]
    # Interpolate along rays, where 1 / depth of a plane is linear in the image.
    inverse = map_coordinates(1 / other.depth, to[:, ::-1].T, order=1, cval=np.nan)
    error = np.abs(inverse * places[:, 2] - 1)
    assert np.nanquantile(error, 0.97) < 1e-3  # the rest are at the edges of things
    hidden = np.isfinite(moved.flow_px[..., 0]) & ~moved.visible
    assert hidden.any()


def test_flow_to_the_same_image_is_nothing(simulated: Simulated) -> None:
    seen = seen_by(simulated, "mav", 3)
    same = flow(simulated.truth, "mav", seen, simulated.stamps_ns("mav")[3])
    known = np.isfinite(seen.depth)
    assert np.abs(same.flow_px[known]).max() < 1e-3
    assert same.visible[known].mean() > 0.999


def test_others_read_the_files(simulated: Simulated, tmp_path: Path) -> None:
    wanted = Wanted(("mav",), parse_modalities(ALL), every=10)
    rendered: list[int] = []
    render_truth(simulated, wanted, tmp_path, 2, lambda: rendered.append(1))
    assert len(rendered) == count_images(simulated, wanted) == 3
    stamps = simulated.stamps_ns("mav")
    seen = seen_by(simulated, "mav", 10)

    def image(folder: str, suffix: str = "png") -> np.ndarray:
        path = tmp_path / f"mav_{folder}/{stamps[10]}.{suffix}"
        return cv2.imread(str(path), cv2.IMREAD_UNCHANGED)

    np.testing.assert_array_equal(image("depth", "tif"), seen.depth)
    normals = (image("normals")[..., ::-1].astype(float) - 32768) / 32767
    known = np.isfinite(seen.depth)
    np.testing.assert_allclose(normals[known], seen.normals[known], atol=2e-5)
    assert (image("normals")[~known] == 0).all()
    instances = instances_of(simulated.truth, "mav")
    ids = image("segmentation/instance")
    assert ids.dtype == np.uint16
    np.testing.assert_array_equal(ids, instance_ids(seen, instances))
    with (tmp_path / "mav_segmentation/instances.csv").open() as file:
        table = {int(row["instance"]): row for row in csv.DictReader(file)}
    for index, row in table.items():
        assert (image("segmentation/class")[ids == index] == int(row["class_id"])).all()
        assert KINDS[int(row["class_id"]) - 1] == row["class"]
    moved = flow(simulated.truth, "mav", seen, stamps[11])
    valid, v, u = np.moveaxis(image("flow/flow_noc").astype(float), -1, 0)
    np.testing.assert_array_equal(valid > 0, moved.visible)
    decoded = np.stack([(u - 32768) / 64, (v - 32768) / 64], axis=-1)
    assert np.abs(decoded - moved.flow_px)[moved.visible].max() <= 1 / 128 + 1e-5
    # There is no next image after the last one.
    assert len(list((tmp_path / "mav_flow/flow_occ").iterdir())) == 2


def test_the_same_bytes_with_any_number_of_threads(simulated: Simulated, tmp_path: Path) -> None:
    wanted = Wanted(("ground",), parse_modalities(ALL), every=20)
    contents = []
    for workers in (1, 3):
        out = tmp_path / str(workers)
        render_truth(simulated, wanted, out, workers, lambda: None)
        files = sorted(path for path in out.rglob("*") if path.is_file())
        contents.append({path.relative_to(out): path.read_bytes() for path in files})
    assert contents[0] == contents[1]
    assert len(contents[0]) == 2 * 4 + 2 + 1


def test_a_folder_that_exists_is_refused_and_nothing_is_left(
    simulated: Simulated, tmp_path: Path
) -> None:
    (tmp_path / "mav_normals").mkdir()
    wanted = Wanted(("mav",), ("depth", "normals"))
    with pytest.raises(InputError, match="mav_normals"):
        render_truth(simulated, wanted, tmp_path, 1, lambda: None)
    assert [path.name for path in tmp_path.iterdir()] == ["mav_normals"]


@pytest.mark.parametrize(
    ("words", "said"),
    [("colour", "--add colour: unknown"), ("", "--add : unknown"), ("depth,,flow", "unknown")],
)
def test_unknown_truth_is_refused(words: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        parse_modalities(words)


def test_the_order_of_words_does_not_matter() -> None:
    assert parse_modalities("flow, depth,depth") == ("depth", "flow")


def test_flow_that_does_not_fit_is_not_valid() -> None:
    flow_px = np.array([[[600.0, 0.0], [511.0, -511.0], [np.nan, np.nan]]], np.float32)
    image = flow_image(flow_px, np.isfinite(flow_px[..., 0]))
    np.testing.assert_array_equal(image[0], [[0, 0, 0], [1, 64, 65472], [0, 0, 0]])


def test_normals_where_there_is_nothing_are_zero() -> None:
    normals = np.array([[[0, 0, -1], [np.nan] * 3]], np.float32)
    np.testing.assert_array_equal(normals_image(normals)[0], [[1, 32768, 32768], [0, 0, 0]])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "columns"),
        ("name,class,triangles\nfloor,lava,2\n", "parts.csv:2"),
        ("name,class,triangles\nfloor,ground,0\n", "above 0"),
        ("name,class,triangles\nfloor,ground\n", "parts.csv:2"),
    ],
)
def test_a_wrong_list_of_parts_is_refused(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "parts.csv"
    path.write_text(text)
    with pytest.raises(RecordingError, match=said):
        read_parts(path)


def test_parts_come_back(tmp_path: Path) -> None:
    parts = [Part("floor", "ground", 2), Part("plant_0", "plant", 6), Part("plant_0", "plant", 6)]
    write_parts(tmp_path / "parts.csv", parts)
    assert read_parts(tmp_path / "parts.csv") == parts
    instances = Instances.of(parts)
    assert instances.names == ["floor", "plant_0"]
    np.testing.assert_array_equal(np.bincount(instances.of_triangle), [0, 2, 12])


def test_a_recording_without_parts_says_so(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="older versions"):
        read_parts(tmp_path / "parts.csv")


def test_the_verb_writes_beside_the_truth(small: Path, tmp_path: Path) -> None:
    words = ["render", str(small), "--add", "depth", "--robot", "ground", "--every", "30"]
    assert answer([*words, "--out", str(tmp_path)]) in (None, 0)
    assert len(list((tmp_path / "ground_depth").iterdir())) == 1
