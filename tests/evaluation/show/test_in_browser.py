"""The pages in a real browser, at the width of a laptop and of a phone."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from airground.io.open_recording import open_robot
from evaluation.datasets.gallery.page import dataset_page
from evaluation.datasets.inspection.findings import Finding, Verdict
from evaluation.judge.runs import against
from evaluation.setup.condition import RunInfo
from evaluation.show.comparison.page import PAGE, write_comparison
from evaluation.show.report.page import write_report
from tests.evaluation.judge.flights import make_results
from tests.evaluation.show.browser import Browser, browser, program
from tests.evaluation.show.made_runs import made_run
from tests.evaluation.synthetic_results import BEST, PAPER, make_showcase, make_table

pytestmark = [
    pytest.mark.slow,
    pytest.mark.subject(but={"airground/slam": "results are made up", "sim": "likewise"}),
    pytest.mark.skipif(program() is None, reason="no chromium (scripts/install_chromium)"),
]

SIZES = {"laptop": (1366, 768), "phone": (390, 844)}
LONG = "a_very_long_name_of_a_folder_that_does_not_break_anywhere"

TOO_WIDE = """
[...document.querySelectorAll("main *")].filter(element => {
  const box = element.closest(".scroll, .picture");
  return (box === null || box === element)
    && element.getBoundingClientRect().right > %d + 0.5;
}).map(element => element.tagName + ": " + element.textContent.slice(0, 40))
"""
"""What sticks out of a window of some width, but for what scrolls in a box of its own.

The width is ours: a phone makes its window as wide as what sticks out.
"""

PICTURES_WITHOUT_SIZE = (
    "[...document.images].filter(i => !i.complete || i.naturalWidth === 0).length"
)
OPEN_ALL = "document.querySelectorAll('details').forEach(details => { details.open = true; })"
SMALLEST_TEXT_PX = """
Math.min(...[...document.querySelectorAll("p, td, th, li, figcaption, summary, small, div.detail")]
  .map(element => parseFloat(getComputedStyle(element).fontSize)))
"""


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with browser(tmp_path_factory.mktemp("profile")) as running:
        yield running


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("report")
    table = make_table(conditions=(BEST, PAPER), sequences=3)
    run = RunInfo("0.1.0", "abc1234", 7, "some processor", 2)
    write_report(out, table, make_showcase(scale=4), run, notes=["Something missed its mark."])
    return out / "report.html"


@pytest.fixture(scope="module")
def comparison(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("compared")
    before = made_run("before", make_results(range(10), lost=0.2))
    others = (
        made_run(LONG, make_results(range(10), {"error_median_m": 1.4})),
        made_run("other seeds", make_results(range(20, 30))),
    )
    write_comparison(out, [against(before, run) for run in others])
    return out / PAGE


@pytest.mark.parametrize("size", SIZES)
def test_the_report_fits_the_window(report: Path, opened: Browser, size: str) -> None:
    assert headings(opened, report, size) == [
        "Conditions compared",
        "Failures",
        "Figures",
        "Claims",
        "Calibration",
        "Table I: timing",
        "Scene by scene",
        "Where there is nothing to find",
        "Notes",
    ]
    check(opened, size)


@pytest.mark.parametrize("size", SIZES)
def test_the_comparison_fits_the_window(comparison: Path, opened: Browser, size: str) -> None:
    assert headings(opened, comparison, size) == [
        "What moved",
        f"{LONG} against before",
        "other seeds against before",
        "Figures",
        "Failures that appeared or disappeared",
        "Conditions",
    ]
    check(opened, size)


@pytest.mark.parametrize("size", SIZES)
def test_the_page_of_a_dataset_fits_the_window(
    small: Path, tmp_path: Path, opened: Browser, size: str
) -> None:
    (tmp_path / "data").mkdir()
    for name in ("first", LONG):
        (tmp_path / "data" / name).symlink_to(small)
    page = tmp_path / "page.html"
    noted = [Finding(f"{LONG} mav", "truth", "none " * 30, Verdict.NOTED)]
    page.write_text(dataset_page(tmp_path / "data", open_robot, noted), encoding="utf-8")
    assert headings(opened, page, size) == ["Statistics", "Inspection", LONG, "first"]
    check(opened, size)


def test_what_does_not_fit_is_noticed(tmp_path: Path, opened: Browser) -> None:
    page = tmp_path / "wide.html"
    page.write_text(
        "<meta name=viewport content='width=device-width'>"
        "<main><div style='width: 700px'>wide</div>"
        "<img src='data:image/png;base64,broken'></main><script>throw Error('no')</script>",
        encoding="utf-8",
    )
    opened.open(page, *SIZES["phone"])
    assert opened.ask("document.scrollingElement.scrollWidth") >= 700
    assert opened.ask(TOO_WIDE % SIZES["phone"][0]) == ["DIV: wide"]
    assert opened.ask(PICTURES_WITHOUT_SIZE) == 1
    assert any("Error: no" in complaint for complaint in opened.complaints)


def headings(opened: Browser, page: Path, size: str) -> list[str]:
    """Open a page, and list its sections."""
    opened.complaints.clear()
    opened.open(page, *SIZES[size])
    opened.ask(OPEN_ALL)
    return opened.ask("[...document.querySelectorAll('h2')].map(h => h.innerText)")


def check(opened: Browser, size: str) -> None:
    """What must hold for every page, with everything that folds unfolded."""
    assert opened.ask("document.images.length") >= 5
    assert opened.ask(PICTURES_WITHOUT_SIZE) == 0
    width, _ = SIZES[size]
    assert opened.ask("document.scrollingElement.scrollWidth") == width
    assert opened.ask(TOO_WIDE % width) == []
    assert opened.ask(SMALLEST_TEXT_PX) >= 12
    assert opened.complaints == []
