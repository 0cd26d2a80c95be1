"""Shards are read back by WebDataset, and their description by Croissant's own library."""

from __future__ import annotations

import io
import json
import tarfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import mlcroissant
import numpy as np
import pytest
import webdataset
import yaml
from mlcroissant._src.operation_graph.operations import extract

from airground.core.cloud import Source
from airground.io.digests import file_digest
from evaluation.datasets import webdataset as shards
from evaluation.datasets.formats import FORMATS
from evaluation.datasets.simulated import Simulated
from evaluation.datasets.webdataset import write_webdataset
from sim.robots.motion import ROBOTS


@pytest.fixture(scope="module")
def folder(exported: Callable[[str], Path]) -> Path:
    return exported("webdataset")


def read_back(files: list[Path]) -> list[dict[str, Any]]:
    """Samples as WebDataset gives them."""
    return list(webdataset.WebDataset([str(file) for file in files], shardshuffle=False))


def decoded(data: bytes) -> np.ndarray:
    return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)


def test_images_and_poses_come_back(folder: Path, simulated: Simulated) -> None:
    for robot in ROBOTS:
        samples = read_back(sorted((folder / "data").glob(f"{robot}-*.tar")))
        facts = [json.loads(sample["json"]) for sample in samples]
        assert [one["stamp_ns"] for one in facts] == simulated.stamps_ns(robot)
        for index, (sample, one) in enumerate(zip(samples, facts, strict=True)):
            T_world_camera = simulated.truth.T_world_camera(robot, one["stamp_ns"])
            np.testing.assert_array_equal(one["T_world_camera"], T_world_camera.matrix())
            image = simulated.sensed(robot).read_image(index)
            if robot == "mav":
                np.testing.assert_array_equal(decoded(sample["grey.png"]), image.image)
            else:
                colour = decoded(sample["colour.png"])[..., ::-1]
                np.testing.assert_array_equal(colour, image.colour)
                seen = np.isfinite(image.depth)
                depth = decoded(sample["depth.png"])
                assert ((depth > 0) == seen).all()
                # Nominal and true scale differ by the preset's calibration error.
                ratio = depth[seen] / one["depth_units_per_m"] / image.depth[seen]
                assert np.abs(ratio - 1).max() < 0.005
                assert one["depth_delay_ns"] == 0


def test_a_shard_is_closed_when_it_is_full(
    simulated: Simulated, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each holds as much as fits, and nothing is lost or written twice."""
    limit = 2_000_000
    monkeypatch.setattr(shards, "SHARD_BYTES", limit)
    write_webdataset(tmp_path, simulated, ("ground",))
    files = sorted((tmp_path / "data").iterdir())
    assert len(files) > 2
    counts = [len(read_back([file])) for file in files]
    assert sum(counts) == len(simulated.stamps_ns("ground"))
    for file, count in zip(files, counts, strict=True):
        assert count == 1 or file.stat().st_size <= limit + tarfile.RECORDSIZE


def test_one_image_too_large_for_a_shard_has_its_own(
    simulated: Simulated, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shards, "SHARD_BYTES", 1)
    write_webdataset(tmp_path, simulated, ("mav",))
    assert len(list((tmp_path / "data").iterdir())) == len(simulated.stamps_ns("mav"))


def test_the_same_recording_gives_the_same_bytes(
    folder: Path, simulated: Simulated, tmp_path: Path
) -> None:
    FORMATS["webdataset"].write(tmp_path, simulated, ROBOTS)
    for file in folder.rglob("*"):
        if file.is_file():
            assert file_digest(file) == file_digest(tmp_path / file.relative_to(folder))


def test_croissant_reads_every_file(
    folder: Path, simulated: Simulated, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Not in the user's cache.
    monkeypatch.setattr(extract, "EXTRACT_PATH", extract.epath.Path(tmp_path))
    dataset = mlcroissant.Dataset(jsonld=folder / "croissant.json")
    assert not dataset.metadata.ctx.issues.errors
    for index, record in enumerate(dataset.records("mav_grey")):
        image = simulated.recording.of(Source.MAV).read_image(index).image
        np.testing.assert_array_equal(np.asarray(record["mav_grey/content"]), image)
    assert index == len(simulated.stamps_ns("mav")) - 1
    records = list(dataset.records("ground_json"))
    facts = [json.loads(record["ground_json/content"]) for record in records]
    assert [one["stamp_ns"] for one in facts] == simulated.stamps_ns("ground")


def test_every_shard_is_described_with_its_digest(folder: Path) -> None:
    said = json.loads((folder / "croissant.json").read_text())
    objects = [one for one in said["distribution"] if one["@type"] == "cr:FileObject"]
    for one in objects:
        assert one["sha256"] == file_digest(folder / one["contentUrl"])
        assert one["contentSize"] == f"{(folder / one['contentUrl']).stat().st_size} B"


def test_the_card_names_each_robots_shards(folder: Path) -> None:
    _, head, text = (folder / "README.md").read_text().split("---\n", 2)
    configs = yaml.safe_load(io.StringIO(head))["configs"]
    assert [one["config_name"] for one in configs] == list(ROBOTS)
    for one in configs:
        (files,) = one["data_files"]
        assert list(folder.glob(files["path"]))
    assert "21 of the mav, 21 of the ground" in text
