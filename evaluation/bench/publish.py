"""Puts a benchmark's table and pictures into the docs: `python -m evaluation.bench.publish DIR`."""

from __future__ import annotations

import sys
from pathlib import Path

from airground.errors import InputError
from evaluation.bench.picture import bench_figure, curves_figure
from evaluation.bench.report import BenchReport
from evaluation.bench.table import markdown
from evaluation.setup import console
from evaluation.show.figures.style import PICTURE_DPI

BEGIN = "<!-- what airground bench found: begin -->"
END = "<!-- what airground bench found: end -->"


def with_table(page: str, report: BenchReport) -> str:
    """The page with the report's table between its two marks.

    Raises:
        InputError: The page has no such marks.
    """
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise InputError(f"the page has no lines {BEGIN} and {END}")
    return f"{before}{BEGIN}\n\n{markdown(report)}\n{END}{after}"


def publish(results: Path, docs: Path) -> None:
    """Refresh `speed.md` and its pictures.

    Args:
        results: The folder that `airground bench --out` has written.
        docs: The folder of the docs.
    """
    report = BenchReport.read(results / "bench.json")
    page = docs / "speed.md"
    page.write_text(with_table(page.read_text(encoding="utf-8"), report), encoding="utf-8")
    if report.rows:
        bench_figure(report).savefig(docs / "pictures" / "bench.png", dpi=PICTURE_DPI)
    if report.curves:
        curves_figure(report).savefig(docs / "pictures" / "bench_curves.png", dpi=PICTURE_DPI)


def main() -> int:
    """Publish the folder named on the command line into this checkout's docs."""
    if len(sys.argv) != 2:
        raise InputError("usage: python -m evaluation.bench.publish DIR")
    publish(Path(sys.argv[1]), Path(__file__).parent.parent.parent / "docs")
    return console.EXIT_OK


if __name__ == "__main__":
    sys.exit(console.run(main))
