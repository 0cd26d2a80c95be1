"""A recording of a simulated flight on disk: both robots, checked when it is opened."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from airground.core.cloud import Source
from airground.errors import RecordingError
from airground.io.header import Header
from airground.io.image_files import ImageSource
from airground.io.recording_folder import RecordingFolder, check_digests
from airground.io.robot_recording import Pair


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
        folder = RecordingFolder.open(path, images)
        if len(folder.robots) < len(Source):
            raise RecordingError(
                f"{folder.path}: holds the {folder.names} alone; expected a recording of both "
                "robots, which simulate makes without --only (track takes one robot)"
            )
        mav, ground = folder.of(Source.MAV), folder.of(Source.GROUND)
        return cls(mav, ground, folder.path, folder.header, folder.images)

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
        check_digests(self.path, self.header)
