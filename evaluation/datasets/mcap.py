"""A recording as a ROS 2 bag in MCAP, for `ros2 bag play`, Foxglove and rerun.
docs/datasets.md lists the topics."""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from airground.core.se3 import SE3
from evaluation.datasets import ros_messages as ros
from evaluation.datasets.simulated import Simulated
from sim.robots.motion import Robot

NAME = "recording"
WORLD, BODY, IMU, CAMERA = "world", "base_link", "imu", "camera_optical"
Message = tuple[int, str, Any]
"""Stamp [ns], topic and message."""

_FOREVER = QosTime(0, 0)
LATCHED = Qos(
    history=QosHistory.KEEP_LAST,
    depth=1,
    reliability=QosReliability.RELIABLE,
    durability=QosDurability.TRANSIENT_LOCAL,
    deadline=_FOREVER,
    lifespan=_FOREVER,
    liveliness=QosLiveliness.AUTOMATIC,
    liveliness_lease_duration=_FOREVER,
    avoid_ros_namespace_conventions=False,
)
"""Subscribers that join later receive /tf_static too."""


def write_bag(folder: Path, simulated: Simulated, robots: tuple[Robot, ...]) -> None:
    """Write a bag into an empty folder."""
    writer = Writer(folder / NAME, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    connections: dict[str, Connection] = {}
    with writer:
        for stamp_ns, topic, message in _messages(simulated, robots):
            kind = message.__msgtype__
            if topic not in connections:
                latched = [LATCHED] if topic == "/tf_static" else []
                connections[topic] = writer.add_connection(
                    topic, kind, typestore=ros.TYPES, offered_qos_profiles=latched
                )
            writer.write(connections[topic], stamp_ns, ros.TYPES.serialize_cdr(message, kind))


def _messages(simulated: Simulated, robots: tuple[Robot, ...]) -> Iterator[Message]:
    """All messages, in order of time."""
    yield 0, "/tf_static", ros.transforms(0, _mountings(simulated, robots))
    streams = [
        stream(simulated, robot)
        for robot in robots
        for stream in (_truth, _imu, _magnetic, _images)
    ]
    yield from heapq.merge(*streams, key=itemgetter(0))


def _mountings(simulated: Simulated, robots: tuple[Robot, ...]) -> list[tuple[str, str, SE3]]:
    edges = []
    for robot in robots:
        T_body_imu = SE3.from_matrix(simulated.nominal(robot).T_body_imu)
        edges.append((f"{robot}/{BODY}", f"{robot}/{IMU}", T_body_imu))
        edges.append((f"{robot}/{IMU}", f"{robot}/{CAMERA}", simulated.T_imu_camera(robot)))
    return edges


def _truth(simulated: Simulated, robot: Robot) -> Iterator[Message]:
    motion, body = simulated.motion(robot), f"{robot}/{BODY}"
    velocities = np.einsum("nji,nj->ni", motion.rotations_world, motion.velocities_world)
    for index, stamp in enumerate(simulated.motion_stamps_ns(robot).tolist()):
        T = SE3(motion.rotations_world[index], motion.positions_world[index])
        yield stamp, "/tf", ros.transforms(stamp, [(WORLD, body, T)])
        rates = velocities[index], motion.angular_velocities_body[index]
        yield stamp, f"/{robot}/truth/odometry", ros.odometry(stamp, WORLD, body, T, *rates)


def _imu(simulated: Simulated, robot: Robot) -> Iterator[Message]:
    samples, _ = simulated.samples(robot)
    table = simulated.nominal(robot).imu
    values = zip(samples.gyro, samples.accelerometer, strict=True)
    for stamp, (gyro, accelerometer) in zip(samples.stamps_ns.tolist(), values, strict=True):
        message = ros.imu(stamp, f"{robot}/{IMU}", gyro, accelerometer, table)
        yield stamp, f"/{robot}/imu", message


def _magnetic(simulated: Simulated, robot: Robot) -> Iterator[Message]:
    _, samples = simulated.samples(robot)
    table = simulated.nominal(robot).magnetometer
    for stamp, field in zip(samples.stamps_ns.tolist(), samples.field, strict=True):
        message = ros.magnetic_field(stamp, f"{robot}/{IMU}", field, table)
        yield stamp, f"/{robot}/magnetic_field", message


def _images(simulated: Simulated, robot: Robot) -> Iterator[Message]:
    lens, frame = simulated.nominal(robot).camera.lens(), f"{robot}/{CAMERA}"
    straight = simulated.sensed(robot).calibration.camera
    files, topic = simulated.image_files(robot), f"/{robot}/camera"
    for index, stamp in enumerate(simulated.stamps_ns(robot)):
        yield stamp, f"{topic}/camera_info", ros.camera_info(stamp, frame, lens, straight)
        image = ros.compressed_image(stamp, frame, files[index])
        yield stamp, f"{topic}/image_raw/compressed", image
        if robot == "ground":
            depth = simulated.files.ground_depth(index)
            yield stamp, f"{topic}/depth", ros.depth_image(stamp, frame, depth)
        T_world_camera = simulated.truth.T_world_camera(robot, stamp)
        yield stamp, f"/{robot}/truth/camera", ros.pose(stamp, WORLD, T_world_camera)
