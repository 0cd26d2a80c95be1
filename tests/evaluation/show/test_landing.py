"""The animation ends where refinement does, and is a file that browsers play."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from airground.config import Config
from airground.core.se3 import SE3
from airground.pipeline import moved
from evaluation import cli
from evaluation.judge.results import Results
from evaluation.measure.showcase import Showcase
from evaluation.show.figures import landing as module
from evaluation.show.figures.landing import END_MS, MAP_PX, PAUSE_MS, landing, save_landing
from evaluation.show.figures.scene_pictures import render_augmented_map
from tests.evaluation.synthetic_results import make_showcase, make_table

REFINED = SE3.from_heading(0.05, (0.1, 0.0, 0.0))


@pytest.fixture
def showcase(monkeypatch: pytest.MonkeyPatch) -> Showcase:
    monkeypatch.setattr(module, "FALLING", 2)
    monkeypatch.setattr(module, "SETTLING", 1)
    return make_showcase(scale=8)


def test_it_pauses_at_the_guess_and_ends_at_the_alignment(showcase: Showcase) -> None:
    falling, guessed, refined = landing(showcase, REFINED)
    assert (guessed.duration_ms, refined.duration_ms) == (PAUSE_MS, END_MS)
    cloud = showcase.surface.cloud_mav
    view = module._viewpoint(REFINED @ cloud.points)
    for frame, T in ((guessed, showcase.steps[0].belief.T_ground_mav), (refined, REFINED)):
        there = replace(showcase, aerial_cloud=moved(cloud, T))
        drawn = frame.picture[-MAP_PX[1] :]
        np.testing.assert_array_equal(drawn, render_augmented_map(there, view, MAP_PX))
    assert (falling.picture != guessed.picture).any()


def test_it_is_written_as_an_animation(showcase: Showcase, tmp_path: Path) -> None:
    save_landing(tmp_path / "landing.webp", showcase, REFINED)
    with Image.open(tmp_path / "landing.webp") as picture:
        assert picture.n_frames == 3  # type: ignore[attr-defined]
        assert picture.width == module.WIDTH_PX


@pytest.mark.parametrize("refined", [None, REFINED])
def test_the_gallery_has_it_where_the_surface_was_aligned(
    showcase: Showcase,
    refined: SE3 | None,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    kept = replace(showcase, T_ground_mav=refined)
    results = Results(make_table(), Config(), seed=0, showcase=kept)
    monkeypatch.setattr("evaluation.judge.results.read_results", lambda folder: results)
    monkeypatch.setattr("evaluation.show.report.figures.report_figures", lambda *drawn: [])
    with pytest.raises(SystemExit) as exit_:
        cli.main(["gallery", "results/a", "--out", str(tmp_path / "film"), "--animation"])
    assert (exit_.value.code == 0) == (refined is not None)
    assert (tmp_path / "film" / "landing.webp").exists() == (refined is not None)
    assert ("was not aligned" in capsys.readouterr().err) == (refined is None)
