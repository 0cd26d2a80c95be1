"""The table on the screen at the end of a sweep."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from evaluation.sweep.findings import Measured
from evaluation.sweep.plan import SweepPlan
from evaluation.sweep.readings import QUANTITIES, Quantity, Reading


def print_sweep(
    plan: SweepPlan, measured: Sequence[Measured], console: Console | None = None
) -> None:
    """Print a row for each point: where the dials stand, and what is read there."""
    shown = Table(
        title=f"{', '.join(scene.name for scene in plan.scenes)}: "
        + plan.setup.condition(plan.sensors.name).label(),
        caption="within 0.5 and 0.25 m after so many aerial maps, then refined; 95 % intervals; "
        "failures count as failures",
        box=SIMPLE,
        title_justify="left",
        caption_justify="left",
    )
    for vary in plan.varied:
        name = vary.name.replace(".", ".\n")  # a screen is narrow
        shown.add_column(name, justify="right", style="bold", overflow="fold")
    for quantity in QUANTITIES:
        shown.add_column(quantity.short, justify="right")
    for at in measured:
        dials = [str(at.point[vary.name]) for vary in plan.varied]
        shown.add_row(*dials, *(_text(q, at.readings[q.name]) for q in QUANTITIES))
    (console or Console()).print(shown)


def _text(quantity: Quantity, reading: Reading) -> str:
    if reading.count == 0:
        return "-"
    scale, form = {"%": (100, "{:.0f}"), "m": (1000, "{:.1f}"), "deg": (1, "{:.2f}")}[quantity.unit]
    unit = {"%": " %", "m": " mm", "deg": "°"}[quantity.unit]
    value, low, high = (
        form.format(scale * number) if math.isfinite(number) else "∞"
        for number in (reading.value, reading.low, reading.high)
    )
    return f"{value}{unit}\n[{low}, {high}]"
