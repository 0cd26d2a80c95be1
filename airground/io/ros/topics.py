"""Which topics of a bag are a robot's sensors: by name where they are given, else by type."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import PurePosixPath

from airground.core.cloud import Source
from airground.errors import RecordingError
from airground.io.ros.bag import Bag, Topic
from airground.io.ros.images import KINDS, shows_colour, shows_depth

INFO = "sensor_msgs/msg/CameraInfo"
IMU = "sensor_msgs/msg/Imu"
MAGNETIC = "sensor_msgs/msg/MagneticField"
ROLES = ("image", "depth", "info", "imu", "magnetic")
LEFT_OUT = "none"
"""In place of a topic: the robot is read without this sensor."""
TRANSPORTS = ("compressed", "compressedDepth")
REGISTERED = ("aligned_depth_to_color", "depth_registered", "registered")
"""What drivers call depth that was registered to the colour image."""


@dataclass(frozen=True)
class Chosen:
    """The topics of one robot; None where it has no such sensor."""

    image: Topic
    depth: Topic | None
    info: Topic | None
    imu: Topic | None
    magnetic: Topic | None


def choose(bag: Bag, robot: Source, given: Mapping[str, str]) -> Chosen:
    """The topics of a robot in a bag.

    Args:
        bag: The bag.
        robot: Robot: one with depth needs images in colour.
        given: Topics by role (`ROLES`), or "none".

    Raises:
        RecordingError: A topic is missing, or several could be meant.
    """
    unknown = [role for role in given if role not in ROLES]
    if unknown:
        raise RecordingError(f"--topics {unknown[0]}=...: known roles: {', '.join(ROLES)}")
    chooser = _Chooser(bag, robot, given)
    pictures = bag.of_kind(*KINDS)
    deep = {
        topic.name: shows_depth(bag.first(topic.name), topic.kind, topic.name) for topic in pictures
    }
    depth = None
    if robot == Source.GROUND:
        depth = chooser.one("depth", [topic for topic in pictures if deep[topic.name]])
        if depth is None:
            raise RecordingError(
                f"{bag.path}: has no depth images, which the ground robot needs; topics: "
                f"{_listed(bag)}"
            )
    flat = [topic for topic in pictures if not deep[topic.name]]
    if robot == Source.GROUND and "image" not in given:
        flat = [topic for topic in flat if _is_colour(bag, topic)]
    image = chooser.one("image", flat)
    if image is None:
        kind = "images in colour" if robot == Source.GROUND else "images"
        raise RecordingError(f"{bag.path}: has no {kind}; topics: {_listed(bag)}")
    return Chosen(
        image,
        depth,
        chooser.one("info", [one for one in bag.of_kind(INFO) if _beside(one, image)]),
        chooser.one("imu", bag.of_kind(IMU)),
        chooser.one("magnetic", bag.of_kind(MAGNETIC)),
    )


@dataclass(frozen=True)
class _Chooser:
    bag: Bag
    robot: Source
    given: Mapping[str, str]

    def one(self, role: str, candidates: list[Topic]) -> Topic | None:
        """The topic for a role; RecordingError where it is missing or several could be meant."""
        name = self.given.get(role)
        if name == LEFT_OUT:
            return None
        if name is not None:
            if name not in self.bag.topics:
                raise RecordingError(
                    f"{self.bag.path}: has no topic {name}; topics: {_listed(self.bag)}"
                )
            return self.bag.topics[name]
        for preferred in self._preferences():
            chosen = [topic for topic in candidates if preferred(topic)]
            candidates = chosen or candidates
        if len(candidates) > 1:
            names = ", ".join(topic.name for topic in candidates)
            raise RecordingError(
                f"{self.bag.path}: several topics could be the {role}: {names}; choose with "
                f"--topics {role}=TOPIC"
            )
        return candidates[0] if candidates else None

    def _preferences(self) -> list[Callable[[Topic], bool]]:
        robot = self.robot.name.lower()
        return [
            lambda topic: robot in PurePosixPath(topic.name).parts,
            lambda topic: any(word in topic.name for word in REGISTERED),
            # Of an image in two transports, the raw one.
            lambda topic: base_name(topic.name) not in self.bag.topics or not _transported(topic),
        ]


def base_name(name: str) -> str:
    """A topic's name without that of its transport."""
    path = PurePosixPath(name)
    return str(path.parent) if path.name in TRANSPORTS else name


def _transported(topic: Topic) -> bool:
    return PurePosixPath(topic.name).name in TRANSPORTS


def _beside(info: Topic, image: Topic) -> bool:
    """Whether a camera's calibration is of the camera that takes these images."""
    return PurePosixPath(info.name).parent == PurePosixPath(base_name(image.name)).parent


def _is_colour(bag: Bag, topic: Topic) -> bool:
    try:
        return shows_colour(bag.first(topic.name), topic.kind)
    except ValueError as error:
        raise RecordingError(f"{bag.path}: {topic.name}: {error}") from None


def _listed(bag: Bag) -> str:
    return ", ".join(bag.topics) or "none"
