"""How often matched images locate the MAV, against view angle, light and print: the limits of
Fig. 3.

Single images of both robots' cameras over some places of a scene, one condition varied at a time.
They are matched by ASIFT, as in the paper, and by the learned features that are installed.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import count, groupby, product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from airground.core.se3 import SE3
from evaluation.measure.baselines.feature_matching import (
    FeatureMatcher,
    asift_matcher,
    locate_camera,
    matches_of,
)
from evaluation.measure.baselines.interface import View
from evaluation.measure.baselines.learned_matching import installed_matchers
from evaluation.measure.protocol.trials import spread_evenly
from evaluation.table.limits import LOCATED_M
from evaluation.table.row_writer import RowWriter
from sim.geometry.surface import RayCaster
from sim.scene import Scene

if TYPE_CHECKING:
    from sim.recording.recorder import Flight
    from sim.recording.stills import Still, Stills
    from sim.world.world import World

STAGE = "appearance"
"""Rows of one pair of images share their trial: `view_angle_deg`, `light_turn_deg` and `printed`
are its conditions, `right_matches` and `located` its result by ASIFT, `NAME_right_matches` and
`NAME_located` by learned features. The note of `located` names the condition that is not the usual
one; without any, the pair belongs to all curves."""
VARIED = ("view_angle_deg", "light_turn_deg", "printed")
PLACES = 2
"""Places of a scene that are looked at: a pair takes ASIFT about 5 s."""
VIEW_ANGLES_DEG = (15.0, 30.0, 45.0, 60.0, 75.0)
LIGHT_TURNS_DEG = (45.0, 90.0, 180.0)
PRINTED = (0.0, 0.5, 1.0)
USUAL_ANGLE_DEG = 45.0
"""View angle while light and print vary: the steepest at which a camera that is pitched down by
20 degrees and has 49 degrees of view sees the ground [deg]."""
GROUND_DISTANCE_M = 1.8
"""Distance from the ground robot's camera to the place: the middle of a Kinect's good range [m]."""
RIGHT_PX = 8.0
"""A match is right whose point projects so near to the aerial feature; depth has noise [px]."""
_DIRECTIONS = 12


@dataclass(frozen=True)
class Look:
    """What the images of one world have in common.

    Attributes:
        varied: Name of the condition that is not the usual one; empty if none.
        light_turn_deg: Turn of the main light about the vertical between both images [deg].
        printed: Share of the boxes with print; None without boxes.
        view_angle_deg: Angle at the place between the lines of sight of both robots [deg].
    """

    varied: str = ""
    light_turn_deg: float = 0.0
    printed: float | None = None
    view_angle_deg: float = USUAL_ANGLE_DEG


def looks(scene: Scene) -> list[Look]:
    """Every view angle, then other light and other print; those of one world in a row."""
    printed = scene.rubble.printed if scene.rubble is not None else None
    usual = Look(printed=printed)
    angles = [
        replace(usual, varied="view_angle_deg" * (angle != USUAL_ANGLE_DEG), view_angle_deg=angle)
        for angle in VIEW_ANGLES_DEG
    ]
    lights = [Look("light_turn_deg", turn, printed) for turn in LIGHT_TURNS_DEG]
    shares = PRINTED if scene.rubble is not None else ()
    prints = [Look("printed", printed=share) for share in shares if share != printed]
    return [*angles, *lights, *prints]


def add_appearance(out: RowWriter, flight: Flight, places: int = PLACES) -> None:
    """Write the rows of one world, as the cameras of `flight` see it."""
    from sim.world.world import build_world  # MuJoCo, which a report does not need

    chosen = viewed_places(build_world(flight.scene, flight.seed, pictures=False), places)
    matchers = {"": asift_matcher()} | {
        f"{name}_": matcher for name, matcher in installed_matchers().items()
    }
    trials = count()
    for _, group in groupby(looks(flight.scene), lambda look: (look.light_turn_deg, look.printed)):
        alike = list(group)
        with _cameras(flight, alike[0]) as (aerial, ground):
            for look, place in product(alike, chosen):
                above = aerial.take("mav", place.T_world_mav)
                beside = ground.take("ground", place.T_world_ground(look.view_angle_deg))
                trial = next(trials)
                _add_conditions(out, look, trial)
                for method, matcher in matchers.items():
                    right, located = _matched(above, beside, matcher)
                    out.add(STAGE, f"{method}right_matches", right, "", trial=trial)
                    out.add(STAGE, f"{method}located", located, "", trial=trial, note=look.varied)


@contextmanager
def _cameras(flight: Flight, look: Look) -> Iterator[tuple[Stills, Stills]]:
    """The MAV's camera in the scene's light, and the ground robot's in the turned light."""
    from sim.recording.stills import Stills

    rng = np.random.default_rng([flight.seed, 7])
    with Stills(_world(flight, look.printed, 0.0), flight.sensors, rng) as aerial:
        if look.light_turn_deg == 0:
            yield aerial, aerial
            return
        turned = _world(flight, look.printed, look.light_turn_deg)
        with Stills(turned, flight.sensors, rng) as ground:
            yield aerial, ground


def _world(flight: Flight, printed: float | None, light_turn_deg: float) -> World:
    from sim.world.world import build_world

    scene = flight.scene
    azimuth_deg = scene.light.azimuth_deg + light_turn_deg
    changed: dict[str, object] = {
        "light": scene.light.model_copy(update={"azimuth_deg": azimuth_deg})
    }
    if scene.rubble is not None:
        changed["rubble"] = scene.rubble.model_copy(update={"printed": printed})
    return build_world(scene.model_copy(update=changed), flight.seed)


@dataclass(frozen=True, eq=False)
class Place:
    """A place to look at.

    Attributes:
        T_world_mav: Pose of the MAV's camera above it.
        target: (3,) the point of the surface below the MAV [m].
        direction: (3,) horizontal unit vector from the place toward the ground robot.
    """

    T_world_mav: SE3
    target: NDArray[np.float64]
    direction: NDArray[np.float64]

    def T_world_ground(self, view_angle_deg: float) -> SE3:
        """Pose of the ground robot's camera that looks at the place, its columns level."""
        angle = np.radians(view_angle_deg)
        back = np.sin(angle) * self.direction + np.array([0.0, 0.0, np.cos(angle)])
        return _looking(self.target + GROUND_DISTANCE_M * back, -back, -self.direction)


def viewed_places(world: World, count: int) -> list[Place]:
    """Places along the flight, each seen from the side from which least hides it."""
    scene, caster = world.scene, RayCaster((world.vertices, world.triangles))
    corners = np.unique(np.array(scene.mav.waypoints), axis=0)
    height = float(world.floor_height(*scene.mav.start)) + scene.mav.height_m
    places = []
    for index in spread_evenly(len(corners), count):
        above = np.array([*corners[index], height])
        target = above - np.array([0, 0, _free(caster, above, np.array([0, 0, -1.0]))])
        turns = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
        around = np.stack([np.cos(turns), np.sin(turns), np.zeros(_DIRECTIONS)], axis=1)
        start, lowest = target + np.array([0, 0, 0.01]), np.radians(VIEW_ANGLES_DEG[-1])
        free = [
            _free(caster, start, np.sin(lowest) * d + np.array([0, 0, np.cos(lowest)]))
            for d in around
        ]
        T_world_mav = _looking(above, np.array([0, 0, -1.0]), np.array([1.0, 0, 0]))
        places.append(Place(T_world_mav, target, around[int(np.argmax(free))]))
    return places


def _free(caster: RayCaster, origin: NDArray, direction: NDArray) -> float:
    """Distance to the first surface along a unit vector; infinite if there is none [m]."""
    ray = np.concatenate([origin, direction]).astype(np.float32)[None]
    return float(caster.hits(ray)[0][0])


def _looking(place: NDArray, forward: NDArray, level: NDArray) -> SE3:
    """A camera whose rows point down as far as `forward` lets them; `level` is ahead of it."""
    right = np.cross(level, [0.0, 0.0, 1.0])
    return SE3(np.column_stack([right, np.cross(forward, right), forward]), place)


def _add_conditions(out: RowWriter, look: Look, trial: int) -> None:
    out.add(STAGE, "view_angle_deg", look.view_angle_deg, "deg", trial=trial)
    out.add(STAGE, "light_turn_deg", look.light_turn_deg, "deg", trial=trial)
    if look.printed is not None:
        out.add(STAGE, "printed", look.printed, "", trial=trial)


def _matched(above: Still, beside: Still, matcher: FeatureMatcher) -> tuple[int, bool]:
    """Number of right matches, and whether the MAV's camera is located within `LOCATED_M`."""
    aerial = View(0, above.camera, above.T_world_camera, above.grey)
    ground = View(0, beside.camera, beside.T_world_camera, beside.grey, beside.depth)
    (matches,) = matches_of(aerial, (ground,), matcher)
    if len(matches.aerial_px) == 0:
        return 0, False
    places = above.camera.project(above.T_world_camera.inverse() @ matches.points_ground)
    right = np.linalg.norm(places - matches.aerial_px, axis=1) < RIGHT_PX
    found = locate_camera(aerial, [matches]).T_ground_camera
    if found is None:
        return int(right.sum()), False
    off_m = np.linalg.norm((found.translation - above.T_world_camera.translation)[:2])
    return int(right.sum()), bool(off_m <= LOCATED_M)
