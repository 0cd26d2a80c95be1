"""Which frames make a depth map (Sec. VIII-B), decided from distances as frames come in.

A frame counts only once the camera has moved on: a hovering MAV makes no depth maps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from airground.config import ViewSelection as Parameters
from airground.core.arrays import U8
from airground.core.se3 import SE3

BEFORE, AFTER = 0, 1


@dataclass(frozen=True, eq=False)
class PosedImage:
    """A grey image (height, width) of the MAV and the pose of its camera in the MAV's map."""

    stamp_ns: int
    image: U8
    T_mav_camera: SE3

    def distance(self, other: PosedImage) -> float:
        """Between the two optical centres [m]."""
        return float(np.linalg.norm(self.T_mav_camera.translation - other.T_mav_camera.translation))

    def baseline(self, other: PosedImage) -> float:
        """The part of the distance that lies across this view's line of sight [m]."""
        offset = other.T_mav_camera.translation - self.T_mav_camera.translation
        forward = self.T_mav_camera.rotation[:, 2]
        return float(np.linalg.norm(offset - (offset @ forward) * forward))


class ViewBuffer:
    """The frames within the radius of the newest, evenly thinned to at most `max_views`."""

    def __init__(self, parameters: Parameters) -> None:
        self.radius = parameters.depth_map_radius_m
        self.capacity = parameters.max_views
        self.spacing = view_spacing(parameters)
        self.views: list[PosedImage] = []

    def push(self, frame: PosedImage) -> None:
        """Remembers a frame if it has moved on from the last one, and forgets far ones."""
        if not self.views or frame.distance(self.views[-1]) >= self.spacing:
            self.views.append(frame)
        near = [view for view in self.views if view.distance(frame) <= self.radius]
        self.views = near[-self.capacity :]

    def around(self, reference: PosedImage) -> list[PosedImage]:
        """The views before `reference` that can be compared with it, oldest first."""
        return [
            view
            for view in self.views
            if view.stamp_ns < reference.stamp_ns
            and self.spacing <= view.distance(reference) <= self.radius
        ]


class ViewSet:
    """The views of one depth map; `complete` once the camera has left the radius."""

    def __init__(self, reference: PosedImage, parameters: Parameters) -> None:
        self.reference = reference
        self.parameters = parameters
        self.spacing = view_spacing(parameters)
        self.complete = False
        self._members: list[PosedImage] = []

    def offer(self, view: PosedImage) -> bool:
        """Whether the view joins the depth map; notices when the camera has left."""
        distance = view.distance(self.reference)
        outside = distance > self.parameters.depth_map_radius_m
        if outside and view.stamp_ns > self.reference.stamp_ns:
            self.complete = True
        if self.complete or outside or distance < self.spacing:
            return False
        if len(self._members) >= self.parameters.max_views:
            return False
        if any(view.distance(member) < self.spacing for member in self._members):
            return False
        self._members.append(view)
        return True

    def suffices(self) -> bool:
        """Whether there are enough views, and one of them sees depth."""
        baselines = [self.reference.baseline(view) for view in self._members]
        return (
            len(baselines) >= self.parameters.min_views
            and max(baselines) >= self.parameters.min_baseline_m
        )


def view_spacing(parameters: Parameters) -> float:
    """Least distance between the views of a depth map [m].

    At 0.5 m/s and 30 Hz frames are 17 mm apart: with 16 views over 12 cm on each side every frame
    is taken, with 8 every other one."""
    sides = 2 if parameters.both_sides else 1
    return sides * parameters.depth_map_radius_m / (parameters.max_views + 1)
