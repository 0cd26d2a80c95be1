"""Real pictures through the dense stage: surface, claims and alignments of a real pair."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from airground.io.tum import read_tum
from tests.real_pair import MIRROR, T_MAV_GROUND, make_pair, run_pair_of


@pytest.mark.slow(minutes=2)
@pytest.mark.skipif(not MIRROR.exists(), reason="the sample of 7-Scenes is not on this machine")
def test_a_real_pair_is_reconstructed_located_and_aligned(tmp_path: Path) -> None:
    made = make_pair(tmp_path / "pair")
    out = tmp_path / "out"
    assert run_pair_of(made, out) == 0
    summary = json.loads((out / "summary.json").read_text())
    surface = summary["surface"]
    assert surface["compared"] == summary["aerial_surfaces"] >= 2
    assert surface["error_median_m"] < 0.04
    assert surface["completeness"] > 0.5
    assert summary["accepted"] >= 1
    assert (out / "figures" / "surfaces.png").stat().st_size > 0
    assert "measured depth" in (out / "report.html").read_text()

    # Both robots' poses are of one trajectory, so that the true relation is known.
    found, cameras = read_tum(out / "T_ground_mav.tum"), read_tum(made / "mav.tum")
    for index, stamp_ns in enumerate(found.stamps_ns.tolist()):
        camera = cameras.at(stamp_ns)
        off = (found[index] @ camera).translation
        off = off - (T_MAV_GROUND.inverse() @ camera).translation
        assert np.linalg.norm(off) < 0.12
        assert np.rad2deg((found[index] @ T_MAV_GROUND).angle()) < 4.0
