"""What people have put on a floor: racks of shelves, the debris of a building, a street."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from sim.scene.part import Fraction, NonNegative, Part, Positive

Count = Annotated[int, Field(ge=0, le=200)]
Range = tuple[Positive, Positive]
FOOT_M = 0.12
"""Height of the middle of the lowest board of a rack, as of pallet racks [m]."""


class Shelves(Part):
    """Rows of identical racks along x, with identical boxes: the same again every period."""

    rows: Annotated[int, Field(ge=1, le=12)]
    """Number of rows, side by side along y."""
    bays: Annotated[int, Field(ge=1, le=30)]
    """Number of bays in a row, end to end along x."""
    period_m: Range = (1.2, 1.9)
    """Length of a bay, and distance from row to row: the pattern is the same after a shift by
    either [m]."""
    depth_m: Positive = 0.5
    """Depth of a rack along y; the rest of the period is aisle [m]."""
    levels: Annotated[int, Field(ge=1, le=6)] = 3
    """Number of boards above each other; boxes stand on all of them."""
    level_m: Positive = 0.45
    """Height from one board to the next [m]."""
    boxes_per_bay: Annotated[int, Field(ge=0, le=6)] = 2
    """Boxes side by side on each board of a bay."""
    box_m: tuple[Positive, Positive, Positive] = (0.44, 0.38, 0.28)
    """Size of a box along x, y and z [m]."""
    empty: Fraction = 0.0
    """Share of the places without a box, drawn by the seed: it breaks the repetition."""

    @property
    def height_m(self) -> float:
        """Height of the tops of the highest boxes [m], a board's thickness left out."""
        return FOOT_M + (self.levels - 1) * self.level_m + self.box_m[2]


class Debris(Part):
    """Slabs, beams and bricks of a building, dropped around the stumps of its columns."""

    area_m: Range
    """Extent along x and y over which it lies, centred on the origin [m]."""
    columns: Count = 0
    """Stumps of columns, which stand; slabs come to lean on them."""
    slabs: Count = 0
    """Slabs of floors and walls."""
    slab_m: Range = (0.8, 1.6)
    """Shortest and longest edge of a slab, which is 0.1 to 0.18 m thick [m]."""
    beams: Count = 0
    """Beams, 0.12 to 0.22 m thick."""
    beam_m: Range = (0.8, 2.0)
    """Length of the shortest and the longest beam [m]."""
    bricks: Count = 0
    """Lumps of brickwork."""
    brick_m: Range = (0.2, 0.5)
    """Longest edge of the smallest and the largest lump [m]."""
    piles: Annotated[int, Field(ge=0, le=50)] = 0
    """It falls around so many places; 0 spreads it evenly."""
    clearance_m: Positive = 0.45
    """Nothing comes closer to the ground robot's path than this [m]."""
    height_m: Annotated[float, Field(ge=0.5, le=4)] = 1.6
    """Nothing is higher than this [m]."""


class Street(Part):
    """A road along x between pavements and houses."""

    pavement_m: Positive = 3.0
    """Width of the pavement on either side [m]."""
    kerb_m: Annotated[float, Field(gt=0, le=0.3)] = 0.12
    """Height of the pavements above the road [m]."""
    houses_m: NonNegative = 8.0
    """Height of the highest houses, whose fronts end the floor; 0 leaves them out [m]."""
