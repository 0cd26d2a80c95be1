"""A recording's folder on disk: one robot or both, checked when it is opened."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from airground.core.arrays import I64
from airground.core.cloud import Source
from airground.core.messages import GroundImage, MavImage
from airground.errors import RecordingError
from airground.io import layout
from airground.io.calibration import RobotTable
from airground.io.digests import path_digest
from airground.io.euroc import read_image_list, read_imu, read_magnetic
from airground.io.folder_links import check_links
from airground.io.header import NAMES, Header, read_header
from airground.io.image_files import ImageFiles, ImageSource, ListedFiles, listed_files
from airground.io.images import warm_up_images
from airground.io.lens import Undistortion
from airground.io.plausibility import (
    CAMERA_STEP_S,
    IMU_STEP_S,
    check_imu_covers,
    check_stamp_unit,
    check_up_in_body,
    upwards,
)
from airground.io.registration import warm_up_registration
from airground.io.robot_recording import Image, RobotRecording, check_same_clock
from airground.io.tum import read_associations

_WITH_DIGESTS = {
    "mav": (
        *(layout.MAV_CAMERA_LIST, layout.MAV_IMAGES),
        *(layout.MAV_IMU_DATA, layout.MAV_MAGNETOMETER_DATA),
    ),
    "ground": (
        *(layout.GROUND_ASSOCIATIONS, layout.GROUND_COLOUR, layout.GROUND_DEPTH),
        *(layout.GROUND_IMU_DATA, layout.GROUND_MAGNETOMETER_DATA),
    ),
}
"""What is read of a recording, by robot; the header has a digest of each."""


@dataclass(frozen=True, eq=False)
class RecordingFolder:
    """What the robots in a recording's folder sensed, without the truth.

    Inertial and magnetic samples are read when the recording is opened (about 15 kB per
    second of recording); images are read one by one, when they are needed.

    Attributes:
        path: The folder.
        header: Its header.
        images: Source of the images.
        robots: The robots that were recorded.
    """

    path: Path
    header: Header
    images: ImageSource
    robots: Mapping[Source, RobotRecording[Any]]

    @classmethod
    def open(cls, path: Path | str, images: ImageSource | None = None) -> RecordingFolder:
        """Open a recording and check everything but the contents of its images.

        Args:
            path: The recording's folder.
            images: Source of the images; the recording's own files by default.

        Raises:
            RecordingError: One line that names file, key or stamp and what would be right.
        """
        path = Path(path)
        if not path.is_dir():
            raise RecordingError(f"{path}: no such recording (a folder with {layout.HEADER})")
        check_links(path)
        header = read_header(path / layout.HEADER)
        mav_stamps, mav_files = _mav_images(path, header.frames.mav)
        ground_stamps, colour_files, depth_files = _ground_images(path, header.frames.ground)
        mav, ground = header.calibration.mav, header.calibration.ground
        if images is None:
            images = ImageFiles(
                mav_files=mav_files,
                ground_colour_files=colour_files,
                ground_depth_files=depth_files,
                mav_camera=mav.camera.lens().pinhole(),
                ground_camera=ground.camera.lens().pinhole(),
                depth_units_per_m=ground.depth.units_per_m,
                registration=ground.registration(),
            )
            images.check_present()
            warm_up_images()  # so that no image waits for the compiler
            if images.registration is not None:
                warm_up_registration()
        source = images
        of_mav, of_ground = Undistortion(mav.camera.lens()), Undistortion(ground.camera.lens())

        def read_mav_image(index: int) -> MavImage:
            return MavImage(int(mav_stamps[index]), of_mav.image(source.mav(index)))

        def read_ground_image(index: int) -> GroundImage:
            colour, depth = source.ground(index)
            straight = of_ground.image(colour), of_ground.depth(depth)
            return GroundImage(int(ground_stamps[index]), *straight)

        robots: dict[Source, RobotRecording[Any]] = {}
        if header.frames.mav:
            robots[Source.MAV] = _robot(path, Source.MAV, mav, mav_stamps, read_mav_image)
        if header.frames.ground:
            robots[Source.GROUND] = _robot(
                path, Source.GROUND, ground, ground_stamps, read_ground_image
            )
        folder = cls(path, header, images, robots)
        folder._check_samples()
        for robot in robots.values():
            robot.read_image(0)  # the first image of each camera must fit its calibration
        if len(robots) > 1:
            check_same_clock(robots[Source.MAV], robots[Source.GROUND])
        return folder

    def of(self, robot: Source) -> RobotRecording[Any]:
        """What a robot sensed; RecordingError if it was not recorded."""
        if robot not in self.robots:
            raise RecordingError(
                f"{self.path}: holds the {self.names}, not the {NAMES[robot.name.lower()]}; "
                "expected one that simulate made without --only, or --only "
                f"{robot.name.lower()}"
            )
        return self.robots[robot]

    @property
    def names(self) -> str:
        """The robots that were recorded, in words."""
        return " and ".join(NAMES[robot] for robot in self.header.frames.robots())

    def verify(self) -> None:
        """As `check_digests`."""
        check_digests(self.path, self.header)

    def _check_samples(self) -> None:
        """Stamps have the right unit, inertial samples cover the images, gravity points down."""
        for source, unit, camera_list, imu_name in (
            (Source.MAV, "nanoseconds", layout.MAV_CAMERA_LIST, layout.MAV_IMU_DATA),
            (Source.GROUND, "seconds", layout.GROUND_ASSOCIATIONS, layout.GROUND_IMU_DATA),
        ):
            if source not in self.robots:
                continue
            robot = self.robots[source]
            imu, imu_file, nominal = robot.imu, self.path / imu_name, robot.calibration
            assert imu is not None
            check_stamp_unit(robot.camera_stamps, self.path / camera_list, unit, CAMERA_STEP_S)
            check_stamp_unit(imu.stamps_ns, imu_file, "nanoseconds", IMU_STEP_S)
            self._check_within(robot.camera_stamps, self.path / camera_list)
            check_imu_covers(imu, imu_file, robot.camera_stamps, nominal.camera_time_offset_ns)
            check_up_in_body(nominal.T_body_imu.rotation @ upwards(imu, imu_file), imu_file)

    def _check_within(self, stamps_ns: I64, path: Path) -> None:
        """Stamps count from the start of the recording, and do not reach beyond its end."""
        first_s, last_s = float(stamps_ns[0]) / 1e9, float(stamps_ns[-1]) / 1e9
        if first_s < 0 or last_s > self.header.duration_s:
            raise RecordingError(
                f"{path}: images from {first_s:.3f} to {last_s:.3f} s; expected from 0 to "
                f"{self.header.duration_s:.3f} s, the duration in {layout.HEADER}"
            )


def check_digests(path: Path, header: Header) -> None:
    """RecordingError names the first file or image folder of a recording unlike its digest in the
    header, or without one."""
    places = listed_files(path, header.digests, path / layout.HEADER)
    robots = [_WITH_DIGESTS[robot] for robot in header.frames.robots()]
    bare = next((name for names in robots for name in names if name not in header.digests), None)
    if bare is not None:
        raise RecordingError(f"{path / layout.HEADER}: key 'digests': that of '{bare}' is missing")
    for place, digest in zip(places, header.digests.values(), strict=True):
        if not place.exists():
            raise RecordingError(f"{place}: is missing from the recording")
        if path_digest(place) != digest:
            raise RecordingError(
                f"{place}: differs from what was recorded (its SHA-256 in {layout.HEADER})"
            )


def _mav_images(path: Path, stated: int) -> tuple[I64, ListedFiles]:
    """Stamps and files of the MAV's images; none where it was not recorded."""
    if stated == 0:
        _check_absent(path / layout.MAV)
        return np.zeros(0, np.int64), ListedFiles(path, ())
    listing = path / layout.MAV_CAMERA_LIST
    stamps, names = read_image_list(listing)
    _check_count(listing, len(stamps), stated)
    return stamps, listed_files(path / layout.MAV_IMAGES, names, listing)


def _ground_images(path: Path, stated: int) -> tuple[I64, ListedFiles, ListedFiles]:
    """Stamps and files of the ground robot's colour and depth images; none where it was not
    recorded."""
    if stated == 0:
        _check_absent(path / layout.GROUND)
        return np.zeros(0, np.int64), ListedFiles(path, ()), ListedFiles(path, ())
    listing = path / layout.GROUND_ASSOCIATIONS
    stamps, colour, depth = read_associations(listing)
    _check_count(listing, len(stamps), stated)
    folder = path / layout.GROUND
    return stamps, listed_files(folder, colour, listing), listed_files(folder, depth, listing)


def _robot(
    path: Path, robot: Source, table: RobotTable, stamps: I64, read_image: Callable[[int], Image]
) -> RobotRecording[Image]:
    is_mav, calibration = robot == Source.MAV, table.calibration()
    magnetometer = layout.MAV_MAGNETOMETER_DATA if is_mav else layout.GROUND_MAGNETOMETER_DATA
    return RobotRecording(
        path=path,
        layout="airground",
        robot=robot,
        calibration=calibration,
        camera_stamps=stamps,
        imu=read_imu(path / (layout.MAV_IMU_DATA if is_mav else layout.GROUND_IMU_DATA)),
        magnetic=read_magnetic(path / magnetometer),
        read_image=read_image,
        pose_frame="body",
        T_pose_camera=calibration.T_body_imu @ calibration.T_imu_camera,
    )


def _check_count(path: Path, listed: int, stated: int) -> None:
    if listed != stated:
        raise RecordingError(f"{path}: lists {listed} images, {layout.HEADER} says {stated}")


def _check_absent(folder: Path) -> None:
    if folder.exists():
        raise RecordingError(f"{folder}: is there, {layout.HEADER} says 0 images of this robot")
