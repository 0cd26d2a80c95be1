"""Figures show what the data says: failures, medians, orientation, true colours."""

import dataclasses
import hashlib
import re
import zlib
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from airground.core.belief import HeightMap
from airground.core.cloud import PointCloud
from airground.core.se3 import SE3
from evaluation.measure.showcase import LocalizationStep, Showcase
from evaluation.show.figures.boxes import draw_boxes, log_axis
from evaluation.show.figures.fig05_15_augmented_map import as_believed, refinement_figure
from evaluation.show.figures.fig06_depth_maps import completeness, depth_maps_figure
from evaluation.show.figures.fig07_height_maps import (
    draw_grid,
    height_maps_figure,
    seen_part,
)
from evaluation.show.figures.fig08_particles import ellipse_points, particles_figure
from evaluation.show.figures.fig11_12_localization_error import (
    localization_error_figure,
    spread_figure,
)
from evaluation.show.figures.fig13_14_refinement_error import (
    BeforeAfter,
    refinement_translation_figure,
)
from evaluation.show.figures.scene_pictures import BACKGROUND
from evaluation.show.figures.showcase_figures import showcase_figures
from evaluation.show.figures.style import (
    COLUMN_IN,
    PICTURE_DPI,
    SMALL_PT,
    WIDE_IN,
    save_figure,
    save_picture,
)
from evaluation.show.figures.table1_timing import timing_figure
from evaluation.show.report.figures import report_figures
from tests.evaluation.synthetic_results import BEST, PAPER, make_showcase, make_table


@pytest.fixture(scope="module")
def showcase() -> Showcase:
    return make_showcase(scale=4)


def _texts(figure: Figure) -> list[str]:
    from matplotlib.text import Text

    return [text.get_text() for text in figure.findobj(Text) if isinstance(text, Text)]


def test_failures_are_counted_above_a_box() -> None:
    figure = Figure()
    axes = figure.subplots()
    log_axis(axes, [[0.1, 0.2, np.nan, np.inf]], floor=1e-3)
    draw_boxes(axes, {"a": [[0.1, 0.2, np.nan, np.inf]]}, ["black"])
    assert "2✕" in _texts(figure)


def test_a_box_that_failures_reach_ends_at_the_top_of_the_axis() -> None:
    axes = Figure().subplots()
    values = [0.1, 0.2, np.nan, np.nan]
    log_axis(axes, [values], floor=1e-3)
    draw_boxes(axes, {"a": [values]}, ["black"])
    (box,) = axes.patches
    outline = box.get_path().vertices[:, 1]  # type: ignore[index]
    assert np.max(outline) == pytest.approx(axes.get_ylim()[1])


def test_every_outlier_is_drawn() -> None:
    axes = Figure().subplots()
    values = np.append(np.linspace(0.1, 0.11, 30), [5.0, 7.0])
    log_axis(axes, [values], floor=1e-3)
    draw_boxes(axes, {"a": [values]}, ["black"])
    np.testing.assert_array_equal(np.sort(axes.lines[-2].get_ydata()), [5.0, 7.0])


def test_all_failed_still_draws() -> None:
    figure = localization_error_figure({"lost": np.full((3, 12), np.nan)})
    assert _texts(figure).count("3✕") == 12


def test_fig11_shows_the_papers_two_points() -> None:
    figure = localization_error_figure({"a": np.full((4, 12), 0.1)})
    assert {"paper 65%", "paper 89%"} <= set(_texts(figure))


def test_fig13_writes_medians_and_the_papers() -> None:
    figure = refinement_translation_figure({"a": BeforeAfter([0.3, 0.31, 0.32], [0.004, 0.003])})
    assert {"0.31", "0.0035", "paper\n0.076 m"} <= set(_texts(figure))


def test_timing_says_what_was_not_run() -> None:
    figure = timing_figure({"icp": np.array([100.0, 120.0])})
    texts = _texts(figure)
    assert "ICP alignment" in texts
    assert texts.count("not run") == 8
    assert "Height maps" not in texts


def test_grids_are_drawn_with_x_right_and_y_up() -> None:
    axes = Figure().subplots()
    cells = np.zeros((3, 2))
    cells[2, 0] = 1.0
    shown = draw_grid(axes, cells, np.array([1.0, 5.0]), 10.0, "gray")
    assert shown.get_array().shape == (2, 3)
    assert shown.get_array()[0, 2] == 1.0
    assert shown.origin == "lower"
    np.testing.assert_allclose(shown.get_extent(), [0.95, 1.25, 4.95, 5.15])


def test_the_seen_part_of_a_map_keeps_every_height_at_its_place() -> None:
    heights = np.full((9, 8), np.nan, np.float32)
    heights[2, 5], heights[4, 3] = 0.3, 0.7
    part = seen_part(HeightMap(heights, np.array([-1.0, 2.0]), 10.0))
    assert part.heights.shape == (3, 3)
    (left, top), (right, bottom) = np.argwhere(np.isfinite(part.heights))
    np.testing.assert_allclose(part.origin + np.array([left, top]) / 10, [-0.8, 2.5])
    np.testing.assert_allclose(part.origin + np.array([right, bottom]) / 10, [-0.6, 2.3])


def test_a_map_without_heights_has_no_smaller_part() -> None:
    empty = HeightMap(np.full((4, 5), np.nan, np.float32), np.zeros(2), 10.0)
    assert seen_part(empty) is empty


@pytest.mark.parametrize("angle", [0.3, -1.1, 2.0])
def test_the_ellipse_follows_the_covariance(angle: float) -> None:
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    covariance = turn @ np.diag([0.04, 0.01]) @ turn.T
    corners = ellipse_points(np.array([1.0, 2.0]), covariance) - [1.0, 2.0]
    corner = max(corners, key=np.linalg.norm)
    # The larger half axis is 2 sigma long and points along the larger eigenvector.
    assert np.linalg.norm(corner) == pytest.approx(0.4)
    assert abs(corner @ turn[:, 0]) == pytest.approx(0.4)


def test_an_ellipse_has_the_covariance_it_was_made_of() -> None:
    covariance = np.array([[0.05, 0.02], [0.02, 0.03]])
    points = ellipse_points(np.array([1.0, 2.0]), covariance) - (1.0, 2.0)
    distance = np.einsum("ni,ij,nj->n", points, np.linalg.inv(covariance), points)
    np.testing.assert_allclose(distance, 4.0)


def test_completeness_is_the_share_of_pixels_with_depth() -> None:
    assert completeness(np.array([[0.1, np.nan], [np.nan, np.nan]])) == 0.25


def test_refinement_is_cut_where_both_maps_have_the_heap(showcase: Showcase) -> None:
    def cloud(*heaps: tuple[float, float]) -> PointCloud:
        """A floor of 2 x 2 m with heaps, 0.3 m square and high, at (x, y)."""
        x, y = (axis.ravel() for axis in np.meshgrid(*[np.linspace(-1, 1, 101)] * 2))
        near = [(abs(x - hx) <= 0.15) & (abs(y - hy) <= 0.15) for hx, hy in heaps]
        z = 0.3 * np.any(near, axis=0)
        return PointCloud(np.stack([x, y, z], axis=1), np.zeros((len(x), 3), np.uint8))

    shift = SE3(np.eye(3), np.array([0.2, 0.0, 0.1]))
    surface = dataclasses.replace(showcase.surface, cloud_mav=cloud((0.0, 0.5), (0.5, -0.8)))
    seen = cloud((0.2, 0.5), (-0.5, 0.0))  # the first heap, where `shift` puts it, and another
    seen = dataclasses.replace(seen, points=seen.points + np.array([0, 0, 0.1], np.float32))
    both = dataclasses.replace(showcase, surface=surface, ground_cloud=seen)
    before, after = refinement_figure(both, shift).axes
    for axes, offset in ((before, 0.2), (after, 0.0)):
        aerial, ground = (np.asarray(drawn.get_offsets()) for drawn in axes.collections)
        tops = [points[points[:, 1] > points[:, 1].min() + 0.2, 0] for points in (aerial, ground)]
        assert tops[1].min() == pytest.approx(0.05, abs=0.03)
        assert tops[1].min() - tops[0].min() == pytest.approx(offset, abs=0.03)


def test_pictures_of_a_flight_state_their_numbers(showcase: Showcase) -> None:
    assert any("of pixels" in text for text in _texts(depth_maps_figure(showcase)))
    assert "lowest cost" in _texts(height_maps_figure(showcase))
    assert any("spread" in text for text in _texts(particles_figure(showcase.steps)))


def test_the_same_figure_gives_the_same_bytes(tmp_path: Path) -> None:
    def digests(folder: str) -> list[str]:
        figure = refinement_translation_figure({"a": BeforeAfter([0.3, 0.2], [0.01, 0.02])})
        save_figure(figure, tmp_path / folder, "f")
        return [
            hashlib.sha256((tmp_path / folder / f"f.{ending}").read_bytes()).hexdigest()
            for ending in ("png", "pdf")
        ]

    assert digests("one") == digests("two")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is full")
def test_a_full_disk_is_said_to_be_full(tmp_path: Path) -> None:
    figure = Figure()
    figure.add_subplot().plot([1.0, 2.0])
    (tmp_path / "f.pdf").symlink_to("/dev/full")
    with pytest.raises(OSError, match="No space left"):
        save_figure(figure, tmp_path, "f")


def test_every_figure_fits_a_paper(showcase: Showcase, tmp_path: Path) -> None:
    table = make_table(conditions=(BEST, PAPER), sequences=3)
    drawn = list(report_figures(table, [BEST, PAPER], showcase))
    assert len(drawn) >= 11
    for one in drawn:
        save_figure(one.figure, tmp_path, one.name)
        pdf = (tmp_path / f"{one.name}.pdf").read_bytes()
        (box,) = re.findall(rb"/MediaBox \[ ?0 0 ([\d.]+) ", pdf)
        assert float(box) / 72 == pytest.approx(WIDE_IN if one.wide else COLUMN_IN), one.name
        assert b"/Type3" not in pdf, one.name
        assert b"/FontFile2" in pdf, one.name
        sizes = font_sizes_pt(pdf)
        assert min(sizes) >= SMALL_PT, (one.name, sorted(sizes))
        assert overhang_in(one.figure) < CUT_IN, one.name


@pytest.fixture(scope="module")
def lost(showcase: Showcase) -> Showcase:
    """The same flight with particles together in a wrong place, and nothing aligned."""
    wrong = np.array([1.4, -0.9])

    def moved(step: LocalizationStep) -> LocalizationStep:
        belief = step.belief
        particles, estimate = belief.particles.copy(), belief.estimate.copy()
        estimate[:2] = step.true_u + wrong
        particles[:, :2] = estimate[:2] + 0.02 * np.sin(particles[:, :2] * 1e3)
        covariance = np.diag([4e-4, 4e-4])
        changed = dataclasses.replace(
            belief, particles=particles, estimate=estimate, covariance=covariance
        )
        return dataclasses.replace(step, belief=changed)

    return dataclasses.replace(
        showcase,
        steps=tuple(map(moved, showcase.steps)),
        aerial_cloud=PointCloud(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint8)),
        T_ground_mav=None,
    )


CUT_IN = 0.02
"""What a figure's text may reach beyond its edge [in]: about a pixel of its picture's width in a
page, and the rounding of text to pixels."""


def overhang_in(figure: Figure) -> float:
    """How far the drawing reaches beyond the figure's edges [in]."""
    figure.set_dpi(PICTURE_DPI)
    box, (width, height) = figure.get_tightbbox(), figure.get_size_inches()
    return max(-box.x0, -box.y0, box.x1 - width, box.y1 - height)


def test_what_is_cut_off_is_noticed(tmp_path: Path) -> None:
    figure = Figure(figsize=(2, 2), layout="constrained")
    figure.subplots().set_title("a title that is much longer than its axes", loc="left")
    save_picture(figure, tmp_path, "long")
    assert overhang_in(figure) > 0.5


def test_the_inset_shows_the_particles_where_they_are_wrong(lost: Showcase) -> None:
    (panel, *_) = particles_figure(lost.steps).axes
    (inset,) = panel.child_axes
    (left, right), (bottom, top) = inset.get_xlim(), inset.get_ylim()
    x, y = lost.steps[0].belief.particles[:, :2].T
    assert ((x > left) & (x < right) & (y > bottom) & (y < top)).all()


@pytest.mark.parametrize("sigmas_m", [(20.0, 10.0), (0.01, 500.0)])
def test_a_very_large_ellipse_is_in_its_picture_and_not_cut(
    lost: Showcase, sigmas_m: tuple[float, float], tmp_path: Path
) -> None:
    """Also where the particles are close together, so that an inset has only a part of it."""
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    wide = turn @ np.diag(np.square(sigmas_m)) @ turn.T
    steps = tuple(
        dataclasses.replace(step, belief=dataclasses.replace(step.belief, covariance=wide))
        for step in lost.steps
    )
    figure = particles_figure(steps)
    save_picture(figure, tmp_path, "particles")
    assert overhang_in(figure) < CUT_IN
    for panel, step in zip(figure.axes, steps, strict=True):
        assert len(panel.child_axes) == 1
        outline = ellipse_points(step.belief.estimate[:2], wide)
        assert np.ptp(outline, axis=0).max() > 2 * max(sigmas_m)
        (left, right), (bottom, top) = panel.get_xlim(), panel.get_ylim()
        assert ((outline > (left, bottom)) & (outline < (right, top))).all()
        place = panel.get_window_extent()
        assert place.contains(*panel.transData.transform(outline).T.min(axis=1))
        assert place.contains(*panel.transData.transform(outline).T.max(axis=1))


def test_without_an_alignment_the_surface_stands_where_it_was_believed(lost: Showcase) -> None:
    shown = as_believed(lost)
    assert len(shown.aerial_cloud) == len(lost.surface.cloud_mav)
    T_mav_ground = lost.steps[-1].belief.T_ground_mav.inverse()
    back = T_mav_ground @ shown.aerial_cloud.points
    np.testing.assert_allclose(back, lost.surface.cloud_mav.points, atol=1e-4)


def test_the_figures_of_a_failed_run_are_filled_and_not_cut(lost: Showcase, tmp_path: Path) -> None:
    drawn = {one.name: one for one in showcase_figures(lost)}
    assert "refinement" not in drawn
    for name, one in drawn.items():
        save_picture(one.figure, tmp_path, name)
        assert overhang_in(one.figure) < CUT_IN, name
    augmented = drawn["fig05_15_augmented"]
    assert "Nothing was added" in augmented.caption
    for axes in augmented.figure.axes:
        (picture,) = axes.images
        filled = (np.asarray(picture.get_array()) != BACKGROUND).any(axis=2)
        assert filled.mean() > 0.3


def font_sizes_pt(pdf: bytes) -> set[float]:
    """The sizes in which the text of a file of matplotlib's is set."""
    sizes: set[float] = set()
    for packed in re.findall(rb"stream\r?\n(.*?)\r?\nendstream", pdf, re.DOTALL):
        try:
            unpacked = zlib.decompress(packed)
        except zlib.error:
            continue
        sizes |= {float(size) for size in re.findall(rb"/F\d+ ([\d.]+) Tf", unpacked)}
    return sizes


def test_errors_below_the_limits_keep_the_limits_on_the_axis() -> None:
    errors = np.full((3, 24), 0.02)
    figure = localization_error_figure({"one": errors})
    boxes, near, _ = figure.axes
    assert boxes.get_ylim()[1] > 0.5
    assert len(near.get_xticks()) <= 14


def test_runs_with_different_numbers_of_aerial_maps_stand_side_by_side() -> None:
    errors = {"four": np.full((1, 4), 0.1), "five": np.full((1, 5), 0.1)}
    near = localization_error_figure(errors).axes[1]
    assert [len(line.get_xdata()) for line in near.lines[:2]] == [4, 5]  # type: ignore[arg-type]
    assert spread_figure(errors).axes[0].get_xlim()[1] > 5
