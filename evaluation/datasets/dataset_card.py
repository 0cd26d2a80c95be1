"""What describes shards to Hugging Face (`README.md`) and to Croissant's readers."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from airground import __version__
from airground.io.digests import file_digest
from airground.io.header import Header
from evaluation.setup.text import markdown_text
from sim.robots.motion import Robot

CROISSANT = "http://mlcommons.org/croissant/"
_TERMS = (
    "citeAs column equivalentProperty extract field fileObject fileProperty fileSet format "
    "includes isLiveDataset jsonPath key md5 parentField path recordSet references regex repeated "
    "replace samplingRate separator source subField transform"
)
CONTEXT: dict[str, Any] = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "cr": CROISSANT,
    "rai": f"{CROISSANT}RAI/",
    "sc": "https://schema.org/",
    "dct": "http://purl.org/dc/terms/",
    "conformsTo": "dct:conformsTo",
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "data": {"@id": "cr:data", "@type": "@json"},
    "examples": {"@id": "cr:examples", "@type": "@json"},
    **{term: f"cr:{term}" for term in _TERMS.split()},
}
"""What the names in `croissant.json` stand for: the context of Croissant 1.0, whole, for its
library warns of any other."""
IMAGES: dict[Robot, tuple[str, ...]] = {
    "mav": ("grey.png",),
    "ground": ("colour.png", "depth.png"),
}
"""Ends of the names of each robot's images."""
TEXTS = {
    "grey.png": "grey image of the MAV's camera",
    "colour.png": "colour image of the ground robot's camera",
    "depth.png": "depth along the optical axis, 16 bit, depth_units_per_m a metre, 0 is missing",
    "json": "stamp, true camera, true pose T_world_camera, scene, seed and flight",
}


@dataclass(frozen=True)
class Shard:
    """A tar file with samples of one robot."""

    robot: Robot
    path: Path
    samples: int


def _title(header: Header) -> str:
    return f"airground-{header.scene}-{header.seed}-{header.flight}"


def _description(header: Header) -> str:
    return (
        f"A MAV over, and a ground robot in, the simulated scene {header.scene}: "
        f"{header.duration_s:g} s, seed {header.seed}, sensors {header.sensors}; "
        f"made by airground {__version__}."
    )


def write_dataset_card(folder: Path, header: Header, shards: Sequence[Shard]) -> None:
    """Write `README.md`, whose head Hugging Face reads: one configuration a robot."""
    robots = dict.fromkeys(shard.robot for shard in shards)
    configurations = [
        line
        for robot in robots
        for line in (
            f"- config_name: {robot}",
            "  data_files:",
            "  - split: train",
            f"    path: data/{robot}-*.tar",
        )
    ]
    rows = [f"- `.{end}`: {TEXTS[end]}" for robot in robots for end in IMAGES[robot]]
    counts = [
        f"{sum(shard.samples for shard in shards if shard.robot == robot)} of the {robot}"
        for robot in robots
    ]
    lines = [
        "---",
        "task_categories: [depth-estimation, image-to-3d]",
        "tags: [robotics, slam, simulation, webdataset]",
        "configs:",
        *configurations,
        "---",
        "",
        f"# {markdown_text(_title(header))}",
        "",
        f"{markdown_text(_description(header))} Samples: {', '.join(counts)}.",
        "",
        "Poses map camera coordinates (x right, y down, z forward) to the world (z up), in metres.",
        "Integer pixel coordinates are pixel centres. Images are lossless. A sample has:",
        "",
        *rows,
        f"- `.json`: {TEXTS['json']}",
        "",
    ]
    (folder / "README.md").write_text("\n".join(lines), encoding="utf-8")


def write_croissant(folder: Path, header: Header, shards: Sequence[Shard]) -> None:
    """Write `croissant.json`: every shard with its digest, and each robot's files as records."""
    robots = dict.fromkeys(shard.robot for shard in shards)
    kinds = [(robot, end) for robot in robots for end in (*IMAGES[robot], "json")]
    content = {
        "@context": CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": f"{CROISSANT}1.0",
        "name": _title(header),
        "description": _description(header),
        "version": __version__,
        "distribution": [
            *map(_file_object, shards),
            *(_file_set(robot, end, shards) for robot, end in kinds),
        ],
        "recordSet": [_record_set(robot, end) for robot, end in kinds],
    }
    text = json.dumps(content, indent=1) + "\n"
    (folder / "croissant.json").write_text(text, encoding="utf-8")


def _file_object(shard: Shard) -> dict[str, Any]:
    return {
        "@type": "cr:FileObject",
        "@id": shard.path.name,
        "name": shard.path.name,
        "contentUrl": f"{shard.path.parent.name}/{shard.path.name}",
        "contentSize": f"{shard.path.stat().st_size} B",
        "encodingFormat": "application/x-tar",
        "sha256": file_digest(shard.path),
    }


def _file_set(robot: Robot, end: str, shards: Sequence[Shard]) -> dict[str, Any]:
    """The files of one kind in all shards of a robot."""
    return {
        "@type": "cr:FileSet",
        "@id": f"{robot}/{end}",
        "name": f"{robot}/{end}",
        "description": TEXTS[end],
        "containedIn": [{"@id": shard.path.name} for shard in shards if shard.robot == robot],
        # Croissant gives the whole of a file as text only if it is called one.
        "encodingFormat": "text/plain" if end == "json" else "image/png",
        "includes": f"*.{end}",
    }


def _record_set(robot: Robot, end: str) -> dict[str, Any]:
    name = f"{robot}_{end.removesuffix('.png')}"
    kind = "sc:Text" if end == "json" else "sc:ImageObject"
    fields = [("file", "sc:Text", "filename"), ("content", kind, "content")]
    return {
        "@type": "cr:RecordSet",
        "@id": name,
        "name": name,
        "field": [
            {
                "@type": "cr:Field",
                "@id": f"{name}/{field}",
                "name": field,
                "dataType": type_,
                "source": {
                    "fileSet": {"@id": f"{robot}/{end}"},
                    "extract": {"fileProperty": property_},
                },
            }
            for field, type_, property_ in fields
        ],
    }
