"""What the report's pictures are drawn from: one flight, looked at closely.

Saved as arrays (.npz) and clouds (.ply), never as pickles, so that figures can be redrawn
without running anything again.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from airground.core.arrays import read_only
from airground.core.belief import Belief, CostMap, HeightMap
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from airground.core.surface import AerialSurface, DepthMap
from airground.core.trajectory import Trajectory
from airground.errors import InputError
from evaluation.measure.baselines.matched_images import MatchedImages
from evaluation.measure.showcase.files import Archive, read_cloud, write_cloud


@dataclass(frozen=True, eq=False)
class LocalizationStep:
    """One aerial map in the particle filter (a panel of Fig. 8).

    Attributes:
        cost_map: Of this aerial map, over the search region.
        belief: After taking it in.
        true_u: (2,) where the reference camera really was, in `ground` [m].
    """

    cost_map: CostMap
    belief: Belief
    true_u: NDArray[np.float64]

    def __post_init__(self) -> None:
        object.__setattr__(self, "true_u", read_only(self.true_u, "true_u", (2,), np.float64))


@dataclass(frozen=True, eq=False)
class Showcase:
    """One flight for Fig. 5 to 8 and 15.

    Attributes:
        scene: Which one.
        condition: How it was made, for captions.
        depth_maps: Some of the depth maps that went into `surface`, the reference first.
        depth_errors: For each of them (height, width) float32 [m], depth minus true depth,
            NaN where either is missing.
        surface: The surface fused from them.
        surface_error: (height, width) float32 [m], the same for the fused depth.
        aerial_heights, ground_heights: Height maps of the first localization step.
        aerial_reference: (2,) the reference camera in the frame of `aerial_heights` [m].
        aerial_heading: Turn from that frame to `ground` [rad]. Both are zero for the maps of
            `HeightMapsMade`.
        steps: Successive aerial maps; the first one's cost map is also Fig. 7c.
        ground_cloud: The ground robot's map, in `ground`.
        aerial_cloud: What the MAV added to it, in `ground`.
        mav_path, ground_path: Cameras of both robots over time, as `T_ground_camera`.
        mav_image: (h, w) or (h, w, 3) uint8, a view of the MAV.
        ground_image: (h, w, 3) uint8, a view of the ground robot.
        matched: What ASIFT finds between both robots' images; None where not asked for.
        T_ground_mav: The refined alignment of `surface`; None where it was refused.
    """

    scene: str
    condition: str
    depth_maps: tuple[DepthMap, ...]
    depth_errors: tuple[NDArray, ...]
    surface: AerialSurface
    surface_error: NDArray
    aerial_heights: HeightMap
    ground_heights: HeightMap
    aerial_reference: NDArray[np.float64]
    aerial_heading: float
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
            ("aerial_reference", (2,), np.float64),
            ("ground_image", (None, None, 3), np.uint8),
        ):
            object.__setattr__(self, name, read_only(getattr(self, name), name, shape, dtype))

    def save(self, folder: Path) -> None:
        """Write `showcase.npz`, `ground.ply` and `aerial.ply` into `folder`."""
        folder.mkdir(parents=True, exist_ok=True)
        archive = Archive()
        plain = ("scene", "condition", "surface_error", "aerial_reference", "aerial_heading")
        for name in (*plain, "mav_image", "ground_image"):
            archive.put(name, getattr(self, name))
        for name in ("surface", "aerial_heights", "ground_heights", "mav_path", "ground_path"):
            archive.put(name, getattr(self, name))
        for name in ("matched", "T_ground_mav"):
            archive.put(name, getattr(self, name))
        for name in ("depth_maps", "depth_errors", "steps"):
            archive.put(f"{name}.count", len(getattr(self, name)))
            for i, item in enumerate(getattr(self, name)):
                archive.put(f"{name}.{i}", item)
        archive.write(folder / "showcase.npz")
        write_cloud(folder / "ground.ply", self.ground_cloud)
        write_cloud(folder / "aerial.ply", self.aerial_cloud)

    @classmethod
    def load(cls, folder: Path) -> Showcase:
        """Read back what `save` wrote.

        Raises:
            InputError: A file is missing or is no showcase.
        """
        archive = Archive.read(folder / "showcase.npz")
        try:
            return cls(**_fields(archive), **_clouds(folder))
        except KeyError as error:
            raise InputError(f"{folder / 'showcase.npz'}: entry {error} is missing") from error


def _clouds(folder: Path) -> dict[str, Any]:
    return {
        "ground_cloud": read_cloud(folder / "ground.ply"),
        "aerial_cloud": read_cloud(folder / "aerial.ply"),
    }


def _fields(archive: Archive) -> dict[str, Any]:
    fields: dict[str, Any] = {
        "scene": archive.text("scene"),
        "condition": archive.text("condition"),
        "aerial_heading": archive.number("aerial_heading"),
        "surface": archive.get("surface", AerialSurface),
        "aerial_heights": archive.get("aerial_heights", HeightMap),
        "ground_heights": archive.get("ground_heights", HeightMap),
        "mav_path": archive.get("mav_path", Trajectory),
        "ground_path": archive.get("ground_path", Trajectory),
        "depth_maps": archive.several("depth_maps", DepthMap),
        "steps": archive.several("steps", LocalizationStep),
        "matched": archive.get("matched", MatchedImages) if archive.has("matched") else None,
        "T_ground_mav": archive.get("T_ground_mav", SE3) if archive.has("T_ground_mav") else None,
    }
    for name in ("surface_error", "aerial_reference", "mav_image", "ground_image"):
        fields[name] = archive.array(name)
    count = int(archive.number("depth_errors.count"))
    fields["depth_errors"] = tuple(archive.array(f"depth_errors.{i}") for i in range(count))
    return fields
