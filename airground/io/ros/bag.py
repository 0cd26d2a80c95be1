"""A bag of ROS 1 (`.bag`) or ROS 2 (`.mcap`, `.db3`, or a folder with `metadata.yaml`).

Messages are read with the standard definitions of their types. Definitions that a bag brings along
are not used: they would have to be compiled."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
from rosbags.rosbag1 import Reader as Reader1
from rosbags.rosbag2 import Reader as Reader2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from airground.core.arrays import I64
from airground.errors import RecordingError
from airground.io.folder_links import check_links
from airground.io.input_files import SETTINGS_LIMIT, check_file
from airground.io.ros.inflating import bound_inflating

TRANSFORMS = "tf2_msgs/msg/TFMessage"
TRANSFORMS_DEFINITION = "geometry_msgs/TransformStamped[] transforms"
ANY_DIGEST = "*"
"""What a bag of ROS 1 may state in place of a definition's digest."""
ROS1_BEGINS = b"#ROSBAG V2.0\n"
"""The library reads the first line of a bag, and a file of something else may be all one line."""
BAG_LIMIT = 1 << 40
"""Largest file of a bag [byte]: a day of images without compression."""


@dataclass(frozen=True)
class Topic:
    """A topic with messages; `kind` is their type, such as "sensor_msgs/msg/Imu"."""

    name: str
    kind: str
    count: int


class Bag:
    """An open bag.

    Attributes:
        path: The file or folder.
        topics: All topics that have messages, by name.

    Raises:
        RecordingError: The bag cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._is_ros1 = path.suffix == ".bag"
        self._types = _types(self._is_ros1)
        try:
            _check_files(path)
            bound_inflating()
            self._reader: Any = Reader1(path) if self._is_ros1 else Reader2(path)
            self._reader.open()
            topics = self._reader.topics.items()
        except Exception as error:  # a library's, of many kinds where a file is damaged
            raise _damaged(path, error) from None
        self.topics = {
            name: Topic(name, info.msgtype or "", info.msgcount)
            for name, info in sorted(topics)
            if info.msgcount
        }

    def of_kind(self, *kinds: str) -> list[Topic]:
        """The topics with messages of these types."""
        return [topic for topic in self.topics.values() if topic.kind in kinds]

    def raw(self, topic: str, start_ns: int | None = None) -> Iterator[tuple[int, bytes]]:
        """Time in the bag [ns] and bytes of each message from a time on; raises RecordingError."""
        connections = [one for one in self._reader.connections if one.topic == topic]
        self._check_definition(topic, connections)
        try:
            for _, time_ns, data in self._reader.messages(connections, start=start_ns):
                yield time_ns, data
        except Exception as error:
            raise _damaged(self.path, error) from None

    def decoded(self, topic: str, data: bytes) -> Any:
        """A message of a topic; RecordingError where the bytes are none."""
        kind = self.topics[topic].kind
        try:
            if self._is_ros1:
                return self._types.deserialize_ros1(data, kind)
            return self._types.deserialize_cdr(data, kind)
        except Exception as error:
            raise RecordingError(f"{self.path}: {topic}: is no {kind}: {_reason(error)}") from None

    def messages(self, topic: str) -> Iterator[tuple[int, Any]]:
        """Time in the bag [ns] and content of each message of a topic; raises RecordingError."""
        for time_ns, data in self.raw(topic):
            yield time_ns, self.decoded(topic, data)

    def first(self, topic: str) -> Any:
        """The first message of a topic; RecordingError if it has none, or is damaged."""
        for _, message in self.messages(topic):
            return message
        raise RecordingError(f"{self.path}: {topic}: holds no message")

    def _check_definition(self, topic: str, connections: list[Any]) -> None:
        """RecordingError where a type is unknown, or a bag of ROS 1 defines it otherwise."""
        kind = self.topics[topic].kind
        if kind not in self._types.fielddefs:
            raise RecordingError(f"{self.path}: {topic}: has the unknown type {kind}")
        if not self._is_ros1:
            return
        _, expected = self._types.generate_msgdef(kind, ros_version=1)
        for one in connections:
            if one.digest not in (expected, ANY_DIGEST):
                raise RecordingError(
                    f"{self.path}: {topic}: its definition of {kind} is not the standard one"
                )


class Messages:
    """The messages of one topic by index, fast where they are read one after the other.

    Each has an open bag of its own and may be read by several threads.

    Args:
        path: The bag.
        topic: The topic.
        times_ns: (N,) times of its messages in the bag [ns], ascending.
    """

    def __init__(self, path: Path, topic: str, times_ns: I64) -> None:
        self._path, self._topic, self._times_ns = path, topic, times_ns
        self._bag: Bag | None = None
        self._next = -1
        self._stream: Iterator[tuple[int, bytes]] = iter(())
        self._lock = Lock()

    def __getitem__(self, index: int) -> Any:
        """The message; RecordingError where the bag is damaged."""
        with self._lock:
            if self._bag is None:
                self._bag = Bag(self._path)
            if index != self._next:
                start_ns = int(self._times_ns[index])
                self._stream = self._bag.raw(self._topic, start_ns)
                # Messages of the same time come in the same order.
                for _ in range(index - int(np.searchsorted(self._times_ns, start_ns))):
                    next(self._stream, None)
            found = next(self._stream, None)
            if found is None:
                raise RecordingError(f"{self._path}: {self._topic}: message {index} is missing")
            self._next = index + 1
            return self._bag.decoded(self._topic, found[1])


@cache
def _types(is_ros1: bool) -> Typestore:
    """The standard definitions, with that of static transforms, which ROS 1 has elsewhere."""
    types = get_typestore(Stores.ROS1_NOETIC if is_ros1 else Stores.ROS2_HUMBLE)
    if TRANSFORMS not in types.fielddefs:
        types.register(get_types_from_msg(TRANSFORMS_DEFINITION, TRANSFORMS))
    return types


def _check_files(path: Path) -> None:
    """Raise OSError if a bag, or a file in its folder, is no regular file, or its list is large;
    RecordingError if a bag of ROS 1 does not begin as one."""
    if not path.is_dir():
        check_file(path, BAG_LIMIT)
        if path.suffix == ".bag":
            _check_begin(path)
        return
    check_links(path)
    check_file(path / "metadata.yaml", SETTINGS_LIMIT)
    for file in path.iterdir():
        check_file(file, BAG_LIMIT)


def _check_begin(path: Path) -> None:
    with path.open("rb") as file:
        if file.read(len(ROS1_BEGINS)) != ROS1_BEGINS:
            begins = ROS1_BEGINS.decode().strip()
            raise RecordingError(f"{path}: does not begin with {begins}, as bags of ROS 1 do")


def _damaged(path: Path, error: Exception) -> RecordingError:
    if isinstance(error, RecordingError):
        return error
    return RecordingError(f"{path}: cannot be read as a bag: {_reason(error)}")


def _reason(error: Exception) -> str:
    return " ".join(str(error).split())[:200] or type(error).__name__
