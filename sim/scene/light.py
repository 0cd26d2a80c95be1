"""Light on a scene."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from sim.scene.part import MAX_HEAP_HEIGHT_M, Colour, NonNegative, Part


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
