"""Scene files: what stands in a world, how it is lit, and where both robots go.

`docs/add_a_scene.md` explains every key with an example.
"""

from __future__ import annotations

from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from airground.errors import InputError
from airground.io.input_files import SETTINGS_LIMIT, parse_toml, read_text

Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Fraction = Annotated[float, Field(ge=0, le=1)]
Point = tuple[float, float]
Colour = tuple[NonNegative, NonNegative, NonNegative]

MAX_HEAP_HEIGHT_M = 1.1
"""Least height of the MAV's flight, above any heap of any seed [m]."""


class Part(BaseModel):
    """A frozen table of a scene file that refuses keys it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Room(Part):
    """The floor and the walls around it."""

    size_m: tuple[Positive, Positive]
    """Extent of the floor along x and y, centred on the origin [m]."""
    wall_height_m: NonNegative = 3.0
    """Height of the four walls; 0 leaves them out [m]."""
    floor: Literal["concrete", "plain", "printed"] = "concrete"
    """Worn concrete, a plain covering of one colour, or a flat print full of texture."""


class Rubble(Part):
    """Cardboard boxes, dropped and settled."""

    boxes: Annotated[int, Field(ge=1, le=150)]
    """How many boxes lie there in the end."""
    area_m: tuple[Positive, Positive]
    """Extent along x and y over which they are dropped, centred on the origin [m]."""
    edge_m: tuple[Positive, Positive]
    """Shortest and longest edge of a box [m]."""
    makes: Annotated[int, Field(ge=1, le=40)] = 12
    """Number of different makes (size, board, print)."""
    self_similarity: Fraction = 0.0
    """Share of boxes that are of the first make; the rest is drawn from all makes."""
    piles: Annotated[int, Field(ge=0, le=50)] = 0
    """Boxes are dropped around so many places and pile up there; 0 spreads them evenly."""
    tumble: Fraction = 1.0
    """0 drops boxes upright and aligned with the room, 1 in any orientation."""
    clearance_m: Positive = 0.45
    """No box comes closer to the ground robot's path than this [m]."""
    printed: Fraction = 1.0
    """Share of the boxes that carry print, labels and stickers; the others are plain board."""
    size_scale: Annotated[float, Field(ge=0.1, le=1.5)] = 1.0
    """Every box is so many times as large as drawn; so the heap is about so much higher."""
    changed: Annotated[float, Field(ge=0, le=0.5)] = 0.0
    """Share of the boxes that have moved, fallen or gone when the MAV sees them."""

    @model_validator(mode="after")
    def _edges_in_order(self) -> Rubble:
        if self.edge_m[0] > self.edge_m[1]:
            raise ValueError(f"edge_m: {self.edge_m[0]} is longer than {self.edge_m[1]}")
        return self


class Terrain(Part):
    """Uneven natural ground with rocks."""

    relief_m: Positive = 0.35
    """Height between the lowest and the highest ground [m]."""
    clods_m: Annotated[float, Field(ge=0, le=0.1)] = 0.0
    """Height of clods of 10 to 16 cm on the ground, twice their standard deviation [m]."""
    rocks: Annotated[int, Field(ge=0, le=200)] = 60
    """How many rocks lie on it."""
    rock_m: tuple[Positive, Positive] = (0.15, 0.9)
    """Smallest and largest diameter of a rock [m]."""
    rock_roughness_m: Annotated[float, Field(ge=0, le=0.03)] = 0.0
    """Standard deviation of steps and hollows of about 8 cm on the rocks [m]."""
    area_m: tuple[Positive, Positive] = (6.0, 6.0)
    """Extent along x and y over which rocks lie, centred on the origin [m]."""
    clearance_m: Positive = 0.45
    """No rock comes closer to the ground robot's path than this [m]."""
    stones_per_m2: Annotated[float, Field(ge=0, le=400)] = 0.0
    """Small stones of 2 to 9 cm, which stand out of the ground [1/m^2]."""
    plants_per_m2: Annotated[float, Field(ge=0, le=60)] = 0.0
    """Low plants on ground and rocks, each a rosette of leaves of 8 to 20 cm [1/m^2]."""


class Light(Part):
    """One lamp (or the sun) with a soft edge, a second to fill in, and light from all around."""

    azimuth_deg: float = 60.0
    """Direction of the main light, counter-clockwise from +x [deg]."""
    elevation_deg: Annotated[float, Field(gt=10, le=90)] = 55.0
    """Its height above the horizon [deg]."""
    radius_deg: Annotated[float, Field(gt=0, le=45)] = 8.0
    """Its angular radius: the larger, the softer the shadows [deg]."""
    main: NonNegative = 0.55
    """Irradiance of open, level ground by the main light."""
    fill: NonNegative = 0.15
    """The same by a broad light from the opposite side."""
    ambient: NonNegative = 0.35
    """The same by the sky or the ceiling."""
    main_colour: Colour = (1.03, 1.0, 0.94)
    """Factors of the main light's red, green and blue."""
    ambient_colour: Colour = (0.95, 1.0, 1.07)
    """The same of the light from all around."""
    lamp_m: tuple[float, float, Annotated[float, Field(gt=MAX_HEAP_HEIGHT_M)]] | None = None
    """Place of a lamp that gives the main light, in place of a direction [m]; `main` is then the
    irradiance of the level ground below it, and `radius_deg` is seen from there."""


class MavPath(Part):
    """Where the MAV flies."""

    start: Point
    """Where it stands before take-off [m]."""
    takeoff_s: Positive
    """When it leaves the ground [s]."""
    height_m: Annotated[float, Field(gt=MAX_HEAP_HEIGHT_M, le=10)] = 2.2
    """Flight height above the ground at `start` [m]."""
    speed_mps: Annotated[float, Field(gt=0, le=3)] = 0.5
    """Speed on straight stretches [m/s]."""
    waypoints: Annotated[tuple[Point, ...], Field(min_length=2)]
    """Corners of the flight path; the first is `start` or near it [m]."""
    sway_m: Annotated[float, Field(ge=0, le=0.5)] = 0.08
    """Amplitude of the extra motion that excites the IMU [m]."""
    camera_f_px: Annotated[float, Field(gt=100, le=2000)] = 420.0
    """Focal length of the downward 752 x 480 camera [px]."""


class GroundPath(Part):
    """Where the ground robot drives; its heading does not depend on its travel."""

    camera_height_m: Annotated[float, Field(gt=0.1, le=2)] = 0.7
    """Height of the camera above the ground [m]."""
    camera_pitch_deg: Annotated[float, Field(ge=0, le=60)] = 20.0
    """How far the camera looks down [deg]."""
    speed_mps: Annotated[float, Field(gt=0, le=2)] = 0.4
    """Largest speed [m/s]."""
    turn_dps: Annotated[float, Field(gt=0, le=120)] = 40.0
    """Largest yaw rate [deg/s]."""
    waypoints: Annotated[tuple[tuple[float, float, float], ...], Field(min_length=2)]
    """x [m], y [m] and heading [deg, 0 looks along +x, counter-clockwise]."""
    lamp: Annotated[float, Field(ge=0, le=10)] = 0.0
    """Irradiance by a lamp at the camera of what faces it at 1 m, in units of `light`."""
    lamp_beam_deg: Annotated[float, Field(ge=5, le=80)] = 30.0
    """Angle from the camera's axis at which the lamp shines half as bright [deg]."""
    stop_at_overlap: Fraction | None = None
    """The robot stops as soon as it has seen this share of what the MAV flies over (the
    median that `sim.robots.overlap` measures); without it, it drives all the way. The heap stays
    the same."""


class Scene(Part):
    """A scene file, checked."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
    description: str
    kind: Literal["rubble", "terrain", "flat"]
    """Boxes on a floor, natural ground, or a floor without any structure."""
    duration_s: Annotated[float, Field(gt=1, le=600)]
    """Length of a recording [s]."""
    overlap_expected: Fraction
    """Median share of the MAV's footprint that the ground robot has seen before."""
    texture: Fraction = 1.0
    """Contrast of all pictures: 1 as drawn, 0 leaves every surface its mean colour and the
    light on it."""
    room: Room
    light: Light = Light()
    flight_light: Light | None = None
    """Light when the MAV sees the world, if it is another one; keys that it leaves out are those
    of `light`."""
    rubble: Rubble | None = None
    terrain: Terrain | None = None
    mav: MavPath
    ground: GroundPath

    @model_validator(mode="before")
    @classmethod
    def _flight_light_completed(cls, data: Any) -> Any:
        light, flight_light = (data.get(key, {}) for key in ("light", "flight_light"))
        if isinstance(light, dict) and isinstance(flight_light, dict) and flight_light:
            return {**data, "flight_light": {**light, **flight_light}}
        return data

    @model_validator(mode="after")
    def _parts_fit(self) -> Scene:
        wanted = {"rubble": "rubble", "terrain": "terrain", "flat": None}[self.kind]
        for part in ("rubble", "terrain"):
            present = getattr(self, part) is not None
            if present != (part == wanted):
                verb = "needs a" if part == wanted else "has no use for the"
                raise ValueError(f"kind = '{self.kind}' {verb} [{part}] table")
        half = [side / 2 for side in self.room.size_m]
        places = [self.mav.start, *self.mav.waypoints, *(p[:2] for p in self.ground.waypoints)]
        for x, y in places:
            if abs(x) > half[0] or abs(y) > half[1]:
                raise ValueError(
                    f"waypoint [{x}, {y}] lies outside room.size_m "
                    f"(x within ±{half[0]}, y within ±{half[1]})"
                )
        if self.mav.takeoff_s >= self.duration_s:
            raise ValueError(
                f"mav.takeoff_s = {self.mav.takeoff_s} must be below duration_s = {self.duration_s}"
            )
        return self


def scene_names() -> list[str]:
    """Names of the scenes that come with the package, sorted."""
    files = resources.files("scenes").iterdir()
    return sorted(file.name[:-5] for file in files if file.name.endswith(".toml"))


def load_scene(name: str) -> Scene:
    """Read a scene by name, or from the path of a `.toml` file.

    Raises:
        InputError: There is no such scene, or the file breaks a rule: names file and key.
    """
    if name.endswith(".toml"):
        path = Path(name)
        try:
            return parse_scene(read_text(path, SETTINGS_LIMIT), str(path))
        except (OSError, UnicodeDecodeError) as error:
            reason = error.strerror if isinstance(error, OSError) else error
            raise InputError(f"{path}: cannot read this scene file ({reason})") from None
    if name not in scene_names():
        known = ", ".join(scene_names())
        raise InputError(f"unknown scene '{name}': known are {known}, or the path of a .toml file")
    text = resources.files("scenes").joinpath(f"{name}.toml").read_text(encoding="utf-8")
    return parse_scene(text, f"scenes/{name}.toml")


def parse_scene(text: str, file: str) -> Scene:
    """Check the text of a scene file; `file` is what messages call it.

    Raises:
        InputError: One line that names the file, the key and what would be right.
    """
    try:
        return Scene.model_validate(parse_toml(text))
    except ValidationError as error:
        raise InputError(f"{file}: {_first_problem(error)}") from None
    except ValueError as error:
        raise InputError(f"{file}: not valid TOML: {error}") from None


def _first_problem(error: ValidationError) -> str:
    """One line for the first complaint: key, value, and what would be right."""
    problem = error.errors(include_url=False)[0]
    location = problem["loc"]
    key = ".".join(str(step) for step in location)
    if problem["type"] == "extra_forbidden":
        known = ", ".join(_known_keys(location[:-1]))
        return f"unknown key '{key}'; known here are {known}"
    if problem["type"] == "missing":
        return f"key '{key}' is missing"
    message = problem["msg"].removeprefix("Value error, ")
    if not key:
        return message
    if problem["type"] == "value_error":
        return f"{key}: {message}"
    return f"{key} = {problem['input']!r}: {message[0].lower()}{message[1:]}"


def _known_keys(location: tuple[Any, ...]) -> list[str]:
    tables: dict[str, type[Part]] = {
        "room": Room,
        "light": Light,
        "flight_light": Light,
        "rubble": Rubble,
        "terrain": Terrain,
        "mav": MavPath,
        "ground": GroundPath,
    }
    model = tables[str(location[0])] if location else Scene
    return list(model.model_fields)
