"""Bags of ROS 1 and ROS 2: what is read, how topics are found, and what each error says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from airground.core.cloud import Source
from airground.core.messages import GroundImage, ImuSamples, MavImage
from airground.errors import RecordingError
from airground.io.open_recording import layout_of, open_robot
from tests.io.bags import (
    HEIGHT,
    IMAGES,
    INTRINSICS,
    START_NS,
    WIDTH,
    BagMaker,
    bgr,
    depth_mm,
    grey,
    stamps,
)

KINDS = [True, False]


def path_of(folder: Path, ros1: bool) -> Path:
    return folder / ("a.bag" if ros1 else "a")


def flying(ros1: bool) -> BagMaker:
    """A grey camera with an IMU whose place is known."""
    bag = BagMaker(ros1)
    for index, stamp in enumerate(stamps()):
        bag.image(stamp, "/cam0/image_raw", grey(index), "mono8")
    bag.info("/cam0/camera_info")
    bag.imu("/imu0")
    bag.mounting("imu", "mount", [0.1, 0.0, 0.0])
    bag.mounting("mount", "camera", [0.0, 0.2, 0.0])
    return bag


def driving(ros1: bool, depth_late_ns: int = 3_000_000) -> BagMaker:
    """A colour camera with depth, in both transports, and an infrared camera."""
    bag = BagMaker(ros1)
    for index, stamp in enumerate(stamps()):
        bag.image(stamp, "/camera/color/image_raw", bgr(index), "bgr8")
        bag.compressed(stamp, "/camera/color/image_raw/compressed", bgr(index), "jpg")
        bag.image(stamp, "/camera/infra1/image_raw", grey(index), "mono8")
        late = stamp + depth_late_ns
        bag.image(late, "/camera/depth/image_raw", depth_mm(index) + 9, "16UC1")
        topic = "/camera/aligned_depth_to_color/image_raw"
        bag.image(late, topic, depth_mm(index), "16UC1")
    bag.info("/camera/color/camera_info")
    return bag


@pytest.mark.parametrize("ros1", KINDS)
def test_a_flight_is_read_by_type(tmp_path: Path, ros1: bool) -> None:
    path = flying(ros1).write(path_of(tmp_path, ros1))
    assert layout_of(path) == "ros"
    recording = open_robot(path, Source.MAV)
    assert recording.camera_stamps.tolist() == stamps()
    camera = recording.calibration.camera
    assert (camera.width, camera.height) == (WIDTH, HEIGHT)
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == INTRINSICS
    messages = [stamped.message for stamped in recording.messages()]
    images = [message for message in messages if isinstance(message, MavImage)]
    for index, image in enumerate(images):
        np.testing.assert_array_equal(image.image, grey(index))
    assert isinstance(messages[0], ImuSamples)
    assert recording.imu is not None
    np.testing.assert_allclose(recording.imu.gyro[0], [0.01, -0.02, 0.03])
    np.testing.assert_allclose(recording.calibration.T_imu_camera.translation, [0.1, 0.2, 0.0])
    assert "IMU: noise of an ADIS16448" in " ".join(recording.assumed)


@pytest.mark.parametrize("ros1", KINDS)
def test_images_are_read_in_any_order(tmp_path: Path, ros1: bool) -> None:
    recording = open_robot(flying(ros1).write(path_of(tmp_path, ros1)), Source.MAV)
    for index in (3, 0, 1, 5, 5, 2):
        image = recording.read_image(index)
        assert image.stamp_ns == stamps()[index]
        np.testing.assert_array_equal(image.image, grey(index))


@pytest.mark.parametrize("ros1", KINDS)
def test_colour_and_registered_depth_are_found_by_type(tmp_path: Path, ros1: bool) -> None:
    """The infrared camera has no colour, and the depth of the other topic is not registered."""
    recording = open_robot(driving(ros1).write(path_of(tmp_path, ros1)), Source.GROUND)
    assert recording.camera_stamps.tolist() == stamps()
    assert recording.imu is None
    for index in range(IMAGES):
        frame = recording.read_image(index)
        assert isinstance(frame, GroundImage)
        np.testing.assert_array_equal(frame.colour, bgr(index)[..., ::-1])
        assert np.isnan(frame.depth[:8, :8]).all()
        np.testing.assert_allclose(frame.depth[10:], 1.5 + 1e-3 * index, rtol=1e-6)
    assert recording.assumed == ("depth: 1000 per metre, usual for its format",)


def test_topics_can_be_named(tmp_path: Path) -> None:
    path = driving(False).write(tmp_path / "a")
    topics = {
        "image": "/camera/color/image_raw/compressed",
        "depth": "/camera/depth/image_raw",
    }
    frame = open_robot(path, Source.GROUND, topics=topics).read_image(2)
    assert isinstance(frame, GroundImage)
    assert np.abs(frame.colour.astype(int) - bgr(2)[..., ::-1]).mean() < 8  # a JPEG
    np.testing.assert_allclose(frame.depth[10:], 1.511, rtol=1e-6)


def test_the_file_in_a_bags_folder_opens_too(tmp_path: Path) -> None:
    path = flying(False).write(tmp_path / "a") / "a.mcap"
    assert len(open_robot(path, Source.MAV).camera_stamps) == IMAGES


@pytest.mark.parametrize("encoding", ["32FC1", "16UC1"])
def test_depth_is_in_metres(tmp_path: Path, encoding: str) -> None:
    bag = BagMaker(ros1=True)
    for index, stamp in enumerate(stamps()):
        bag.image(stamp, "/rgb/image", bgr(index), "bgr8")
        units = depth_mm(index)
        metres = np.where(units == 0, np.nan, units / 1000).astype(np.float32)
        bag.image(stamp, "/depth/image", metres if encoding == "32FC1" else units, encoding)
    bag.info("/rgb/camera_info")
    frame = open_robot(bag.write(tmp_path / "a.bag"), Source.GROUND).read_image(1)
    assert isinstance(frame, GroundImage)
    assert np.isnan(frame.depth[:8, :8]).all()
    np.testing.assert_allclose(frame.depth[10:], 1.501, rtol=1e-6)


def test_an_accelerometer_without_a_gyro_gives_no_imu(tmp_path: Path) -> None:
    """As the Kinect of TUM's bags."""
    bag = driving(True)
    bag.imu("/imu", turning=False)
    recording = open_robot(bag.write(tmp_path / "a.bag"), Source.GROUND)
    assert recording.imu is None
    assert "IMU: none, it has no gyro" in recording.assumed


def test_images_outside_the_imus_time_are_left_out(tmp_path: Path) -> None:
    bag = flying(True)
    bag.image(START_NS + 3 * 10**9, "/cam0/image_raw", grey(0), "mono8")
    recording = open_robot(bag.write(tmp_path / "a.bag"), Source.MAV)
    assert len(recording.camera_stamps) == IMAGES
    assert "images: 1 outside the time of the IMU are left out" in recording.assumed


def test_headers_without_stamps_take_the_bags_time(tmp_path: Path) -> None:
    bag = driving(False)
    for _, _, message in bag.messages:
        message.header.stamp.sec = message.header.stamp.nanosec = 0
    recording = open_robot(bag.write(tmp_path / "a"), Source.MAV, topics=COLOUR)
    assert recording.camera_stamps.tolist() == [stamp + 2_000_000 for stamp in stamps()]
    assert "stamps: times in the bag" in " ".join(recording.assumed)


COLOUR = {"image": "/camera/color/image_raw"}


def test_a_fisheye_by_its_camera_info(tmp_path: Path) -> None:
    bag = flying(False)
    bag.messages = [one for one in bag.messages if one[1] != "/cam0/camera_info"]
    bag.info("/cam0/camera_info", "equidistant", (0.01, 0.0, 0.0, 0.0))
    camera = open_robot(bag.write(tmp_path / "a"), Source.MAV).calibration.camera
    assert camera.fx != INTRINSICS[0]


def without(bag: BagMaker, topic: str) -> BagMaker:
    bag.messages = [one for one in bag.messages if one[1] != topic]
    return bag


def other_size(bag: BagMaker) -> BagMaker:
    bag = without(bag, "/camera/aligned_depth_to_color/image_raw")
    for stamp in stamps():
        half = depth_mm(0)[::2, ::2].copy()
        bag.image(stamp, "/camera/aligned_depth_to_color/image_raw", half, "16UC1")
    return bag


def in_other_units(bag: BagMaker) -> BagMaker:
    bag = without(bag, "/camera/aligned_depth_to_color/image_raw")
    for index, stamp in enumerate(stamps()):
        bag.image(stamp, "/camera/aligned_depth_to_color/image_raw", depth_mm(index) * 9, "16UC1")
    return bag


def strange(bag: BagMaker) -> BagMaker:
    bag = without(bag, "/cam0/image_raw")
    for index, stamp in enumerate(stamps()):
        bag.image(stamp, "/cam0/image_raw", grey(index), "yuv422")
    return bag


BAD: dict[str, tuple[Source, Callable[[], BagMaker], dict[str, str], str]] = {
    "several images": (
        Source.MAV,
        lambda: driving(True),
        {},
        r"several topics could be the image: /camera/color/image_raw, /camera/infra1/image_raw; "
        r"choose with --topics image=TOPIC",
    ),
    "no such topic": (Source.MAV, lambda: flying(True), {"imu": "/imu"}, r"no topic /imu; topics:"),
    "no such role": (Source.MAV, lambda: flying(True), {"gps": "/fix"}, "gps=...: known roles"),
    "no depth": (Source.GROUND, lambda: flying(False), {}, "no depth images, which the ground"),
    "no calibration": (
        Source.MAV,
        lambda: without(flying(True), "/cam0/camera_info"),
        {},
        r"no CameraInfo is beside /cam0/image_raw: .* --calibration FILE",
    ),
    "no mounting": (
        Source.MAV,
        lambda: without(flying(True), "/tf_static"),
        {},
        r"no static transform leads from 'imu' to 'camera'; .* T_BS .* --topics imu=none",
    ),
    "other clocks": (
        Source.GROUND,
        lambda: driving(False, depth_late_ns=10**9),
        {},
        "within 20 ms of one of",
    ),
    "other size": (Source.GROUND, lambda: other_size(driving(True)), {}, "depth is 32x24, its"),
    "other units": (
        Source.GROUND,
        lambda: in_other_units(driving(True)),
        {},
        r"median depth is 13\.\d+ m at 1000 per metre; it looks like 5000 per metre; "
        r"give --depth-scale 5000",
    ),
    "encoding": (Source.MAV, lambda: strange(flying(False)), {}, "encoding 'yuv422', which is not"),
}


@pytest.mark.parametrize("what", BAD)
def test_bad_bags_are_named_in_one_line(tmp_path: Path, what: str) -> None:
    robot, make, topics, message = BAD[what]
    bag = make()
    path = bag.write(path_of(tmp_path, bag.ros1))
    with pytest.raises(RecordingError, match=message) as raised:
        open_robot(path, robot, topics=topics)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("ros1", KINDS)
@pytest.mark.parametrize("kept", [0, 5, 100, 4000])
def test_truncated_bags_are_named_in_one_line(tmp_path: Path, ros1: bool, kept: int) -> None:
    path = flying(ros1).write(path_of(tmp_path, ros1))
    file = path if ros1 else path / "a.mcap"
    file.write_bytes(file.read_bytes()[:kept])
    with pytest.raises(RecordingError, match="a") as raised:
        open_robot(file, Source.MAV)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("begin", [b"", b"#ROSBAG V2.0", b"#ROSBAG V1.2\n"])
def test_a_bag_of_ros_1_is_known_by_its_first_line(tmp_path: Path, begin: bytes) -> None:
    """That line may be the whole file, of which the library would read all."""
    path = tmp_path / "a.bag"
    with path.open("wb") as file:
        file.write(begin)
        file.truncate(2**28)
    with pytest.raises(RecordingError, match=r"a\.bag: does not begin with #ROSBAG V2\.0, as bags"):
        open_robot(path, Source.MAV)


def test_a_definition_of_the_bags_own_is_not_followed(tmp_path: Path) -> None:
    """Its digest differs from the standard one's."""
    path = flying(True).write(tmp_path / "a.bag")
    data = path.read_bytes()
    digest = b"6a62c6daae103f4ff57a132d6f95cec2"
    assert digest in data
    path.write_bytes(data.replace(digest, b"0" * 32))
    with pytest.raises(RecordingError, match="its definition of sensor_msgs/msg/Imu is not the st"):
        open_robot(path, Source.MAV)


@pytest.mark.parametrize("name", ["metadata.yaml", "a.mcap"])
def test_a_bag_of_pipes_is_refused(tmp_path: Path, name: str) -> None:
    path = flying(False).write(tmp_path / "a")
    (path / name).unlink(missing_ok=True)
    (path / name).symlink_to("/dev/zero")
    with pytest.raises(
        RecordingError, match=r"(is a link to /dev/zero|no such folder|holds no recording)"
    ):
        open_robot(path, Source.MAV)
