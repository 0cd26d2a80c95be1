"""The localization and mapping pipeline, as in the paper's Figure 4.

Tracked frames in, events out. Each robot maps on its own; each new surface of the MAV is located
in the ground robot's map, refined, and added to it. Tracking does not depend on mapping."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from airground.augmentation import Augmentation, AugmentedMap
from airground.config import Config
from airground.core.arrays import F64
from airground.core.cloud import PointCloud, Source
from airground.core.events import (
    Aligned,
    Event,
    GroundMapExtended,
    GroundTracked,
    Initializing,
    MapAugmented,
    MavTracked,
    NotLocated,
    PosesCorrected,
    Sighted,
    SurfaceCast,
    TrackingLost,
)
from airground.core.messages import GroundImage, MavImage, RobotCalibration
from airground.core.se3 import SE3
from airground.core.sighting import Sighting
from airground.core.surface import AerialSurface
from airground.core.trajectory import Trajectory
from airground.dense.reconstruction import DenseReconstruction
from airground.ground_map import FixedMap, GroundMap
from airground.localization.height_map_pair import HeightMapPair
from airground.localization.particle_filter import MonteCarloLocalizer
from airground.localization.pose_errors import PoseErrors
from airground.refinement import refine
from airground.slam.front_end import TrackedPose, Tracking
from airground.slam.straight_images import StraightImages
from airground.tracking import TrackedFrame

NO_POSE = "no pose: a robot was lost, or had no map yet"
NO_HEADING = "no heading: the magnetometers do not agree on one, and it is not searched"


class Mapping:
    """The middle of Figure 4: what both robots' maps hold, made from tracked frames."""

    def __init__(self, config: Config, mav: RobotCalibration, ground: RobotCalibration) -> None:
        self._dense = DenseReconstruction(mav.camera, config)
        self._north: dict[Source, float | None] = {Source.MAV: None, Source.GROUND: None}
        self._correction: Trajectory | None = None
        self._straight = {
            Source.MAV: StraightImages(mav),
            Source.GROUND: StraightImages(ground),
        }
        self.ground_map: GroundMap | FixedMap = GroundMap(ground.camera, config.ground_mapping)
        self._ground_scale_sigma = ground.sigmas.depth_scale
        self._poses: dict[Source, TrackedPose] = {}
        self._max_scale_sigma = config.view_selection.max_scale_sigma
        self._scaled = False

    def reserve(self) -> None:
        """Take the largest working memory from the system, so that no frame waits for it."""
        self._dense.reserve()

    def take(self, frame: TrackedFrame) -> Iterator[Event]:
        """Take in one frame; those of both robots come in order of time."""
        robot, pose, stamp_ns = frame.robot, frame.pose, frame.stamp_ns
        self._north[robot], self._poses[robot] = frame.north_rad, pose
        if robot == Source.GROUND:
            self.correct_ground(frame.trajectory)
        straight = self._straight[robot]
        straight.follow(stamp_ns, pose)
        if pose.T_map_camera is None:
            if pose.tracking is Tracking.INITIALIZING:
                self._scaled &= robot != Source.MAV  # what comes is another map
                yield Initializing(pose.stamp_ns, robot)
            else:
                yield TrackingLost(pose.stamp_ns, robot)
            return
        scale_sigma = None if pose.scale is None else pose.scale.sigma
        tracked = (stamp_ns, pose.T_map_camera, pose.covariance, scale_sigma)
        yield MavTracked(*tracked) if robot == Source.MAV else GroundTracked(*tracked)
        if pose.corrected:
            yield PosesCorrected(stamp_ns, robot)
        match frame.image:
            case MavImage() as image:
                # A scale that was known stays with the map.
                self._scaled |= scale_sigma is None or scale_sigma <= self._max_scale_sigma
                if self._scaled:
                    grey, T_mav_camera = straight.mav(image, pose.depth_range), pose.T_map_camera
                    yield from self._dense.add(stamp_ns, grey, T_mav_camera, pose.depth_range)
            case GroundImage() as keyframe if self.ground_map.wants(pose.T_map_camera):
                self.ground_map.add(straight.ground(keyframe), pose.T_map_camera)
                yield GroundMapExtended(stamp_ns, self.ground_map.keyframes)

    def correct_ground(self, trajectory: Trajectory | None) -> None:
        """The ground robot now believes in these poses of its images; None changes nothing."""
        if trajectory is not None:
            self._correction = trajectory

    def flush(self) -> Iterator[Event]:
        """Finish what is under construction at the end of a recording."""
        yield from self._dense.flush()

    def ground_cloud(self) -> PointCloud:
        """The ground robot's map in the frame `ground`, at the poses of its last correction."""
        if self._correction is not None:
            self.ground_map.follow(self._correction)
            self._correction = None
        return self.ground_map.cloud()

    def relative_heading(self) -> float | None:
        """Turn of the frame `mav` in `ground` by the magnetometers [rad], None before both know."""
        mav, ground = self._north[Source.MAV], self._north[Source.GROUND]
        if mav is None or ground is None:
            return None
        return float(np.angle(np.exp(1j * (ground - mav))))

    def sight(self, surface: AerialSurface) -> Sighting | None:
        """Snapshot of both maps for a surface that was just cast; None while a robot is lost."""
        mav, ground = self._poses.get(Source.MAV), self._poses.get(Source.GROUND)
        if mav is None or mav.T_map_camera is None or ground is None or ground.T_map_camera is None:
            return None
        return Sighting(
            surface,
            self.ground_cloud(),
            mav.stamp_ns,
            mav.T_map_camera,
            ground.stamp_ns,
            ground.T_map_camera,
            self.relative_heading(),
            mav.covariance,
            ground.covariance,
            self._ground_scale_sigma,
        )


class Pipeline:
    """Figure 4 above tracking: map, locate one robot in the other's map, refine, augment.

    Args:
        config: The pipeline's parameters.
        mav, ground: Nominal calibration of each robot.
        rng: Source of all random numbers.
        T_ground_mav_prior: Prior pose that replaces the global search (Sec. III).
    """

    def __init__(
        self,
        config: Config,
        mav: RobotCalibration,
        ground: RobotCalibration,
        rng: np.random.Generator,
        T_ground_mav_prior: SE3 | None = None,
    ) -> None:
        self._config = config
        self.mapping = Mapping(config, mav, ground)
        self._localizer = MonteCarloLocalizer(config, rng)
        self._augmentation = Augmentation(config.ground_mapping.voxel_m)
        self._T_ground_mav = T_ground_mav_prior
        self._has_prior = T_ground_mav_prior is not None

    def run(self, frames: Iterable[TrackedFrame]) -> Iterator[Event]:
        """Process frames in time order; yields every stage's event as it finishes."""
        for frame in frames:
            for event in self.mapping.take(frame):
                yield from self._react(event)
        for event in self.mapping.flush():
            yield from self._react(event)

    def augmented_map(self) -> AugmentedMap:
        """The ground map with everything that was aligned so far."""
        return self._augmentation.map(self.mapping.ground_cloud())

    def _react(self, event: Event) -> Iterator[Event]:
        yield event
        if isinstance(event, SurfaceCast):
            sighting = self.mapping.sight(event.surface)
            if sighting is None:
                yield NotLocated(event.stamp_ns, NO_POSE)
                return
            yield Sighted(event.stamp_ns, sighting)
            yield from self.locate_and_augment(sighting)

    def locate_and_augment(self, sighting: Sighting) -> Iterator[Event]:
        """Localization, refinement and augmentation of one aerial surface."""
        # Global localization (Sec. VI), unless a prior pose was given.
        if not self._has_prior:
            if self._config.localization.heading != "search" and sighting.heading is None:
                yield NotLocated(sighting.surface.stamp_ns, NO_HEADING)
                return
            yield from locate(self._localizer, sighting)
            belief = self._localizer.belief
            self._T_ground_mav = belief.T_ground_mav if belief and belief.converged else None
        if self._T_ground_mav is None:
            return

        # Pose refinement (Sec. VII).
        surface = sighting.surface
        alignment = refine(
            surface.stamp_ns,
            self._T_ground_mav,
            surface.cloud_mav,
            sighting.ground_cloud,
            self._config,
            claimed=not self._has_prior,
        )
        yield Aligned(surface.stamp_ns, alignment)
        if not alignment.accepted:
            return
        self._T_ground_mav = alignment.T_ground_mav

        # Map augmentation.
        self._augmentation.add(surface, alignment.T_ground_mav)
        yield MapAugmented(surface.stamp_ns, moved(surface.cloud_mav, alignment.T_ground_mav))


def locate(localizer: MonteCarloLocalizer, sighting: Sighting) -> Iterator[Event]:
    """Feed one sighting to a localizer (Sec. VI)."""
    yield from localizer.update(pair_of(sighting, localizer.config))


def pair_of(sighting: Sighting, config: Config) -> HeightMapPair:
    """What localizers under these parameters need of a sighting."""
    return HeightMapPair(
        sighting.surface.stamp_ns,
        sighting.surface.cloud_mav.points,
        sighting.surface.T_mav_camera.translation,
        sighting.ground_cloud.points,
        sighting.T_ground_camera.translation[:2],
        sighting.heading,
        config,
        pose_errors_of(sighting),
    )


def pose_errors_of(sighting: Sighting) -> PoseErrors:
    """How well both robots' poses, and the ground map's scale, were known when a surface was
    finished."""
    surface = sighting.surface
    # Column by column: ten times as fast as one mean over the first axis.
    middle = [column.mean(dtype=np.float64) for column in surface.cloud_mav.points.T]
    return PoseErrors(
        surface.T_mav_camera.translation - middle,
        _turns(sighting.covariance_mav),
        _turns(sighting.covariance_ground),
        sighting.T_ground_camera.translation,
        sighting.ground_scale_sigma,
    )


def _turns(covariance: F64 | None) -> F64:
    """(3, 3) of the rotation in a pose's covariance; nothing where none is stated."""
    return np.zeros((3, 3)) if covariance is None else covariance[3:, 3:]


def moved(cloud: PointCloud, T_a_b: SE3) -> PointCloud:
    """A cloud in frame b, expressed in frame a."""
    normals = None
    if cloud.normals is not None:
        normals = (cloud.normals @ T_a_b.rotation.T).astype(np.float32)
    return PointCloud((T_a_b @ cloud.points).astype(np.float32), cloud.colours, normals)
