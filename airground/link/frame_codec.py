"""A tracked frame as a message: a header in JSON, then one block of bytes per array.

Numbers and images are exact; on demand the MAV's images are compressed as JPEG for its radio."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from airground.core.arrays import U8
from airground.core.cloud import Source
from airground.core.messages import GroundImage, MavImage
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.errors import InputError
from airground.slam.front_end import ScaleEstimate, TrackedPose, Tracking
from airground.tracking import TrackedFrame

JPEG = "jpeg"
TYPES = ("|u1", "<f4", "<f8", "<i8")
"""Element types that an array may have."""
PATH = ("path_stamps_ns", "path_rotations", "path_translations")
"""Names of a trajectory's arrays."""

Parts = list[bytes]


def pack(frame: TrackedFrame, jpeg_quality: int | None = None) -> Parts:
    """The message of a frame; the MAV's image is a JPEG of that quality (1 to 100), if given."""
    pose, image = frame.pose, frame.image
    scale = None if pose.scale is None else (pose.scale.sigma, pose.scale.observable)
    header = {
        "robot": frame.robot.name,
        "stamp_ns": frame.stamp_ns,
        "tracking": pose.tracking.value,
        "scale": scale,
        "depth_range": pose.depth_range,
        "corrected": pose.corrected,
        "north_rad": frame.north_rad,
    }
    arrays: dict[str, NDArray[Any]] = {}
    if isinstance(image, GroundImage):
        arrays |= {"colour": image.colour, "depth": image.depth}
    elif jpeg_quality is None:
        arrays["image"] = image.image
    else:
        arrays[JPEG] = np.frombuffer(_jpeg(image.image, jpeg_quality), np.uint8)
    if pose.T_map_camera is not None:
        arrays["rotation"] = pose.T_map_camera.rotation
        arrays["translation"] = pose.T_map_camera.translation
    if pose.covariance is not None:
        arrays["covariance"] = pose.covariance
    return _message(header, arrays | _trajectory_arrays(frame.trajectory))


def unpack(parts: Sequence[bytes]) -> TrackedFrame:
    """The frame of a message; InputError if it is none from `pack`."""
    try:
        header, arrays = _parse(parts)
        return _frame(header, arrays)
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise InputError(f"link: not a tracked frame ({error!r})") from None


def pack_trajectory(trajectory: Trajectory | None) -> Parts:
    """The message of a trajectory; None is kept."""
    return _message({}, _trajectory_arrays(trajectory))


def unpack_trajectory(parts: Sequence[bytes]) -> Trajectory | None:
    """Raises InputError where the message is none from `pack_trajectory`."""
    try:
        return _trajectory(_parse(parts)[1])
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise InputError(f"link: not a trajectory ({error!r})") from None


def as_received(image: MavImage, jpeg_quality: int) -> MavImage:
    """An image as it is after the link compressed it."""
    return MavImage(image.stamp_ns, _from_jpeg(_jpeg(image.image, jpeg_quality)))


def _frame(header: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> TrackedFrame:
    stamp_ns = int(header["stamp_ns"])
    image: MavImage | GroundImage
    if Source[header["robot"]] == Source.GROUND:
        image = GroundImage(stamp_ns, arrays["colour"], arrays["depth"])
    elif JPEG in arrays:
        image = MavImage(stamp_ns, _from_jpeg(arrays[JPEG].tobytes()))
    else:
        image = MavImage(stamp_ns, arrays["image"])
    scale, depth_range = header["scale"], header["depth_range"]
    pose = TrackedPose(
        stamp_ns,
        Tracking(header["tracking"]),
        SE3(arrays["rotation"], arrays["translation"]) if "rotation" in arrays else None,
        arrays.get("covariance"),
        None if scale is None else ScaleEstimate(float(scale[0]), bool(scale[1])),
        None if depth_range is None else (float(depth_range[0]), float(depth_range[1])),
        bool(header["corrected"]),
    )
    return TrackedFrame(image, pose, header["north_rad"], _trajectory(arrays))


def _trajectory_arrays(trajectory: Trajectory | None) -> dict[str, NDArray[Any]]:
    if trajectory is None:
        return {}
    arrays = (trajectory.stamps_ns, trajectory.rotations, trajectory.translations)
    return dict(zip(PATH, arrays, strict=True))


def _trajectory(arrays: dict[str, NDArray[Any]]) -> Trajectory | None:
    return Trajectory(*(arrays[name] for name in PATH)) if PATH[0] in arrays else None


def _message(header: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Parts:
    types = [(name, array.dtype.str, array.shape) for name, array in arrays.items()]
    head = json.dumps(header | {"arrays": types}).encode()
    return [head, *(array.tobytes() for array in arrays.values())]


def _parse(parts: Sequence[bytes]) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    header = json.loads(parts[0])
    arrays = {}
    for (name, dtype, shape), block in zip(header["arrays"], parts[1:], strict=True):
        if dtype not in TYPES:
            raise ValueError(f"{name} is made of {dtype}")
        arrays[name] = np.frombuffer(block, np.dtype(dtype)).reshape(shape)
    return header, arrays


def _jpeg(image: U8, quality: int) -> bytes:
    _, packed = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return packed.tobytes()


def _from_jpeg(packed: bytes) -> U8:
    image = cv2.imdecode(np.frombuffer(packed, np.uint8), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise ValueError("an image is no JPEG")
    return image.astype(np.uint8)
