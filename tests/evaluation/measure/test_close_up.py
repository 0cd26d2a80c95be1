"""Data for pictures gathered in a run, and the gallery drawn from it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from PIL import Image

from airground.augmentation import AugmentedMap
from airground.config import Config
from airground.core.belief import Alignment
from airground.core.cloud import Source
from airground.core.events import Aligned, CostMapComputed
from airground.core.se3 import SE3
from airground.io.recording import Recording
from evaluation import cli
from evaluation.measure import close_up as module
from evaluation.measure.close_up import CloseUp
from evaluation.measure.showcase import Showcase
from evaluation.setup.setups import EXACT, Setup
from evaluation.show.figures.showcase_figures import showcase_figures
from evaluation.show.figures.style import save_picture
from evaluation.table.tracking_log import AnswerLog, FrontEndLog, Tracked
from tests.evaluation.show import scripted_run as run
from tests.evaluation.show.scripted_run import seen_events, show

RECORDING = cast(
    Recording,
    SimpleNamespace(
        scene="scripted",
        sensors="none",
        mav=SimpleNamespace(image_at=lambda stamp_ns: run.mav_frame(stamp_ns).image),
        ground=SimpleNamespace(image_at=lambda stamp_ns: run.ground_frame(stamp_ns).image),
    ),
)
SOURCES = np.array([Source.GROUND, Source.MAV, Source.MAV], np.uint8)


def result() -> tuple[dict[str, Tracked], AugmentedMap]:
    frames = {"mav": run.mav_frame(2 * run.SECOND), "ground": run.ground_frame(run.SECOND)}
    tracked = {
        robot: Tracked(robot, FrontEndLog(AnswerLog([frame.pose])), None, slam=True)
        for robot, frame in frames.items()
    }
    return tracked, AugmentedMap(run.CLOUD, SOURCES)


def close_up() -> CloseUp:
    return CloseUp(RECORDING, run.TRUTH, Setup(Config(), "slam", EXACT))


@pytest.fixture
def kept() -> Showcase:
    watcher = close_up()
    show(watcher, seen_events())
    showcase = watcher.showcase(*result())
    assert showcase is not None
    return showcase


def test_it_keeps_what_the_events_carried(kept: Showcase) -> None:
    assert kept.scene == "scripted"
    assert kept.surface is run.SURFACE
    (step,) = kept.steps
    assert step.belief is run.BELIEF
    assert step.cost_map is run.COSTS
    assert kept.T_ground_mav is run.T_GROUND_MAV
    np.testing.assert_allclose(step.true_u, (run.T_GROUND_MAV @ run.DOWN.translation)[:2])
    np.testing.assert_allclose(np.nanmedian(kept.depth_errors[0]), 0.02, atol=1e-6)
    assert len(kept.ground_cloud) == 1
    assert len(kept.aerial_cloud) == 2
    np.testing.assert_allclose(kept.mav_path[0].matrix(), (run.T_GROUND_MAV @ run.DOWN).matrix())


def test_later_maps_are_not_kept() -> None:
    watcher = close_up()
    for _ in range(5):
        show(watcher, seen_events())
    showcase = watcher.showcase(*result())
    assert showcase is not None
    assert len(showcase.steps) == 3
    assert len(showcase.depth_maps) == 1


def test_costs_that_the_filter_did_not_compute_are_computed_for_the_picture() -> None:
    watcher = close_up()
    events = [seen for seen in seen_events() if not isinstance(seen.event, CostMapComputed)]
    heights = [seen for seen in events if type(seen.event).__name__ == "HeightMapsMade"]
    show(watcher, [replace(seen) for seen in events])
    assert heights
    showcase = watcher.showcase(*result())
    assert showcase is not None
    assert np.isfinite(showcase.steps[0].cost_map.costs).any()


def test_a_first_surface_that_was_not_aligned_is_refined_for_the_picture(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    refined = next(seen for seen in seen_events() if isinstance(seen.event, Aligned)).event
    assert isinstance(refined, Aligned)
    starts = []

    def refine(stamp_ns: int, start: SE3, *_: object) -> Alignment:
        starts.append(start)
        return refined.alignment

    monkeypatch.setattr(module, "refine", refine)
    watcher = close_up()
    show(watcher, [seen for seen in seen_events() if not isinstance(seen.event, Aligned)])
    showcase = watcher.showcase(*result())
    assert showcase is not None
    assert showcase.T_ground_mav is run.T_GROUND_MAV
    assert starts == [run.BELIEF.T_ground_mav]


def test_a_refused_alignment_is_not_kept() -> None:
    watcher = close_up()
    show(watcher, seen_events(accepted=False))
    showcase = watcher.showcase(*result())
    assert showcase is not None
    assert showcase.T_ground_mav is None


def test_depth_maps_of_surfaces_before_the_first_located_one_are_left_out() -> None:
    watcher = close_up()
    show(watcher, seen_events()[:8])  # up to the surface: a robot was lost
    show(watcher, seen_events()[5:])
    showcase = watcher.showcase(*result())
    assert showcase is not None
    assert len(showcase.depth_maps) == run.SURFACE.depth_maps == 1


def test_a_run_that_located_nothing_keeps_nothing() -> None:
    watcher = close_up()
    show(watcher, seen_events()[:5])
    assert watcher.showcase(*result()) is None


@pytest.mark.slow
@pytest.mark.subject(
    "evaluation/measure/close_up.py",
    "evaluation/measure/showcase.py",
    "evaluation/run/onlooker.py",
    "evaluation/setup",
    "evaluation/show/figures",
    "evaluation/table",
    "airground/augmentation.py",
    "airground/config.py",
    "airground/core",
    "airground/slam/front_end.py",
    "airground/tracking.py",
    but={
        "airground/io": "the recording is made up",
        "sim": "so is the truth",
        "evaluation/cli.py": "for another test",
        "evaluation/show/rerun_view": "for another test",
    },
)
def test_it_survives_a_folder_and_is_drawn(kept: Showcase, tmp_path: Path) -> None:
    kept.save(tmp_path / "showcase")
    drawn = list(showcase_figures(Showcase.load(tmp_path / "showcase")))
    for figure in drawn:
        save_picture(figure.figure, tmp_path, figure.name)
        with Image.open(tmp_path / f"{figure.name}.png") as picture:
            assert picture.width > 500
    assert {"fig06_depth_maps", "fig07_height_maps", "fig08_particles"} <= {f.name for f in drawn}


def test_a_gallery_of_nothing_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        cli.main(["gallery", str(tmp_path / "missing"), "--out", str(tmp_path / "out")])
    assert "no such folder" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
