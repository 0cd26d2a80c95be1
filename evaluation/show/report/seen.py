"""What is seen in a figure, in words: the alternative text of its picture."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure


def seen(figure: Figure) -> str:
    """Panels with their titles, axes and curves, as the figure labels them."""
    panels = [words for axes in figure.axes if (words := _panel(axes))]
    labels = [_line(text.get_text()) for legend in figure.legends for text in legend.get_texts()]
    count = f"{len(panels)} panels: " if len(panels) > 1 else ""
    drawn = count + "; ".join(panels)
    return f"{drawn}. Drawn: {', '.join(labels)}." if labels else f"{drawn}."


def is_chart(figure: Figure) -> bool:
    """Whether it has neither images nor maps, so that its colours may be inverted."""
    return not any(axes.images for axes in figure.axes)


def _panel(axes: Axes) -> str:
    """Its title, then what is drawn against what; empty without any label."""
    title = _line(axes.get_title(loc="left") or axes.get_title())
    x, y = _line(axes.get_xlabel()), _line(axes.get_ylabel())
    against = f"{y} against {x}" if x and y else x or y
    return ", ".join(words for words in (title, against) if words)


def _line(text: str) -> str:
    return " ".join(text.split())
