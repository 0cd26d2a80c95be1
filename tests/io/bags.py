"""Small bags of ROS 1 and ROS 2, as robots record them."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

START_NS = 1_700_000_000_000_000_000
WIDTH, HEIGHT = 64, 48
PERIOD_NS = 33_333_333
IMAGES = 6
INTRINSICS = (50.0, 51.0, 31.0, 23.0)
UP = np.array([0.0, -9.81, 0.0])
"""Specific force of a camera that looks straight ahead [m/s^2]."""


@dataclass
class BagMaker:
    """Messages to be written; `ros1` decides the kind of bag."""

    ros1: bool
    messages: list[tuple[int, str, Any]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.types = get_typestore(Stores.ROS1_NOETIC if self.ros1 else Stores.ROS2_HUMBLE)
        if self.ros1:
            definition = "geometry_msgs/TransformStamped[] transforms"
            self.types.register(get_types_from_msg(definition, "tf2_msgs/msg/TFMessage"))

    def make(self, kind: str, **fields: Any) -> Any:
        return self.types.types[kind](**fields)

    def header(self, stamp_ns: int, frame: str) -> Any:
        stamp = self.make(
            "builtin_interfaces/msg/Time", sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9
        )
        more = {"seq": 0} if self.ros1 else {}
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id=frame, **more)

    def add(self, stamp_ns: int, topic: str, message: Any) -> None:
        """A message that reaches the recorder 2 ms after its stamp."""
        self.messages.append((stamp_ns + 2_000_000, topic, message))

    def image(self, stamp_ns: int, topic: str, pixels: np.ndarray, encoding: str) -> None:
        height, width = pixels.shape[:2]
        data = np.ascontiguousarray(pixels).view(np.uint8).reshape(height, -1)
        padded = np.hstack([data, np.full((height, 4), 255, np.uint8)])
        message = self.make(
            "sensor_msgs/msg/Image",
            header=self.header(stamp_ns, "camera"),
            height=height,
            width=width,
            encoding=encoding,
            is_bigendian=0,
            step=padded.shape[1],
            data=padded.ravel(),
        )
        self.add(stamp_ns, topic, message)

    def compressed(self, stamp_ns: int, topic: str, pixels: np.ndarray, kind: str) -> None:
        _, data = cv2.imencode(f".{kind}", pixels)
        message = self.make(
            "sensor_msgs/msg/CompressedImage",
            header=self.header(stamp_ns, "camera"),
            format=kind,
            data=data.ravel(),
        )
        self.add(stamp_ns, topic, message)

    def info(self, topic: str, model: str = "plumb_bob", d: tuple[float, ...] = (0.0,) * 5) -> None:
        fx, fy, cx, cy = INTRINSICS
        k = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
        roi = self.make(
            "sensor_msgs/msg/RegionOfInterest",
            x_offset=0,
            y_offset=0,
            height=0,
            width=0,
            do_rectify=False,
        )
        names = ("D", "K", "R", "P") if self.ros1 else ("d", "k", "r", "p")
        p = np.hstack([k, np.zeros((3, 1))]).ravel()
        values = (np.array(d), k.ravel(), np.eye(3).ravel(), p)
        message = self.make(
            "sensor_msgs/msg/CameraInfo",
            header=self.header(START_NS, "camera"),
            height=HEIGHT,
            width=WIDTH,
            distortion_model=model,
            binning_x=0,
            binning_y=0,
            roi=roi,
            **dict(zip(names, values, strict=True)),
        )
        self.add(START_NS, topic, message)

    def imu(self, topic: str, turning: bool = True, lead_ns: int = 10_000_000) -> None:
        """200 Hz, from `lead_ns` before the first image on."""
        count = (IMAGES * PERIOD_NS + 2 * lead_ns) // 5_000_000
        for k in range(count):
            stamp_ns = START_NS - lead_ns + 5_000_000 * k
            gyro = [0.01, -0.02, 0.03 + 0.001 * k] if turning else [0.0, 0.0, 0.0]
            message = self.make(
                "sensor_msgs/msg/Imu",
                header=self.header(stamp_ns, "imu"),
                orientation=self.make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0),
                orientation_covariance=np.zeros(9),
                angular_velocity=self.vector(gyro),
                angular_velocity_covariance=np.zeros(9),
                linear_acceleration=self.vector(UP.tolist()),
                linear_acceleration_covariance=np.zeros(9),
            )
            self.add(stamp_ns, topic, message)

    def mounting(self, parent: str, child: str, translation: list[float]) -> None:
        transform = self.make(
            "geometry_msgs/msg/Transform",
            translation=self.vector(translation),
            rotation=self.make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0),
        )
        one = self.make(
            "geometry_msgs/msg/TransformStamped",
            header=self.header(START_NS, parent),
            child_frame_id=child,
            transform=transform,
        )
        self.add(START_NS, "/tf_static", self.make("tf2_msgs/msg/TFMessage", transforms=[one]))

    def vector(self, xyz: list[float]) -> Any:
        x, y, z = xyz
        return self.make("geometry_msgs/msg/Vector3", x=x, y=y, z=z)

    def write(self, path: Path) -> Path:
        """The bag; returns the path to open."""
        writer: Any = Writer1(path)
        if not self.ros1:
            writer = Writer2(path, version=9, storage_plugin=StoragePlugin.MCAP)
        connections: dict[str, Any] = {}
        with writer:
            for time_ns, topic, message in sorted(self.messages, key=lambda one: one[0]):
                kind = message.__msgtype__
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, kind, typestore=self.types)
                pack = self.types.serialize_ros1 if self.ros1 else self.types.serialize_cdr
                writer.write(connections[topic], time_ns, pack(message, kind))
        return path


def stamps() -> list[int]:
    return [START_NS + PERIOD_NS * index for index in range(IMAGES)]


def grey(index: int) -> np.ndarray:
    rng = np.random.default_rng(index)
    return cv2.GaussianBlur(rng.integers(0, 256, (HEIGHT, WIDTH), np.uint8), (0, 0), 2)


def bgr(index: int) -> np.ndarray:
    return cv2.merge([grey(index), grey(index + 100), grey(index + 200)])


def depth_mm(index: int) -> np.ndarray:
    depth = np.full((HEIGHT, WIDTH), 1500 + index, np.uint16)
    depth[:8, :8] = 0
    return depth
