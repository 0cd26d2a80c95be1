"""Text for pages: names in data are shown as they are."""

from __future__ import annotations

import html
import re

import pytest
from markdown_it import MarkdownIt

from evaluation.setup.text import markdown_table, markdown_text

NAMES = [
    "indoor_a",
    "a|b <script>alert(1)</script>",
    "two\nlines\r\n\r\n# and a title",
    "[here](javascript:x) ![there](y)",
    "*a* **b** _c_ __d__ ~~e~~ `f` d_e",
    r"back\slash \| \<b>",
    "&lt;b&gt; &amp; A & B",
    "<!-- a comment",
]


def shown(markdown: str) -> str:
    """The text of a rendered line; an element in it fails."""
    page = MarkdownIt("commonmark").enable(["strikethrough", "table"]).render(markdown)
    (inner,) = re.findall(r"<p>(.*)</p>", page)
    assert "<" not in inner
    return html.unescape(inner)


@pytest.mark.parametrize("name", NAMES)
def test_a_line_of_markdown_shows_a_name_as_it_is(name: str) -> None:
    assert shown(f"of {markdown_text(name)}") == f"of {' '.join(name.split())}"


def test_usual_names_need_no_marks() -> None:
    for name in ("indoor_a", "best, oracle exact, 0.50 m (n = 4) [0.1, 0.2]", "R&D", "~5 %"):
        assert markdown_text(name) == name


def test_names_stay_in_their_cells() -> None:
    lines = markdown_table(["name", "a|b"], [[name, 1.5] for name in NAMES])
    page = MarkdownIt("commonmark").enable(["strikethrough", "table"]).render("\n".join(lines))
    cells = [html.unescape(cell) for cell in re.findall(r"<td>(.*)</td>", page)]
    assert cells[::2] == [" ".join(name.split()) for name in NAMES]
    assert set(cells[1::2]) == {"1.5"}
    assert re.findall(r"<th>(.*)</th>", page) == ["name", "a|b"]
