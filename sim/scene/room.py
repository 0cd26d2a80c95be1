"""The floor of a scene and the walls around it."""

from __future__ import annotations

from typing import Literal

from sim.scene.part import NonNegative, Part, Positive


class Room(Part):
    """The floor and the walls around it."""

    size_m: tuple[Positive, Positive]
    """Extent of the floor along x and y, centred on the origin [m]."""
    wall_height_m: NonNegative = 3.0
    """Height of the four walls; 0 leaves them out [m]."""
    floor: Literal["concrete", "plain", "printed", "asphalt"] = "concrete"
    """Worn concrete, a plain covering of one colour, a flat print full of texture, or a road."""
