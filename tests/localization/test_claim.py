"""When a position is claimed, from sums of two maps at one hypothesis."""

from dataclasses import replace

import numpy as np

from airground.config import Config, Localization
from airground.core.agreement import Agreement
from airground.localization.claim import Fit, why_refused
from airground.localization.cost_map import Overlays

TOGETHER = np.zeros((20, 3))
BEST = Config().localization


def fit(correlation: float, cells: int = 2500) -> Fit:
    """Heights that deviate by 0.1 m over cells of 4 cm, in maps that overlap and agree wholly."""
    sums = np.array([[cells, 0, 0, 0.01 * cells, 0.01 * cells, correlation * 0.01 * cells]])
    overlay = Overlays(sums, 0.0, 0.0, cells, cells_per_m=25.0)
    agreed = Agreement(cells, 1.0, 0.0)
    return Fit(overlay, agreed, 1.0, agreed)


def changed(**changes: object) -> Localization:
    return BEST.model_copy(update=changes)


def test_a_fit_may_be_chance_or_that_of_another_place() -> None:
    weak, alike = replace(fit(0.8), evidence=6.4), replace(fit(0.8), evidence=40.0, lead=5.5)
    assert "may be chance (6 nat, 12 are enough)" in why_refused(weak, TOGETHER, BEST)
    assert why_refused(alike, TOGETHER, BEST) == (
        "ambiguous: another place fits nearly as well (5.5 nat between them, 6 are needed)"
    )
    assert why_refused(replace(alike, lead=6.5), TOGETHER, BEST) == ""
    assert why_refused(alike, TOGETHER, changed(min_lead=5.0)) == ""


def test_a_single_particle_agrees_with_no_other() -> None:
    def refusal(*x: float) -> str:
        particles = np.array([[place, 0.0, 0.0] for place in x])
        return why_refused(fit(0.9), particles, changed(min_mode_share=0.3))

    assert refusal(0.0, 2.0) == "particles split: no two of them agree on a place"
    assert refusal(0.0, 0.01) == ""


def test_each_thing_that_a_claim_needs_has_its_reason() -> None:
    good = fit(0.9)
    assert why_refused(good, TOGETHER, BEST) == ""
    beside = replace(good, overlay=replace(good.overlay, aerial_cells=25000))
    assert why_refused(beside, TOGETHER, BEST).startswith("no overlap: only 10% of the aerial map")
    newest = replace(good, newest_overlap=0.2)
    assert why_refused(newest, TOGETHER, BEST).startswith("no overlap: only 20% of the newest")
    flat = replace(good, overlay=replace(good.overlay, sums=good.overlay.sums * [1, 1, 1, 0, 0, 0]))
    assert why_refused(flat, TOGETHER, BEST).startswith("no structure: ")
    spread = np.column_stack([np.linspace(0, 2, 20), np.zeros((20, 2))])
    assert why_refused(good, spread, BEST).startswith("particles split: ")
    assert why_refused(fit(0.1), TOGETHER, BEST).startswith("heights disagree: ")
    elsewhere = replace(good, agreed=Agreement(2500, 0.9, 0.9))
    assert "they agree over 90% at" in why_refused(elsewhere, TOGETHER, BEST)
    alone = replace(good, newest_agreed=Agreement(1000, 0.8, 0.79))
    assert "the newest agree over 80% at" in why_refused(alone, TOGETHER, BEST)
