"""A recording of a simulated flight on disk: both robots, checked when it is opened."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from airground.core.arrays import I64
from airground.core.cloud import Source
from airground.core.messages import GroundImage, MavImage
from airground.errors import RecordingError
from airground.io import layout
from airground.io.calibration import RobotTable
from airground.io.digests import path_digest
from airground.io.euroc import read_image_list, read_imu, read_magnetic
from airground.io.header import Header, read_header
from airground.io.image_files import ImageFiles, ImageSource, listed_files
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
from airground.io.robot_recording import Image, Pair, RobotRecording
from airground.io.tum import read_associations


@dataclass(frozen=True, eq=False)
class Recording(Pair):
    """What both robots sensed, without the truth.

    Inertial and magnetic samples are read when the recording is opened (about 15 kB per
    second of recording); images are read one by one, when they are needed."""

    path: Path
    header: Header
    images: ImageSource

    @classmethod
    def open(cls, path: Path | str, images: ImageSource | None = None) -> Recording:
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
        header = read_header(path / layout.HEADER)
        mav_list, ground_list = path / layout.MAV_CAMERA_LIST, path / layout.GROUND_ASSOCIATIONS
        mav_stamps, mav_names = read_image_list(mav_list)
        ground_stamps, colour_names, depth_names = read_associations(ground_list)
        _check_count(mav_list, len(mav_stamps), header.frames.mav)
        _check_count(ground_list, len(ground_stamps), header.frames.ground)
        mav, ground = header.calibration.mav, header.calibration.ground
        if images is None:
            images = ImageFiles(
                mav_files=listed_files(path / layout.MAV_IMAGES, mav_names, mav_list),
                ground_colour_files=listed_files(path / "ground", colour_names, ground_list),
                ground_depth_files=listed_files(path / "ground", depth_names, ground_list),
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

        recording = cls(
            _robot(path, Source.MAV, mav, mav_stamps, read_mav_image),
            _robot(path, Source.GROUND, ground, ground_stamps, read_ground_image),
            path,
            header,
            images,
        )
        recording._check_samples()
        # The first image of each camera must fit its calibration.
        read_mav_image(0)
        read_ground_image(0)
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
        """Nominal PNG value of one metre of depth."""
        return self.header.calibration.ground.depth.units_per_m

    def verify(self) -> None:
        """RecordingError names the first file or image folder unlike its digest in the header."""
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
        """Stamps have the right unit, inertial samples cover the images, gravity points down."""
        for robot, unit, camera_list, imu_name in (
            (self.mav, "nanoseconds", layout.MAV_CAMERA_LIST, layout.MAV_IMU_DATA),
            (self.ground, "seconds", layout.GROUND_ASSOCIATIONS, layout.GROUND_IMU_DATA),
        ):
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
        if first_s < 0 or last_s > self.duration_s:
            raise RecordingError(
                f"{path}: images from {first_s:.3f} to {last_s:.3f} s; expected from 0 to "
                f"{self.duration_s:.3f} s, the duration in {layout.HEADER}"
            )


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
