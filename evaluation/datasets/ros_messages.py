"""ROS 2 messages of standard types, from what a recording holds.
Axes follow REP 103 and 105: x forward and z up in `base_link`; `camera_optical` has x right, y
down, z forward, as OpenCV's cameras and ours."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_typestore

from airground.core.camera import PinholeCamera
from airground.core.se3 import SE3
from airground.io.calibration import ImuTable, MagnetometerTable
from airground.io.images import read_image_bytes
from airground.io.lens import Lens

TYPES = get_typestore(Stores.ROS2_HUMBLE)
UNKNOWN = -1.0
"""REP 145: a covariance that begins so says that the quantity is not measured."""
SECOND_NS = 1_000_000_000
PLUMB_BOB_COEFFICIENTS = 5


def make(kind: str, **fields: Any) -> Any:
    """A message of a type such as "sensor_msgs/msg/Imu"."""
    return TYPES.types[kind](**fields)


def header(stamp_ns: int, frame: str) -> Any:
    seconds, nanoseconds = divmod(stamp_ns, SECOND_NS)
    stamp = make("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)
    return make("std_msgs/msg/Header", stamp=stamp, frame_id=frame)


def compressed_image(stamp_ns: int, frame: str, png: Path) -> Any:
    """The bytes of a PNG file as they are."""
    return make(
        "sensor_msgs/msg/CompressedImage",
        header=header(stamp_ns, frame),
        format="png",
        data=np.frombuffer(read_image_bytes(png), np.uint8),
    )


def depth_image(stamp_ns: int, frame: str, depth: NDArray[np.float32]) -> Any:
    """REP 118: 32FC1 in metres, NaN where missing."""
    height, width = depth.shape
    return make(
        "sensor_msgs/msg/Image",
        header=header(stamp_ns, frame),
        height=height,
        width=width,
        encoding="32FC1",
        is_bigendian=0,
        step=4 * width,
        data=np.ascontiguousarray(depth, "<f4").view(np.uint8).ravel(),
    )


def camera_info(stamp_ns: int, frame: str, lens: Lens, straight: PinholeCamera) -> Any:
    """A lens and the camera of its rectified images; as in OpenCV, integer pixels are centres."""
    matrix = lens.matrix()
    distortion = np.zeros(PLUMB_BOB_COEFFICIENTS)
    if lens.model == "equidistant":
        distortion = np.array(lens.distortion)
    else:
        distortion[: len(lens.distortion)] = lens.distortion
    return make(
        "sensor_msgs/msg/CameraInfo",
        header=header(stamp_ns, frame),
        height=lens.height,
        width=lens.width,
        distortion_model="equidistant" if lens.model == "equidistant" else "plumb_bob",
        d=distortion,
        k=matrix.ravel(),
        r=np.eye(3).ravel(),
        p=np.hstack([straight.matrix(), np.zeros((3, 1))]).ravel(),
        binning_x=0,
        binning_y=0,
        roi=make(
            "sensor_msgs/msg/RegionOfInterest",
            x_offset=0,
            y_offset=0,
            height=0,
            width=0,
            do_rectify=False,
        ),
    )


def imu(stamp_ns: int, frame: str, gyro: NDArray, accelerometer: NDArray, table: ImuTable) -> Any:
    """Gravity is included, as REP 145 says; there is no orientation."""
    unknown = np.zeros(9)
    unknown[0] = UNKNOWN
    return make(
        "sensor_msgs/msg/Imu",
        header=header(stamp_ns, frame),
        orientation=_quaternion(np.array([0.0, 0.0, 0.0, 1.0])),
        orientation_covariance=unknown,
        angular_velocity=_vector(gyro),
        angular_velocity_covariance=_white(table.gyro_noise_density**2 * table.rate_hz),
        linear_acceleration=_vector(accelerometer),
        linear_acceleration_covariance=_white(table.accelerometer_noise_density**2 * table.rate_hz),
    )


def magnetic_field(stamp_ns: int, frame: str, field: NDArray, table: MagnetometerTable) -> Any:
    """In tesla."""
    return make(
        "sensor_msgs/msg/MagneticField",
        header=header(stamp_ns, frame),
        magnetic_field=_vector(field),
        magnetic_field_covariance=_white(table.noise_t**2),
    )


def transforms(stamp_ns: int, edges: list[tuple[str, str, SE3]]) -> Any:
    """Parent, child and `T_parent_child` of each edge."""
    stamped = [
        make(
            "geometry_msgs/msg/TransformStamped",
            header=header(stamp_ns, parent),
            child_frame_id=child,
            transform=make(
                "geometry_msgs/msg/Transform",
                translation=_vector(T.translation),
                rotation=_quaternion(T.quaternion_xyzw()),
            ),
        )
        for parent, child, T in edges
    ]
    return make("tf2_msgs/msg/TFMessage", transforms=stamped)


def pose(stamp_ns: int, frame: str, T_frame_child: SE3) -> Any:
    return make(
        "geometry_msgs/msg/PoseStamped", header=header(stamp_ns, frame), pose=_pose(T_frame_child)
    )


def odometry(
    stamp_ns: int, frame: str, child: str, T_frame_child: SE3, velocity: NDArray, turn: NDArray
) -> Any:
    """Exact: covariances are zero. Velocity [m/s] and turn rate [rad/s] are in the child."""
    exact = np.zeros(36)
    return make(
        "nav_msgs/msg/Odometry",
        header=header(stamp_ns, frame),
        child_frame_id=child,
        pose=make(
            "geometry_msgs/msg/PoseWithCovariance", pose=_pose(T_frame_child), covariance=exact
        ),
        twist=make(
            "geometry_msgs/msg/TwistWithCovariance",
            twist=make("geometry_msgs/msg/Twist", linear=_vector(velocity), angular=_vector(turn)),
            covariance=exact,
        ),
    )


def _pose(T: SE3) -> Any:
    x, y, z = T.translation.tolist()
    return make(
        "geometry_msgs/msg/Pose",
        position=make("geometry_msgs/msg/Point", x=x, y=y, z=z),
        orientation=_quaternion(T.quaternion_xyzw()),
    )


def _vector(values: NDArray) -> Any:
    x, y, z = values.tolist()
    return make("geometry_msgs/msg/Vector3", x=x, y=y, z=z)


def _quaternion(xyzw: NDArray) -> Any:
    x, y, z, w = xyzw.tolist()
    return make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)


def _white(variance: float) -> NDArray[np.float64]:
    return np.diag([variance] * 3).ravel()
