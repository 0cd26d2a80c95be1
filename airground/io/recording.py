"""A recording on disk, checked when opened and read as a stream of messages."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from airground.core.cloud import Source
from airground.core.messages import (
    GroundImage,
    ImuSamples,
    MagneticSamples,
    MavImage,
    RobotCalibration,
    Stamped,
)
from airground.core.work_ahead import read_ahead
from airground.errors import RecordingError
from airground.io import layout
from airground.io.digests import path_digest
from airground.io.euroc import read_image_list, read_imu, read_magnetic
from airground.io.header import Header, read_header
from airground.io.image_source import ImageFiles, ImageSource
from airground.io.images import warm_up_images
from airground.io.listed_files import listed_files
from airground.io.message_order import bundles
from airground.io.plausibility import (
    CAMERA_STEP_S,
    IMU_STEP_S,
    check_imu_covers,
    check_stamp_unit,
    check_up_in_body,
    upwards,
)
from airground.io.tum import read_associations

NOTHING: Mapping[Source, Collection[int]] = MappingProxyType({})
BOTH = (Source.GROUND, Source.MAV)
"""In the order of their messages where these are of the same time."""


@dataclass(frozen=True, eq=False)
class Recording:
    """What both robots sensed, without the truth.

    Inertial and magnetic samples are read when the recording is opened (about 15 kB a
    second of recording); images one by one when they are asked for.

    Attributes:
        path: The recording's folder.
        header: What `recording.toml` says.
        mav, ground: The calibration that the pipeline is told.
        mav_camera_stamps, ground_camera_stamps: (N,) int64 of the images [ns].
        mav_imu, ground_imu: All inertial samples.
        mav_magnetic, ground_magnetic: All magnetometer samples.
        images: Gives the images.
    """

    path: Path
    header: Header
    mav: RobotCalibration
    ground: RobotCalibration
    mav_camera_stamps: NDArray[np.int64]
    ground_camera_stamps: NDArray[np.int64]
    mav_imu: ImuSamples
    ground_imu: ImuSamples
    mav_magnetic: MagneticSamples
    ground_magnetic: MagneticSamples
    images: ImageSource

    @classmethod
    def open(cls, path: Path | str, images: ImageSource | None = None) -> Recording:
        """Open a recording and check everything but the contents of its images.

        Args:
            path: The recording's folder.
            images: Where its images come from; its own files if None.

        Raises:
            RecordingError: One line that names file, key or stamp and what would be right.
        """
        path = Path(path)
        if not path.is_dir():
            raise RecordingError(f"{path}: no such recording (a folder with {layout.HEADER})")
        header = read_header(path / layout.HEADER)
        mav_stamps, mav_names = read_image_list(path / layout.MAV_CAMERA_LIST)
        pairs = path / layout.GROUND_ASSOCIATIONS
        ground_stamps, colour_names, depth_names = read_associations(pairs)
        _check_count(path / layout.MAV_CAMERA_LIST, len(mav_stamps), header.frames.mav)
        _check_count(pairs, len(ground_stamps), header.frames.ground)
        mav, ground = header.calibration.mav, header.calibration.ground
        if images is None:
            images = ImageFiles(
                mav_files=tuple(
                    listed_files(path / layout.MAV_IMAGES, mav_names, path / layout.MAV_CAMERA_LIST)
                ),
                ground_colour_files=tuple(listed_files(path / "ground", colour_names, pairs)),
                ground_depth_files=tuple(listed_files(path / "ground", depth_names, pairs)),
                mav_camera=mav.camera.pinhole(),
                ground_camera=ground.camera.pinhole(),
                depth_units_per_m=ground.depth.units_per_m,
            )
            images.check_present()
            warm_up_images()  # so that no image waits for the compiler
        recording = cls(
            path=path,
            header=header,
            mav=mav.calibration(),
            ground=ground.calibration(),
            mav_camera_stamps=_frozen(mav_stamps),
            ground_camera_stamps=_frozen(ground_stamps),
            mav_imu=read_imu(path / layout.MAV_IMU_DATA),
            ground_imu=read_imu(path / layout.GROUND_IMU_DATA),
            mav_magnetic=read_magnetic(path / layout.MAV_MAGNETOMETER_DATA),
            ground_magnetic=read_magnetic(path / layout.GROUND_MAGNETOMETER_DATA),
            images=images,
        )
        recording._check_samples()
        # The first of each camera must fit its calibration.
        recording.read_mav_image(0)
        recording.read_ground_image(0)
        return recording

    @property
    def scene(self) -> str:
        return self.header.scene

    @property
    def seed(self) -> int:
        return self.header.seed

    @property
    def flight(self) -> int:
        return self.header.flight

    @property
    def sensors(self) -> str:
        """Name of the sensor preset."""
        return self.header.sensors

    @property
    def duration_s(self) -> float:
        return self.header.duration_s

    @property
    def depth_units_per_m(self) -> float:
        """PNG value of one metre of depth, as the pipeline is told."""
        return self.header.calibration.ground.depth.units_per_m

    def messages(
        self,
        dropped: Mapping[Source, Collection[int]] = NOTHING,
        robots: Sequence[Source] = BOTH,
    ) -> Iterator[Stamped]:
        """Every message in order of time.

        Before each image come the inertial and magnetic samples since the previous image
        of the same robot, one message each unless there are none.

        Args:
            dropped: Stamps [ns] of images to leave out, as if the robot had been too busy for
                them; their samples come before the next image.
            robots: Whose messages; of two at the same time those of the first come first.

        Raises:
            RecordingError: An image cannot be read or does not fit the calibration.
        """
        with ThreadPoolExecutor(1) as pool:
            streams = (
                bundles(
                    robot, self._images(robot, dropped.get(robot, ()), pool), *self.samples(robot)
                )
                for robot in robots
            )
            for _, bundle in heapq.merge(*streams, key=lambda stamped_bundle: stamped_bundle[0]):
                yield from bundle

    def calibration(self, robot: Source) -> RobotCalibration:
        """What the pipeline is told about a robot's sensors."""
        return self.mav if robot == Source.MAV else self.ground

    def stamps_ns(self, robot: Source) -> NDArray[np.int64]:
        """(N,) stamps of a robot's images [ns]."""
        return self.mav_camera_stamps if robot == Source.MAV else self.ground_camera_stamps

    def samples(self, robot: Source) -> tuple[ImuSamples, MagneticSamples]:
        """All that a robot's other sensors measured."""
        if robot == Source.MAV:
            return self.mav_imu, self.mav_magnetic
        return self.ground_imu, self.ground_magnetic

    def read_image(self, robot: Source, index: int) -> MavImage | GroundImage:
        """A robot's image at an index in its `stamps_ns`."""
        if robot == Source.MAV:
            return self.read_mav_image(index)
        return self.read_ground_image(index)

    def _images(
        self, robot: Source, dropped: Collection[int], pool: ThreadPoolExecutor
    ) -> Iterator[MavImage | GroundImage]:
        stamps = self.stamps_ns(robot).tolist()
        kept = [index for index, stamp in enumerate(stamps) if stamp not in dropped]
        return read_ahead(pool, partial(self.read_image, robot), kept)

    def mav_images(self) -> Iterator[MavImage]:
        for index in range(len(self.mav_camera_stamps)):
            yield self.read_mav_image(index)

    def ground_images(self) -> Iterator[GroundImage]:
        for index in range(len(self.ground_camera_stamps)):
            yield self.read_ground_image(index)

    def mav_image_at(self, stamp_ns: int) -> MavImage:
        """The MAV's image with this stamp; ValueError if there is none."""
        return self.read_mav_image(_index_of(self.mav_camera_stamps, stamp_ns))

    def ground_image_at(self, stamp_ns: int) -> GroundImage:
        """The ground robot's image with this stamp; ValueError if there is none."""
        return self.read_ground_image(_index_of(self.ground_camera_stamps, stamp_ns))

    def read_mav_image(self, index: int) -> MavImage:
        """The MAV's image at an index in `mav_camera_stamps`."""
        return MavImage(int(self.mav_camera_stamps[index]), self.images.mav(index))

    def read_ground_image(self, index: int) -> GroundImage:
        """The ground robot's image at an index in `ground_camera_stamps`."""
        colour, depth = self.images.ground(index)
        return GroundImage(int(self.ground_camera_stamps[index]), colour, depth)

    def verify(self) -> None:
        """Compare every file with the digests in `recording.toml`.

        Raises:
            RecordingError: Names the first file or image folder that differs.
        """
        digests = self.header.digests
        places = listed_files(self.path, digests, self.path / layout.HEADER)
        for place, digest in zip(places, digests.values(), strict=True):
            if not place.exists():
                raise RecordingError(f"{place}: is missing from the recording")
            if path_digest(place) != digest:
                raise RecordingError(
                    f"{place}: differs from what was recorded (its SHA-256 in {layout.HEADER})"
                )

    def _check_samples(self) -> None:
        """Stamps are in their unit, inertial samples cover the images, gravity points down."""
        robots = (
            (self.mav, self.mav_camera_stamps, self.mav_imu, layout.MAV_IMU_DATA),
            (self.ground, self.ground_camera_stamps, self.ground_imu, layout.GROUND_IMU_DATA),
        )
        units = ("nanoseconds", "seconds")
        lists = (layout.MAV_CAMERA_LIST, layout.GROUND_ASSOCIATIONS)
        for (told, stamps, imu, imu_name), unit, name in zip(robots, units, lists, strict=True):
            imu_file = self.path / imu_name
            check_stamp_unit(stamps, self.path / name, unit, CAMERA_STEP_S)
            check_stamp_unit(imu.stamps_ns, imu_file, "nanoseconds", IMU_STEP_S)
            check_imu_covers(imu, imu_file, stamps, told.camera_time_offset_ns)
            check_up_in_body(told.T_body_imu.rotation @ upwards(imu, imu_file), imu_file)


def _check_count(path: Path, listed: int, told: int) -> None:
    if listed != told:
        raise RecordingError(f"{path}: lists {listed} images, {layout.HEADER} says {told}")


def _frozen(stamps: NDArray[np.int64]) -> NDArray[np.int64]:
    stamps.flags.writeable = False
    return stamps


def _index_of(stamps: NDArray[np.int64], stamp_ns: int) -> int:
    index = int(np.searchsorted(stamps, stamp_ns))
    if index == len(stamps) or stamps[index] != stamp_ns:
        raise ValueError(f"no image has the stamp {stamp_ns}")
    return index
