"""Natural ground."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from sim.scene.part import Part, Positive


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
    grass_per_m2: Annotated[float, Field(ge=0, le=120)] = 0.0
    """Tufts of grass on ground and rocks, each of eight blades of 12 to 35 cm [1/m^2]."""
    plants_per_m2: Annotated[float, Field(ge=0, le=60)] = 0.0
    """Low plants on ground and rocks, each a rosette of leaves of 8 to 20 cm [1/m^2]."""

    @property
    def covered(self) -> bool:
        """Whether stones, plants or grass stand on the ground."""
        return self.stones_per_m2 + self.plants_per_m2 + self.grass_per_m2 > 0
