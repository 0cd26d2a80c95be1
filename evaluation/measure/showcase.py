"""The data behind the pictures of one flight, and its files.

Files are arrays (.npz) and clouds (.ply), without pickles: figures are redrawn from them.
"""

from __future__ import annotations

from dataclasses import MISSING, dataclass, fields, is_dataclass
from pathlib import Path
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from airground.core.arrays import read_only
from airground.core.belief import Belief, CostMap, HeightMap
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.core.surface import AerialSurface, DepthMap
from airground.core.trajectory import Trajectory
from airground.errors import InputError
from airground.io.array_files import UNREADABLE_ARRAYS, read_arrays
from airground.io.ply import read_ply, write_ply
from evaluation.measure.baselines.matched_images import MatchedImages

ARRAYS = "showcase.npz"
CLOUDS = {"ground_cloud": "ground.ply", "aerial_cloud": "aerial.ply"}


@dataclass(frozen=True, eq=False)
class LocalizationStep:
    """One aerial map in the particle filter (a panel of Fig. 8).

    Attributes:
        cost_map: Costs of this aerial map over the search region.
        belief: Belief after the update with this aerial map.
        true_u: (2,) true position of the reference camera in `ground` [m].
    """

    cost_map: CostMap
    belief: Belief
    true_u: NDArray[np.float64]

    def __post_init__(self) -> None:
        object.__setattr__(self, "true_u", read_only(self.true_u, "true_u", (2,), np.float64))


@dataclass(frozen=True, eq=False)
class Showcase:
    """One flight for Fig. 2, 3, 5 to 8 and 15.

    Attributes:
        scene: Name of the scene.
        condition: Conditions of the run, for captions.
        depth_maps: Some of the depth maps in `surface`, the reference first.
        depth_errors: (height, width) float32 for each of `depth_maps`: depth minus true depth
            [m], NaN where either is missing.
        surface: The first aerial surface that was located.
        surface_error: (height, width) float32: fused depth minus true depth [m].
        aerial_heights: Height map of `surface`, with the reference camera at the origin.
        ground_heights: Height map of the ground robot at the same time.
        steps: Successive aerial maps, that of `surface` first (its cost map is Fig. 7c).
        ground_cloud: The ground robot's map, in `ground`.
        aerial_cloud: The points that the MAV added to it, in `ground`.
        mav_path, ground_path: Live camera poses `T_ground_camera` of each robot.
        mav_image: (h, w) or (h, w, 3) uint8 image of the MAV.
        ground_image: (h, w, 3) uint8 image of the ground robot.
        matched: ASIFT matches between images of both robots; None if not computed.
        T_ground_mav: Refined alignment of `surface`; None if refinement refused it.
    """

    scene: str
    condition: str
    depth_maps: tuple[DepthMap, ...]
    depth_errors: tuple[NDArray, ...]
    surface: AerialSurface
    surface_error: NDArray
    aerial_heights: HeightMap
    ground_heights: HeightMap
    steps: tuple[LocalizationStep, ...]
    ground_cloud: PointCloud
    aerial_cloud: PointCloud
    mav_path: Trajectory
    ground_path: Trajectory
    mav_image: NDArray[np.uint8]
    ground_image: NDArray[np.uint8]
    matched: MatchedImages | None = None
    T_ground_mav: SE3 | None = None

    def __post_init__(self) -> None:
        if len(self.depth_errors) != len(self.depth_maps):
            raise ValueError("depth_errors: expected one for each depth map")
        errors = tuple(
            read_only(error, "depth_errors", made.depth.shape, np.float32)
            for error, made in zip(self.depth_errors, self.depth_maps, strict=True)
        )
        object.__setattr__(self, "depth_errors", errors)
        for name, shape, dtype in (
            ("surface_error", self.surface.depth.shape, np.float32),
            ("mav_image", np.shape(self.mav_image), np.uint8),
            ("ground_image", (None, None, 3), np.uint8),
        ):
            object.__setattr__(self, name, read_only(getattr(self, name), name, shape, dtype))

    def save(self, folder: Path) -> None:
        """Write `showcase.npz`, `ground.ply` and `aerial.ply` into `folder`."""
        folder.mkdir(parents=True, exist_ok=True)
        entries: dict[str, NDArray] = {}
        for member in fields(self):
            if member.name not in CLOUDS:
                entries |= _flat(member.name, getattr(self, member.name))
        np.savez_compressed(folder / ARRAYS, **entries)  # type: ignore[arg-type]
        for name, file in CLOUDS.items():
            write_ply(folder / file, getattr(self, name))

    @classmethod
    def load(cls, folder: Path) -> Showcase:
        """Read back what `save` wrote; raises InputError if a file is missing, damaged or of
        another kind."""
        path = folder / ARRAYS
        try:
            entries = read_arrays(path)
            members: dict[str, Any] = {
                name: _built(name, hint, entries)
                for name, hint in get_type_hints(cls).items()
                if name not in CLOUDS
            }
        except KeyError as error:
            raise InputError(f"{path}: entry {error} is missing") from error
        except (*UNREADABLE_ARRAYS, TypeError) as error:
            raise InputError(f"{path}: no readable showcase ({error})") from error
        clouds = {name: read_ply(folder / file)[0] for name, file in CLOUDS.items()}
        try:
            return cls(**members | clouds)
        except ValueError as error:
            raise InputError(f"{path}: no readable showcase ({error})") from None


def _flat(name: str, value: Any) -> dict[str, NDArray]:
    """A number, a text, an array, or a dataclass or tuple of these, as arrays by dotted name.
    `surface.camera.fx` is such a name. None has no entry."""
    if value is None:
        return {}
    if is_dataclass(value):
        parts = {member.name: getattr(value, member.name) for member in fields(value)}
    elif isinstance(value, tuple):
        parts = {"count": len(value), **{str(i): item for i, item in enumerate(value)}}
    else:
        return {name: np.asarray(value)}
    flat: dict[str, NDArray] = {}
    for part, item in parts.items():
        flat |= _flat(f"{name}.{part}", item)
    return flat


def _built(name: str, kind: Any, entries: dict[str, NDArray]) -> Any:
    """Inverse of `_flat` for a value of a declared type. A member with a default may be missing, in
    results from before it was there."""

    def is_stored(name: str) -> bool:
        return any(entry == name or entry.startswith(f"{name}.") for entry in entries)

    if get_origin(kind) in (Union, UnionType):
        return _built(name, get_args(kind)[0], entries) if is_stored(name) else None
    if get_origin(kind) is tuple:
        count = int(entries[f"{name}.count"])
        return tuple(_built(f"{name}.{i}", get_args(kind)[0], entries) for i in range(count))
    if is_dataclass(kind):
        hints = get_type_hints(kind)
        return kind(  # type: ignore[operator]
            **{
                member.name: _built(f"{name}.{member.name}", hints[member.name], entries)
                for member in fields(kind)
                if member.default is MISSING or is_stored(f"{name}.{member.name}")
            }
        )
    value = entries[name]
    return kind(value) if kind in (int, float, str, bool) else value
