"""What a lidar on the ground robot measures, from a recording's stored motion and surface."""

from __future__ import annotations

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from sim.recording.truth import Truth
from sim.sensors.lidar import Lidar

POINT = np.dtype(
    [
        ("x", "<f4"),
        ("y", "<f4"),
        ("z", "<f4"),
        ("intensity", "<f4"),
        ("ring", "<u2"),
        ("time_ns", "<u4"),
    ]
)
"""A point in the lidar's frame at its own time: place [m], cosine of the angle of incidence, number
of the beam from the lowest, time after the start of the revolution [ns]."""


def scan_starts_ns(truth: Truth, lidar: Lidar) -> NDArray[np.int64]:
    """(N,) starts of all revolutions that end before the motion does [ns]."""
    last_ns = int(truth.motion.stamps_ns[-1])
    return np.arange(0, last_ns - lidar.revolution_ns + 1, lidar.revolution_ns)


def lidar_scan(
    truth: Truth, lidar: Lidar, start_ns: int, rng: np.random.Generator
) -> NDArray[np.void]:
    """The points of one revolution, in order of time and then of beam.

    Each point is measured from where the lidar is when its beam fires, and stands in the frame
    of that moment, as a driver without motion compensation gives it.

    Args:
        truth: Truth of the recording.
        lidar: The sensor.
        start_ns: When the revolution starts [ns].
        rng: Source of the noise.

    Returns:
        (N,) array of `POINT`; beams that hit nothing, too near or too far have no point.
    """
    T_body_lidar = lidar.mounting(truth.motion.ground.mounting.T_body_camera)
    times_ns, directions = lidar.times_ns(), lidar.directions()
    poses = [truth.motion.pose("ground", start_ns + int(t)) @ T_body_lidar for t in times_ns]
    rotations = np.array([pose.rotation for pose in poses])
    places = np.array([pose.translation for pose in poses])
    in_world = np.einsum("cij,cbj->cbi", rotations, directions)
    origins = np.broadcast_to(places[:, None], in_world.shape)
    rays = np.concatenate([origins, in_world], axis=-1).astype(np.float32)
    hits = truth.surface("ground").scene.cast_rays(o3d.core.Tensor.from_numpy(rays))
    ranges = hits["t_hit"].numpy().astype(np.float64)
    cosines = np.abs(np.einsum("cbi,cbi->cb", in_world, hits["primitive_normals"].numpy()))
    measured = ranges + lidar.noise_m * rng.standard_normal(ranges.shape)
    near, far = lidar.range_m
    returned = np.isfinite(ranges) & (measured >= near) & (measured <= far)
    returned &= cosines > np.cos(np.radians(lidar.grazing_limit_deg))
    column, beam = np.nonzero(returned)
    points = np.zeros(len(column), POINT)
    places_lidar = measured[returned][:, None] * directions[returned]
    for axis, name in enumerate("xyz"):
        points[name] = places_lidar[:, axis]
    points["intensity"] = cosines[returned]
    points["ring"], points["time_ns"] = beam, times_ns[column]
    return points
