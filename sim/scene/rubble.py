"""Heaps of cardboard boxes."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from sim.scene.part import Fraction, Part, Positive


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
