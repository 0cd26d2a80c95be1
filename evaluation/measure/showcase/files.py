"""Nested frozen dataclasses as a flat .npz, and clouds as binary PLY."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

import numpy as np
from numpy.typing import NDArray

from airground.core.cloud import PointCloud
from airground.errors import InputError

T = TypeVar("T")

_PLY_POINT = np.dtype(
    [(axis, "<f4") for axis in ("x", "y", "z")]
    + [(channel, "u1") for channel in ("red", "green", "blue")]
)


@dataclass
class Archive:
    """Arrays under dotted names: `surface.camera.fx`."""

    entries: dict[str, NDArray] = field(default_factory=dict)

    def put(self, name: str, value: object) -> None:
        """Store a number, a text, an array, or a dataclass of such; None leaves no entry."""
        if is_dataclass(value) and not isinstance(value, type):
            for member in fields(value):
                self.put(f"{name}.{member.name}", getattr(value, member.name))
        elif value is not None:
            self.entries[name] = np.asarray(value)

    def has(self, name: str) -> bool:
        """Whether a dataclass was stored under this name."""
        return any(entry.startswith(f"{name}.") for entry in self.entries)

    def array(self, name: str) -> NDArray:
        return self.entries[name]

    def number(self, name: str) -> float:
        return float(self.entries[name])

    def text(self, name: str) -> str:
        return str(self.entries[name])

    def get(self, name: str, kind: type[T]) -> T:
        """Rebuild a dataclass from its entries, by the types of its fields."""
        hints = get_type_hints(kind)
        values = {m.name: self._member(f"{name}.{m.name}", hints[m.name]) for m in fields(kind)}  # type: ignore[arg-type]
        return kind(**values)

    def several(self, name: str, kind: type[T]) -> tuple[T, ...]:
        """Rebuild a tuple that was stored as `name.0`, `name.1`, ... and `name.count`."""
        return tuple(
            self.get(f"{name}.{i}", kind) for i in range(int(self.number(f"{name}.count")))
        )

    def _member(self, name: str, hint: Any) -> Any:
        if is_dataclass(hint):
            return self.get(name, hint)  # type: ignore[arg-type]
        if name not in self.entries and type(None) in getattr(hint, "__args__", ()):
            return None
        value = self.entries[name]
        return hint(value) if hint in (int, float, str, bool) else value

    def write(self, path: Path) -> None:
        np.savez_compressed(path, **self.entries)  # type: ignore[arg-type]

    @classmethod
    def read(cls, path: Path) -> Archive:
        try:
            with np.load(path, allow_pickle=False) as stored:
                return cls({name: stored[name] for name in stored.files})
        except (OSError, ValueError) as error:
            raise InputError(f"{path}: no readable showcase ({error})") from error


def write_cloud(path: Path, cloud: PointCloud) -> None:
    """Write points and colours as binary little-endian PLY."""
    points = np.empty(len(cloud), _PLY_POINT)
    for i, axis in enumerate(("x", "y", "z")):
        points[axis] = cloud.points[:, i]
    for i, channel in enumerate(("red", "green", "blue")):
        points[channel] = cloud.colours[:, i]
    with path.open("wb") as file:
        file.write(_ply_header(len(cloud)).encode("ascii"))
        file.write(points.tobytes())


def read_cloud(path: Path) -> PointCloud:
    """Read what `write_cloud` wrote.

    Raises:
        InputError: The file is missing or is another kind of PLY.
    """
    try:
        content = path.read_bytes()
        count = (len(content) - content.index(b"end_header\n") - 11) // _PLY_POINT.itemsize
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: no readable point cloud ({error})") from error
    header = _ply_header(count).encode("ascii")
    if not content.startswith(header):
        raise InputError(f"{path}: expected {count} points with x y z red green blue")
    points = np.frombuffer(content, _PLY_POINT, count, len(header))
    xyz = np.stack([points[axis] for axis in ("x", "y", "z")], axis=1)
    rgb = np.stack([points[channel] for channel in ("red", "green", "blue")], axis=1)
    return PointCloud(xyz, rgb)


def _ply_header(count: int) -> str:
    properties = [f"property float {axis}" for axis in ("x", "y", "z")]
    properties += [f"property uchar {channel}" for channel in ("red", "green", "blue")]
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {count}", *properties]
    return "\n".join([*lines, "end_header", ""])
