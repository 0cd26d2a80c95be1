"""What a run claims at each image: the newest accepted alignment, by live poses of both robots."""

from __future__ import annotations

import numpy as np
import pytest

from airground.core.belief import Alignment
from airground.core.events import Aligned
from airground.core.se3 import SE3
from airground.slam.front_end import TrackedPose, Tracking
from evaluation.run.claim_log import ClaimLog
from evaluation.run.onlooker import Seen
from evaluation.table.tracking_log import AnswerLog, FrontEndLog, Tracked
from tests.evaluation.show.scripted_run import mav_frame

MS = 1_000_000


def at(x: float, y: float = 0.0) -> SE3:
    return SE3(np.eye(3), np.array([x, y, 0.0]))


def tracked(robot: str, poses: dict[int, SE3]) -> Tracked:
    """A robot with a pose at each of these times [ms]."""
    answers = [TrackedPose(t * MS, Tracking.TRACKED, pose) for t, pose in poses.items()]
    return Tracked(robot, FrontEndLog(AnswerLog(answers)), None, True)


def both(mav: dict[int, SE3], ground: dict[int, SE3]) -> dict[str, Tracked]:
    return {"mav": tracked("mav", mav), "ground": tracked("ground", ground)}


def aligned(log: ClaimLog, when_ms: int, T_ground_mav: SE3, accepted: bool = True) -> None:
    alignment = Alignment(0, T_ground_mav, 0.9, 0.01, accepted, "" if accepted else "no overlap")
    log.see(Seen(Aligned(0, alignment), 0.0, mav_frame(when_ms * MS), None))


def test_each_image_has_the_newest_accepted_alignment_and_a_ground_pose_at_its_time() -> None:
    log = ClaimLog()
    aligned(log, 100, at(10))
    aligned(log, 150, at(99), accepted=False)
    aligned(log, 200, at(20))
    tracks = both(
        {t: at(1, 2) for t in (50, 110, 190, 200)}, {t: at(t / 100) for t in (0, 60, 120, 180, 240)}
    )
    claims = {stamp // MS: pose.translation[:2] for stamp, pose in log.claims(tracks)}
    assert list(claims) == [110, 190, 200]
    assert claims[110] == pytest.approx([10 + 1 - 1.1, 2])
    assert claims[190] == pytest.approx([10 + 1 - 1.9, 2])
    assert claims[200] == pytest.approx([20 + 1 - 2.0, 2])


def test_nothing_is_claimed_across_a_gap_of_the_ground_robot_or_beyond_its_path() -> None:
    log = ClaimLog()
    aligned(log, 0, at(0))
    tracks = both({t: at(0) for t in (50, 500, 990, 1100)}, {t: at(0) for t in (0, 60, 900, 1000)})
    assert [stamp // MS for stamp, _ in log.claims(tracks)] == [50, 990]


def test_a_live_claim_holds_from_when_it_was_computed() -> None:
    log = ClaimLog(lambda seen: seen.frame.stamp_ns + 70 * MS)
    aligned(log, 100, at(0))
    tracks = both({t: at(0) for t in (110, 160, 170, 200)}, {t: at(0) for t in range(90, 300, 30)})
    assert [stamp // MS for stamp, _ in log.claims(tracks)] == [170, 200]


def test_nothing_is_claimed_without_an_alignment() -> None:
    assert ClaimLog().claims(both({0: at(0)}, {0: at(0)})) == []
