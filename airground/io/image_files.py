"""Where the images of a recording come from: its files, or a renderer."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Protocol, overload

from airground.core.arrays import F32, U8
from airground.core.camera import PinholeCamera
from airground.errors import RecordingError
from airground.io.images import depth_units, read_colour, read_depth, read_grey, read_image_bytes
from airground.io.png_encoder import encode_png
from airground.io.registration import Registration


class ImageSource(Protocol):
    """Gives the images of both robots by their index in the recording's stamps."""

    def mav(self, index: int) -> U8:
        """(height, width) grey."""
        ...

    def ground(self, index: int) -> tuple[U8, F32]:
        """(height, width, 3) RGB and (height, width) depth of its pixels [m], NaN where missing."""
        ...


@dataclass(frozen=True)
class ListedFiles(Sequence[Path]):
    """Files below `folder` by their `names` in a list. Each path is made when it is asked for: as
    objects, those of an hour's images take 100 MB, and each that was opened takes more."""

    folder: Path
    names: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.names)

    @overload
    def __getitem__(self, index: int) -> Path: ...
    @overload
    def __getitem__(self, index: slice) -> list[Path]: ...
    def __getitem__(self, index: int | slice) -> Path | list[Path]:
        if isinstance(index, slice):
            return [self.folder / name for name in self.names[index]]
        return self.folder / self.names[index]


@dataclass(frozen=True)
class ImageFiles:
    """Images on disk, each read when it is needed.

    Attributes:
        mav_files, ground_colour_files, ground_depth_files: Files in order of time.
        mav_camera, ground_camera: Cameras, whose size the images must have.
        depth_units_per_m: PNG value of one metre of depth.
        registration: Moves depth to the colour camera's pixels; None where the files hold it so.
    """

    mav_files: Sequence[Path]
    ground_colour_files: Sequence[Path]
    ground_depth_files: Sequence[Path]
    mav_camera: PinholeCamera
    ground_camera: PinholeCamera
    depth_units_per_m: float
    registration: Registration | None = None

    def mav(self, index: int) -> U8:
        return read_grey(self.mav_files[index], self.mav_camera.width, self.mav_camera.height)

    def ground(self, index: int) -> tuple[U8, F32]:
        size = self.ground_camera.width, self.ground_camera.height
        colour = read_colour(self.ground_colour_files[index], *size)
        return colour, self.ground_depth(index)

    def ground_depth(self, index: int) -> F32:
        """(height, width) depth of the colour image's pixels alone [m], NaN where missing."""
        size = self.ground_camera.width, self.ground_camera.height
        if self.registration is not None:
            size = self.registration.depth_size
        depth = read_depth(self.ground_depth_files[index], *size, self.depth_units_per_m)
        return depth if self.registration is None else self.registration.registered(depth)

    def depth_png(self, index: int) -> bytes:
        """A file of depth of the colour image's pixels, in the recording's unit: the recording's
        own where it is registered."""
        if self.registration is None:
            return read_image_bytes(self.ground_depth_files[index])
        return encode_png(depth_units(self.ground_depth(index), self.depth_units_per_m))

    def check_present(self) -> None:
        """Raises RecordingError naming the first file that is missing."""
        for files in (self.mav_files, self.ground_colour_files, self.ground_depth_files):
            present = {file for folder in {f.parent for f in files} for file in _listing(folder)}
            for file in files:
                if file not in present:
                    raise RecordingError(f"{file}: this image is listed but missing")


def _listing(folder: Path) -> list[Path]:
    try:
        return list(folder.iterdir())
    except OSError as error:
        raise RecordingError(f"{folder}: cannot be listed: {error.strerror}") from None


def listed_files(folder: Path, names: Iterable[str], list_path: Path) -> ListedFiles:
    """The files below `folder` that the list at `list_path` names.
    RecordingError if a name leads out of the folder."""
    kept = tuple(names)
    for name in kept:
        path = PurePosixPath(name)
        if path.is_absolute() or ".." in path.parts or "\0" in name:
            raise RecordingError(
                f"{list_path}: the file name {name[:60]!r} leads out of the recording; expected "
                "one below the folder, without '..'"
            )
    return ListedFiles(folder, kept)
