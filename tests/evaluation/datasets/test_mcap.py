"""The bag in the hands of others: rosbags with standard types, and rerun's own MCAP reader."""

import subprocess
import sysconfig
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from airground.core.cloud import Source
from airground.core.se3 import SE3
from airground.io.open_recording import open_robot
from evaluation.datasets.simulated import Simulated
from tests.evaluation.plain_recordings import content

RERUN = Path(sysconfig.get_path("scripts")) / "rerun"
Bag = dict[str, list[tuple[int, Any]]]


@pytest.fixture(scope="module")
def folder(exported: Callable[[str], Path]) -> Path:
    return exported("mcap") / "recording"


@pytest.fixture(scope="module")
def bag(folder: Path) -> Bag:
    """Stamp and message by topic; AnyReader takes the types from the bag itself."""
    messages: Bag = {}
    with AnyReader([folder]) as reader:
        standard = get_typestore(Stores.ROS2_HUMBLE)
        for connection, stamp, data in reader.messages():
            kind = connection.msgtype
            assert connection.digest == standard.hash_rihs01(kind)
            message = reader.deserialize(data, kind)
            messages.setdefault(connection.topic, []).append((stamp, message))
    return messages


def stamp_ns(message: Any) -> int:
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def pose(message: Any) -> SE3:
    p, q = message.position, message.orientation
    return SE3.from_quaternion_xyzw([q.x, q.y, q.z, q.w], [p.x, p.y, p.z])


def test_everything_is_in_it_with_its_stamps(bag: Bag, simulated: Simulated) -> None:
    truth = simulated.truth.motion.stamps_ns.tolist()
    expected = {"/tf": sorted(2 * truth), "/tf_static": [0]}
    for robot in ("mav", "ground"):
        images = simulated.stamps_ns(robot)
        imu, magnetic = simulated.samples(robot)
        for topic in ("camera/camera_info", "camera/image_raw/compressed", "truth/camera"):
            expected[f"/{robot}/{topic}"] = images
        expected[f"/{robot}/imu"] = imu.stamps_ns.tolist()
        expected[f"/{robot}/magnetic_field"] = magnetic.stamps_ns.tolist()
        expected[f"/{robot}/truth/odometry"] = truth
    expected["/ground/camera/depth"] = simulated.stamps_ns("ground")
    assert {topic: [stamp for stamp, _ in found] for topic, found in bag.items()} == expected
    for topic, found in bag.items():
        if not topic.startswith("/tf"):
            assert all(stamp_ns(message) == stamp for stamp, message in found)


def test_images_are_the_recordings(bag: Bag, simulated: Simulated) -> None:
    recording = simulated.recording
    for index, (_, message) in enumerate(bag["/mav/camera/image_raw/compressed"]):
        grey = cv2.imdecode(message.data, cv2.IMREAD_UNCHANGED)
        np.testing.assert_array_equal(grey, recording.of(Source.MAV).read_image(index).image)
    colours = bag["/ground/camera/image_raw/compressed"]
    for index, (_, message) in enumerate(bag["/ground/camera/depth"]):
        image = recording.of(Source.GROUND).read_image(index)
        depth = message.data.view("<f4").reshape(message.height, message.width)
        assert (message.encoding, message.step) == ("32FC1", 4 * message.width)
        np.testing.assert_array_equal(depth, image.depth)
        bgr = cv2.imdecode(colours[index][1].data, cv2.IMREAD_COLOR)
        np.testing.assert_array_equal(bgr[..., ::-1], image.colour)


def test_samples_and_calibration_are_as_recorded(bag: Bag, simulated: Simulated) -> None:
    for robot in ("mav", "ground"):
        imu, magnetic = simulated.samples(robot)
        for index in (0, 100, 999):
            reading = bag[f"/{robot}/imu"][index][1]
            force, turn = reading.linear_acceleration, reading.angular_velocity
            np.testing.assert_array_equal([force.x, force.y, force.z], imu.accelerometer[index])
            np.testing.assert_array_equal([turn.x, turn.y, turn.z], imu.gyro[index])
        field = bag[f"/{robot}/magnetic_field"][7][1].magnetic_field
        np.testing.assert_array_equal([field.x, field.y, field.z], magnetic.field[7])
        camera = simulated.nominal(robot).camera.lens().pinhole()
        info = bag[f"/{robot}/camera/camera_info"][0][1]
        np.testing.assert_array_equal(info.k.reshape(3, 3), camera.matrix())
        assert (info.width, info.height) == (camera.width, camera.height)


def test_the_tree_of_frames_leads_to_the_camera(bag: Bag, simulated: Simulated) -> None:
    """World to body is the truth, body to camera nominal: the error of the mounting remains."""
    edges = {t.child_frame_id: t for t in bag["/tf_static"][0][1].transforms}
    for robot in ("mav", "ground"):
        T = SE3.identity()
        for child, parent in (("imu", "base_link"), ("camera_optical", "imu")):
            edge = edges[f"{robot}/{child}"]
            assert edge.header.frame_id == f"{robot}/{parent}"
            q, t = edge.transform.rotation, edge.transform.translation
            T = T @ SE3.from_quaternion_xyzw([q.x, q.y, q.z, q.w], [t.x, t.y, t.z])
        calibration = simulated.nominal(robot).calibration()
        nominal = calibration.T_body_imu @ calibration.T_imu_camera
        assert np.abs((T.inverse() @ nominal).log()).max() < 1e-9
        for stamp, message in bag[f"/{robot}/truth/camera"]:
            true = simulated.truth.T_world_camera(robot, stamp)
            assert np.abs((pose(message.pose).inverse() @ true).log()).max() < 1e-9


def test_odometry_moves_as_its_twist_says(bag: Bag) -> None:
    for robot in ("mav", "ground"):
        odometry = [message for _, message in bag[f"/{robot}/truth/odometry"]]
        start, middle, end = odometry[700], odometry[701], odometry[702]
        T = pose(start.pose.pose).inverse() @ pose(end.pose.pose)
        twist = middle.twist.twist
        moved, turned = T.log()[:3] / 0.01, T.log()[3:] / 0.01
        np.testing.assert_allclose(
            moved, [twist.linear.x, twist.linear.y, twist.linear.z], atol=3e-3
        )
        rates = [twist.angular.x, twist.angular.y, twist.angular.z]
        np.testing.assert_allclose(turned, rates, atol=3e-2)
        assert middle.header.frame_id == "world"
        assert middle.child_frame_id == f"{robot}/base_link"


@pytest.mark.parametrize("robot", list(Source))
def test_it_is_read_back_message_by_message(
    folder: Path, simulated: Simulated, robot: Source
) -> None:
    """By the type of its topics: images, samples and calibration are those of the recording.
    Stamps stay, and so does the bag's name of each robot."""
    ours, back = simulated.recording.of(robot), open_robot(folder, robot)
    pairs = zip(ours.messages(), back.messages(), strict=True)
    for one, other in pairs:
        assert type(one.message) is type(other.message)
        for a, b in zip(content(one.message), content(other.message), strict=True):
            np.testing.assert_array_equal(a, b)
    assert ours.calibration.camera == back.calibration.camera
    mounting = ours.calibration.T_imu_camera.matrix()
    np.testing.assert_allclose(back.calibration.T_imu_camera.matrix(), mounting, atol=1e-12)


@pytest.mark.skipif(not RERUN.exists(), reason="rerun's command is not installed")
def test_rerun_finds_no_fault_and_converts_it(folder: Path, tmp_path: Path) -> None:
    file, out = folder / "recording.mcap", tmp_path / "bag.rrd"
    checked = subprocess.run([RERUN, "mcap", "check", file], capture_output=True, text=True)
    assert checked.returncode == 0, checked.stderr
    subprocess.run([RERUN, "mcap", "convert", file, "-o", out], check=True, capture_output=True)
    listed = subprocess.run(
        [RERUN, "rrd", "print", "-vv", out], check=True, capture_output=True, text=True
    ).stdout
    kinds = Counter(k for k in ("DepthImage", "EncodedImage", "Transform3D") if k in listed)
    assert set(kinds) == {"DepthImage", "EncodedImage", "Transform3D"}
