"""Where a run claims that the MAV is, relative to the ground robot, image by image."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from airground.core.events import Aligned
from airground.core.se3 import SE3
from evaluation.run.onlooker import Seen
from evaluation.run.tracking import live_path
from evaluation.table.tracking_log import Tracked

CLAIMS = "claims.tum"
"""Its file in the folder of a run."""
BASELINE_CLAIMS = "baselines"
"""Folder in that folder with such a file, `NAME.tum`, of each baseline that claimed anything."""
LONGEST_GAP_NS = 100_000_000
"""Between poses of the ground robot that are interpolated: three images at 30 Hz."""


def newest_image(seen: Seen) -> int:
    """Stamp of the newest image when an event was seen [ns]: computing takes no recorded time."""
    return seen.frame.stamp_ns


class ClaimLog:
    """An onlooker that notes from when on which relation between the maps was claimed: that of the
    newest accepted alignment. Where the heading is searched, a belief alone claims a place, but no
    pose: its heading may be off by several degrees.

    Args:
        when: Recorded time at which an event was seen [ns].
    """

    def __init__(self, when: Callable[[Seen], int] = newest_image) -> None:
        self._when = when
        self._claimed: list[tuple[int, SE3]] = []

    def see(self, seen: Seen) -> None:
        """Note one event."""
        match seen.event:
            case Aligned(alignment=alignment) if alignment.accepted:
                self._claimed.append((self._when(seen), alignment.T_ground_mav))

    def claims(self, tracked: Mapping[str, Tracked]) -> list[tuple[int, SE3]]:
        """`T_ground_camera_mav_camera` of every image of the MAV with something claimed by then,
        by live poses; the ground robot's are interpolated at the stamps [ns] of these images."""
        return claimed_poses(self._claimed, tracked)


def claimed_poses(
    claimed: Sequence[tuple[int, SE3]], tracked: Mapping[str, Tracked]
) -> list[tuple[int, SE3]]:
    """What relations between the maps claim of the MAV's images.

    Args:
        claimed: `T_ground_mav`, each with the recorded time [ns] from which on it is claimed, until
            the next one; in order of time.
        tracked: Answers of the front ends, by robot ("mav", "ground").

    Returns:
        Stamps [ns] of the images with something claimed by then, and `T_ground_camera_mav_camera`.
    """
    mav, ground = (live_path(tracked[robot].front_end) for robot in ("mav", "ground"))
    if mav is None or ground is None or not claimed:
        return []
    since = np.array([stamp for stamp, _ in claimed])
    made: list[tuple[int, SE3]] = []
    for index, stamp in enumerate(mav.stamps_ns.tolist()):
        newest = int(np.searchsorted(since, stamp, side="right")) - 1
        after = int(np.searchsorted(ground.stamps_ns, stamp))
        if newest < 0 or not 0 < after < len(ground):
            continue
        if int(ground.stamps_ns[after] - ground.stamps_ns[after - 1]) > LONGEST_GAP_NS:
            continue
        T_ground_mav = claimed[newest][1]
        made.append((stamp, ground.at(stamp).inverse() @ T_ground_mav @ mav[index]))
    return made
