"""Setups: which poses they take, which of them share their maps."""

from __future__ import annotations

from dataclasses import replace

import pytest

from airground.config import Config, MonocularSlam, paper
from airground.core.se3 import SE3
from airground.core.trajectory import Trajectory
from airground.errors import InputError
from evaluation.commands.options import PipelineOptions
from evaluation.commands.sweep import Sweep
from evaluation.setup.setups import (
    EXACT,
    PAPER_DRIFT,
    Given,
    Reference,
    Setup,
    with_companions,
    with_localization,
)


def test_slam_is_the_default_and_the_truth_stands_beside_it() -> None:
    setups = with_companions(Setup(Config()))
    assert (setups[0].poses, setups[0].config) == ("slam", Config())
    assert setups[1] == Setup(Config(), "oracle")
    assert Setup(paper()) in setups
    names = [setup.condition("nominal") for setup in setups]
    assert len(set(names)) == len(names)
    assert names[0].poses == "slam"
    assert names[1].poses == "oracle exact"


def test_what_was_asked_for_is_not_measured_twice() -> None:
    setups = with_companions(Setup(Config(), "oracle"), few=True)
    assert setups.count(Setup(Config(), "oracle")) == 1
    assert setups[0].poses == "oracle"


@pytest.mark.parametrize(
    ("poses", "robots"),
    [
        ("slam", {"mav", "ground"}),
        ("oracle", set()),
        ("slam, exact mav", {"ground"}),
        ("slam, exact ground", {"mav"}),
    ],
)
def test_who_runs_slam(poses: str, robots: set[str]) -> None:
    assert Setup(Config(), poses).slam_robots() == robots  # type: ignore[arg-type]


def test_the_truth_is_asked_for_by_oracles_only() -> None:
    path = Trajectory.from_poses([0], [SE3.identity()])
    brought = Given(mav=path, ground=path)
    assert not Setup(Config()).needs_truth()
    assert Setup(Config(), "slam, exact mav").needs_truth()
    assert not Setup(Config(), "oracle", given=brought).needs_truth()
    assert Setup(Config(), "oracle", given=replace(brought, ground=None)).front_ends() == {
        "mav": "file",
        "ground": "oracle",
    }


def test_setups_share_maps_where_only_later_stages_differ() -> None:
    slam = Setup(Config())
    searched = Setup(with_localization(Config(), heading="search"))
    other_slam = Setup(Config(monocular_slam=MonocularSlam(corners=99)))
    assert slam.maps_like(searched)
    assert not slam.maps_like(other_slam)
    assert not slam.maps_like(Setup(Config(), "oracle"))
    exact = Setup(Config(), "oracle")
    assert exact.maps_like(replace(other_slam, poses="oracle"))
    assert not exact.maps_like(Setup(Config(), "oracle", PAPER_DRIFT))
    assert not exact.maps_like(searched)


def test_drift_needs_an_oracle() -> None:
    drift = ("oracle.drift_mav_cm=1.2",)
    assert PipelineOptions().setup().noise == EXACT
    assert PipelineOptions(poses="oracle", overrides=drift).setup().noise.drift_mav_m == 0.012
    with pytest.raises(InputError, match="give --poses oracle"):
        PipelineOptions(overrides=drift).setup()


def test_results_name_a_reference_with_errors() -> None:
    assert Setup(Config()).condition("nominal").variant == ""
    turned = Setup(Config(), reference=Reference(ground_camera_deg=1.5))
    assert turned.condition("nominal").variant.endswith("turned by 0 and 1.5 deg (MAV, ground)")
    words = ("reference.by=paths", "reference.mav_camera_deg=1")
    assert Sweep(vary=(), out=None, overrides=words[:1]).setup().reference == Reference("paths")
    with pytest.raises(InputError, match="no calibration of cameras"):
        Sweep(vary=(), out=None, overrides=words).setup()
