"""A dataset's data sheet: contents and origin, from its scenes, sensors and recordings."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from airground import __version__
from airground.io.header import Header, read_header
from airground.io.layout import HEADER, TRUTH
from airground.io.tum import read_tum
from evaluation.setup.text import markdown_table
from sim.robots.motion import ROBOTS
from sim.scene import Scene
from sim.sensors.presets import SensorPreset

CONVENTIONS = """\
## Frames and units

- Metres, seconds (nanoseconds in stamps), radians unless a name says otherwise. `T_a_b` maps
  coordinates in frame b to frame a.
- `world`: z up, the floor's middle is the origin. `body`: x forward, z up. `camera`: x right,
  y down, z forward. `truth/*.tum` are `T_world_body` with quaternions x y z w.
- Integer pixel coordinates are pixel centres. Depth is z along the optical axis, 5000 per metre,
  0 is missing.
- `mav0/` is in EuRoC's form, `ground/` in TUM's; `recording.toml` has the nominal calibration,
  `truth/calibration.toml` the true one.

## Known limits

- Simulated: MuJoCo's boxes and light, rendered; no real image is among them.
- Global shutter, no lens distortion, no rolling shutter, no wind; nothing moves but the robots.
- Depth has the noise of structured light, without interference or multipath.
- Recordings of one scene share its room, its paths (moved a little by the seed) and its light;
  results on a test part of the same scenes do not hold for other scenes.
- All randomness comes from the seed: the same version makes the same bytes.
"""


def datasheet(
    name: str,
    scenes: Sequence[Scene],
    sensors: SensorPreset,
    recordings: Sequence[tuple[str, Path]],
) -> str:
    """The text of `DATASHEET.md`, from part and folder of each recording."""
    headers = [(part, folder, read_header(folder / HEADER)) for part, folder in recordings]
    lines = [
        f"# {name}",
        "",
        f"{len(headers)} recordings of a MAV over, and a ground robot in, {len(scenes)} simulated "
        f"scenes, made by airground {__version__} (`airground simulate`).",
        "",
        *_parts(headers),
        *_scenes(scenes),
        *_robots(headers[0][2]),
        *_noise(sensors),
        CONVENTIONS,
        *_recordings(headers),
    ]
    return "\n".join(lines)


Recorded = tuple[str, Path, Header]


def _parts(headers: Sequence[Recorded]) -> list[str]:
    parts: dict[str, list[Header]] = defaultdict(list)
    for part, _, header in headers:
        parts[part].append(header)
    rows = []
    for part, of in sorted(parts.items()):
        images = sum(h.frames.mav for h in of), sum(h.frames.ground for h in of)
        rows.append([part, len(of), f"{sum(h.duration_s for h in of):g}", *images])
    columns = ["part", "recordings", "seconds", "MAV images", "ground images"]
    rule = "No world (scene and seed) is in two parts."
    return ["## Parts", "", rule, "", *_table(columns, rows)]


def _scenes(scenes: Sequence[Scene]) -> list[str]:
    rows = [
        [
            scene.name,
            scene.description,
            " x ".join(f"{side:g}" for side in scene.room.size_m),
            scene.rubble.boxes if scene.rubble else "-",
            f"{scene.mav.height_m:g}",
            f"{100 * scene.overlap_expected:.0f} %",
        ]
        for scene in scenes
    ]
    columns = ["scene", "what", "room [m]", "boxes", "flight height [m]", "overlap"]
    return ["## Geometry", "", *_table(columns, rows), *_two_worlds(scenes)]


def _two_worlds(scenes: Sequence[Scene]) -> list[str]:
    """A line for each scene in which the robots do not see the same world at rest."""
    lines = []
    for scene in scenes:
        share = scene.rubble.changed if scene.rubble else 0.0
        if share > 0:
            lines.append(
                f"- `{scene.name}`: {100 * share:.0f} % of the boxes have moved, fallen or gone "
                "when the MAV sees them (`truth/changes.csv`, `truth/surface_mav.ply`)."
            )
        if scene.flight_light is not None:
            lines.append(f"- `{scene.name}`: the MAV sees it in another light.")
        if scene.bodies:
            lines.append(
                f"- `{scene.name}`: bodies that move while the robots look: {len(scene.bodies)} "
                "(`truth/bodies.csv`)."
            )
        if scene.ground.lamp > 0:
            lines.append(f"- `{scene.name}`: the ground robot carries a lamp.")
    return [*lines, ""] if lines else []


def _robots(header: Header) -> list[str]:
    rows: list[list[Any]] = []
    for robot in ROBOTS:
        table = header.calibration.mav if robot == "mav" else header.calibration.ground
        camera = table.camera
        view = np.rad2deg(2 * np.arctan(camera.width / 2 / camera.fx))
        if camera.distortion_model:
            sides = camera.lens().rays()[round(camera.cy), [0, -1], 0]
            view = np.rad2deg(np.ptp(np.arctan(sides)))
        words = [f"{view:.0f} deg wide", camera.distortion_model]
        words += [f"rolling shutter of {camera.readout_s * 1e3:g} ms"] if camera.readout_s else []
        rows.append(
            [
                robot,
                f"{camera.width} x {camera.height} at {camera.rate_hz:g} Hz, "
                + ", ".join(filter(None, words)),
                "-" if robot == "mav" else "registered, 16 bit",
                f"{table.imu.rate_hz:g} Hz",
                f"{table.magnetometer.rate_hz:g} Hz",
            ]
        )
    columns = ["robot", "camera", "depth", "IMU", "magnetometer"]
    return ["## Sensors", "", *_table(columns, rows)]


def _noise(sensors: SensorPreset) -> list[str]:
    rows = [
        [kind, key, f"{np.round(value, 9)}"]
        for kind, values in asdict(sensors).items()
        if isinstance(values, dict) and not kind.endswith("optics")
        for key, value in values.items()
    ]
    title = f"## Noise and calibration errors: {sensors.name}"
    if not rows:
        return [title, "", "None: every sensor is perfect.", ""]
    return [title, "", *_table(["sensor", "parameter", "value"], rows)]


def _recordings(headers: Sequence[Recorded]) -> list[str]:
    rows = []
    for part, folder, header in headers:
        paths_m = [read_tum(folder / TRUTH / f"{robot}.tum").path_m() for robot in ROBOTS]
        row = [f"{part}/{folder.name}", header.scene, header.seed, f"{header.duration_s:g}"]
        rows.append([*row, *(f"{path_m:.1f}" for path_m in paths_m)])
    columns = ["recording", "scene", "seed", "seconds", "MAV path [m]", "ground path [m]"]
    return ["## Recordings", "", *_table(columns, rows)]


def _table(columns: Sequence[str], rows: Sequence[Sequence[object]]) -> list[str]:
    return [*markdown_table(columns, rows), ""]
