"""Entities and frames by name: what is drawn is found in the viewer under these."""

from __future__ import annotations

from airground.core.cloud import Source

GROUND, MAV, SURFACE, WORLD, COSTS = "ground", "mav", "surface", "world", "cost_map"
"""Frames: both robots' maps, the newest aerial surface, the true world, pixels of the cost map."""

ROBOT = {Source.GROUND: GROUND, Source.MAV: MAV}
"""A robot's name, which is also that of its map's frame."""

TRUTH = "/truth"
"""All that is true and that no robot knows."""


def camera_frame(robot: str) -> str:
    return f"{robot}_camera"


def image_frame(robot: str) -> str:
    return f"{robot}_image"
