"""Bodies that move through a scene while the robots look."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from sim.scene.part import NonNegative, Part, Point


class Body(Part):
    """A body that walks or drives along a path; it touches nothing."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
    """Name in the truth, unlike any other."""
    shape: Literal["person", "robot"] = "person"
    """A standing person of 1.75 m, or a robot of 0.8 m on four wheels."""
    start_s: NonNegative = 0.0
    """When it sets off [s]; it stands at the first waypoint before."""
    speed_mps: Annotated[float, Field(gt=0, le=3)] = 1.0
    """Speed on straight stretches [m/s]."""
    waypoints: Annotated[tuple[Point, ...], Field(min_length=2)]
    """Corners of its path; it stands at the last one [m]."""
