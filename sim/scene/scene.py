"""A scene: its tables, and how they fit together."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from sim.scene.bodies import Body
from sim.scene.light import Light
from sim.scene.part import Fraction, Part
from sim.scene.paths import GroundPath, MavPath
from sim.scene.room import Room
from sim.scene.rubble import Rubble
from sim.scene.terrain import Terrain
from sim.scene.things import Debris, Shelves, Street

PARTS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "rubble": (("rubble",), ()),
    "terrain": (("terrain",), ()),
    "flat": ((), ()),
    "built": ((), ("rubble", "shelves", "debris", "street")),
}
"""Tables that each kind of scene needs, and others that it may have."""
FLIGHT_ABOVE_M = 0.4
"""Least distance of the MAV's flight from the top of what is built [m]: its sway and more."""


class Scene(Part):
    """A scene file, checked."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
    description: str
    kind: Literal["rubble", "terrain", "flat", "built"]
    """Boxes on a floor, natural ground, a floor without any structure, or a floor with what people
    have built: shelves, debris, and boxes where there are any."""
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
    shelves: Shelves | None = None
    debris: Debris | None = None
    street: Street | None = None
    bodies: tuple[Body, ...] = ()
    """Bodies that move while the robots look."""
    mav: MavPath
    ground: GroundPath

    def light_of(self, robot: str) -> Light:
        """The light in which the "mav" or the "ground" robot sees the world."""
        if robot == "mav" and self.flight_light is not None:
            return self.flight_light
        return self.light

    @model_validator(mode="before")
    @classmethod
    def _flight_light_completed(cls, data: Any) -> Any:
        light, flight_light = (data.get(key, {}) for key in ("light", "flight_light"))
        if isinstance(light, dict) and isinstance(flight_light, dict) and flight_light:
            return {**data, "flight_light": {**light, **flight_light}}
        return data

    @model_validator(mode="after")
    def _parts_fit(self) -> Scene:
        needed, allowed = PARTS[self.kind]
        for part in ("rubble", "terrain", "shelves", "debris", "street"):
            present = getattr(self, part) is not None
            if present and part not in needed + allowed:
                raise ValueError(f"kind = '{self.kind}' has no use for the [{part}] table")
            if part in needed and not present:
                raise ValueError(f"kind = '{self.kind}' needs a [{part}] table")
        if self.kind == "built":
            self._check_built()
        half = [side / 2 for side in self.room.size_m]
        places = [self.mav.start, *self.mav.waypoints, *(p[:2] for p in self.ground.waypoints)]
        places += [place for body in self.bodies for place in body.waypoints]
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

    def _check_built(self) -> None:
        """Something is there, the MAV flies above it, and nothing of it changes."""
        parts = {name: getattr(self, name) for name in PARTS["built"][1]}
        if not any(parts.values()):
            raise ValueError(f"kind = 'built' needs one of the tables {', '.join(parts)}")
        tops = {name: part.height_m for name, part in parts.items() if hasattr(part, "height_m")}
        for name, top_m in tops.items():
            if self.mav.height_m < top_m + FLIGHT_ABOVE_M:
                raise ValueError(
                    f"mav.height_m = {self.mav.height_m} must be at least {FLIGHT_ABOVE_M} above "
                    f"the top of [{name}], {top_m:g}"
                )
        if self.street is not None:
            road_m = self.room.size_m[1] - 2 * self.street.pavement_m
            for name, part in (("rubble", self.rubble), ("debris", self.debris)):
                if part is not None and part.area_m[1] > road_m:
                    raise ValueError(
                        f"{name}.area_m[1] = {part.area_m[1]} must be at most {road_m:g}, the "
                        "width of the road"
                    )
        if self.rubble is not None and self.rubble.changed > 0:
            raise ValueError("rubble.changed must be 0 in a scene of kind 'built'")
