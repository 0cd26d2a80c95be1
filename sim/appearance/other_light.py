"""Light of another hour: how far the light of the flight is from that of the drive."""

from __future__ import annotations

from airground.errors import InputError
from sim.scene import Light

LATER_AZIMUTH_DEG = 120.0
"""Turn of the sun in 8 hours, from morning to late afternoon [deg]."""
LATER_ELEVATION_DEG = 25.0
"""Height of the sun two hours before it sets [deg]."""
LATER_SHARE = 0.6
"""Irradiance then, as a share of that before: the sine of 25 deg by that of 45 deg."""
LATER_COLOUR = (1.25, 0.95, 0.65)
"""Colour of a low sun or a warm lamp, about 3500 K in place of 6000 K."""


def later_light(light: Light) -> Light:
    """The light late in the afternoon: lower, weaker, warmer and from another side.

    A lamp hangs on the other side of the origin then.
    """
    red, green, blue = (a * b for a, b in zip(light.main_colour, LATER_COLOUR, strict=True))
    lamp = light.lamp_m
    return light.model_copy(
        update={
            "azimuth_deg": light.azimuth_deg + LATER_AZIMUTH_DEG,
            "elevation_deg": LATER_ELEVATION_DEG,
            "lamp_m": None if lamp is None else (-lamp[0], -lamp[1], lamp[2]),
            "main": LATER_SHARE * light.main,
            "fill": LATER_SHARE * light.fill,
            "ambient": LATER_SHARE * light.ambient,
            "main_colour": (red, green, blue),
        }
    )


def light_between(one: Light, other: Light, share: float) -> Light:
    """The light that is `share` of the way from one to the other; azimuths turn the shorter way.

    Raises:
        InputError: One has a lamp and the other a direction.
    """
    if (one.lamp_m is None) != (other.lamp_m is None):
        raise InputError("lamp_m must be in both [light] and [flight_light], or in neither")
    start, end = one.model_dump(), other.model_dump()
    turn_deg = (end["azimuth_deg"] - start["azimuth_deg"] + 180) % 360 - 180
    end["azimuth_deg"] = start["azimuth_deg"] + turn_deg
    mixed = {key: _between(start[key], end[key], share) for key in start}
    return Light.model_validate(mixed)


def _between(
    start: float | tuple[float, ...] | None, end: float | tuple[float, ...] | None, share: float
) -> float | tuple[float, ...] | None:
    if isinstance(start, tuple) and isinstance(end, tuple):
        return tuple((1 - share) * a + share * b for a, b in zip(start, end, strict=True))
    if isinstance(start, int | float) and isinstance(end, int | float):
        return (1 - share) * start + share * end
    return None
