"""Image matching under varied appearance: the looks, where the cameras stand, and one real pair."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from evaluation.measure.baselines import appearance
from evaluation.measure.baselines.appearance import (
    GROUND_DISTANCE_M,
    STAGE,
    USUAL_ANGLE_DEG,
    VIEW_ANGLES_DEG,
    add_appearance,
    looks,
    viewed_places,
)
from evaluation.measure.baselines.feature_matching import sift_matcher
from evaluation.setup.condition import Condition
from evaluation.show.report.appearance import appearance_figures, appearance_pairs
from evaluation.table.row_writer import RowWriter
from evaluation.table.rows import ResultTable
from sim.recording.recorder import Flight
from sim.scene import load_scene
from sim.sensors.presets import NOMINAL
from sim.world.world import build_world

CONDITION = Condition("best", "slam", "nominal", "known")


def test_one_condition_varies_at_a_time() -> None:
    tiny, outdoor = looks(load_scene("tiny")), looks(load_scene("outdoor"))
    assert Counter(look.varied for look in tiny) == {
        "": 1, "view_angle_deg": 4, "light_turn_deg": 3, "printed": 2
    }  # fmt: skip
    assert {look.varied for look in outdoor} == {"", "view_angle_deg", "light_turn_deg"}
    (usual,) = (look for look in tiny if not look.varied)
    for look in tiny:
        differ = {
            name
            for name in ("view_angle_deg", "light_turn_deg", "printed")
            if getattr(look, name) != getattr(usual, name)
        }
        assert differ == ({look.varied} if look.varied else set())


@pytest.mark.parametrize("angle", VIEW_ANGLES_DEG)
def test_both_cameras_look_at_the_place_from_that_angle(angle: float) -> None:
    world = build_world(load_scene("tiny"), 0, pictures=False)
    for place in viewed_places(world, 3):
        mav, ground = place.T_world_mav, place.T_world_ground(angle)
        in_mav, in_ground = (T.inverse() @ place.target[None] for T in (mav, ground))
        np.testing.assert_allclose(in_mav[0, :2], 0, atol=1e-6)
        np.testing.assert_allclose(in_ground[0], [0, 0, GROUND_DISTANCE_M], atol=1e-6)
        between = np.degrees(np.arccos(mav.rotation[:, 2] @ ground.rotation[:, 2]))
        assert between == pytest.approx(angle)
        assert ground.rotation[2, 0] == pytest.approx(0, abs=1e-9)  # rows are level
        assert ground.rotation[2, 1] < 0  # and the image's top is up


@pytest.mark.slow
def test_rows_of_a_printed_floor_seen_from_the_usual_angle(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The control scene is all print: there matching succeeds."""
    monkeypatch.setattr(appearance, "LIGHT_TURNS_DEG", ())
    monkeypatch.setattr(appearance, "VIEW_ANGLES_DEG", (USUAL_ANGLE_DEG,))
    monkeypatch.setattr(appearance, "installed_matchers", lambda: {"sift": sift_matcher()})
    scene = load_scene("flat")
    room = scene.room.model_copy(update={"size_m": (4.0, 4.0)})
    out = RowWriter("flat", 0, 0, CONDITION)
    add_appearance(out, Flight(scene.model_copy(update={"room": room}), 0, 0, NOMINAL), places=1)
    table = ResultTable.from_rows(out.rows)
    assert table.values(STAGE, "located").tolist() == [1.0]
    assert table.values(STAGE, "right_matches")[0] > 100
    assert table.values(STAGE, "sift_located").tolist() == [1.0]
    assert table.values(STAGE, "sift_right_matches")[0] > 10
    assert (table.frame["stage"] == STAGE).sum() == 2 + 2 * 2


def made_up_table(methods: tuple[str, ...] = ("",)) -> ResultTable:
    rng = np.random.default_rng(0)
    rows = []
    for scene in ("tiny", "outdoor"):
        out = RowWriter(scene, 0, 0, CONDITION)
        for trial, look in enumerate(looks(load_scene(scene)) * 2):
            out.add(STAGE, "view_angle_deg", look.view_angle_deg, "deg", trial=trial)
            out.add(STAGE, "light_turn_deg", look.light_turn_deg, "deg", trial=trial)
            if look.printed is not None:
                out.add(STAGE, "printed", look.printed, "", trial=trial)
            for method in methods:
                located = rng.random() < 0.5
                out.add(STAGE, f"{method}right_matches", rng.integers(100), "", trial=trial)
                out.add(STAGE, f"{method}located", located, "", trial=trial, note=look.varied)
        rows += out.rows
    return ResultTable.from_rows(rows)


def test_the_report_draws_a_curve_for_each_condition_and_scene() -> None:
    table = made_up_table()
    assert len(appearance_pairs(table)) == 2 * (10 + 8)
    (drawn,) = appearance_figures(table, CONDITION)
    assert "36 pairs" in drawn.caption
    shares = drawn.figure.axes[:3]
    assert [len(axes.lines) for axes in shares] == [2, 2, 1]  # print: no boxes outdoors
    angles = [line.get_xdata() for line in shares[0].lines]
    assert [len(np.asarray(values)) for values in angles] == [5, 5]


def test_learned_features_have_a_figure_of_their_own() -> None:
    both, alone = made_up_table(("", "xfeat_")), made_up_table()
    asift, xfeat = appearance_figures(both, CONDITION)
    assert (asift.name, xfeat.name) == ("fig03_appearance", "fig03_appearance_xfeat")
    assert "matched by XFeat and LighterGlue" in xfeat.caption
    drawn = [
        [line.get_ydata() for axes in figure.figure.axes for line in axes.lines]
        for figure in (asift, xfeat)
    ]
    assert len(drawn[0]) == len(drawn[1])
    assert any((a != b).any() for a, b in zip(*drawn, strict=True))
    assert [figure.name for figure in appearance_figures(alone, CONDITION)] == ["fig03_appearance"]


def test_without_rows_there_is_no_figure() -> None:
    assert list(appearance_figures(ResultTable.from_rows([]), CONDITION)) == []
