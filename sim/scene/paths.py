"""Where both robots go."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from sim.scene.part import MAX_HEAP_HEIGHT_M, Fraction, Part, Point, Positive


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
    shadow: bool = False
    """Whether the MAV throws a shadow."""
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
    visible: bool = False
    """Whether the MAV sees the ground robot."""
    stop_at_overlap: Fraction | None = None
    """The robot stops as soon as it has seen this share of what the MAV flies over (the
    median that `sim.robots.overlap` measures); without it, it drives all the way. The heap stays
    the same."""
