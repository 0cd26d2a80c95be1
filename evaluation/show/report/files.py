"""Files beside a report: the values behind a figure as CSV, and tables for LaTeX."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from evaluation.judge.results import CONFIG, SUMMARY, TABLE
from evaluation.setup.text import TextTable, in_brackets
from evaluation.table.rows import ResultTable

BEHIND = {
    "fig03_appearance": ("appearance", ""),
    "fig03_appearance_xfeat": ("appearance", ""),
    "fig03_appearance_disk": ("appearance", ""),
    "fig09_mav_error": ("trajectory_error", "mav_"),
    "fig10_ground_error": ("trajectory_error", "ground_"),
    "fig11_localization_error": ("localization", "error_m"),
    "fig12_spread": ("localization", "spread_m"),
    "calibration": ("localization", ""),
    "fig13_refinement_translation": ("refinement", "_translation_m"),
    "fig14_refinement_angle": ("refinement", "_rotation_deg"),
    "error_budget": ("budget", ""),
    "table1_timing": ("timing", ""),
}
"""Figure -> stage of its rows, and what their metric contains."""
BESIDE = ((TABLE, "all values"), (SUMMARY, "summary"), (CONFIG, "configuration"))


def write_behind(folder: Path, name: str, table: ResultTable) -> str:
    """Write the rows behind a figure as CSV; returns the file's name in the run, "" for a picture
    that is not drawn from the table."""
    if name not in BEHIND:
        return ""
    stage, part = BEHIND[name]
    frame = table.frame
    rows = frame[(frame["stage"] == stage) & frame["metric"].str.contains(part, regex=False)]
    file = f"figures/{name}.csv"
    # As text: where the folder is gone, pandas makes an error without a number.
    text = rows.dropna(axis="columns", how="all").to_csv(index=False)
    (folder / file).write_text(text, encoding="utf-8")
    return file


def write_latex(folder: Path, tables: Mapping[str, TextTable]) -> dict[str, str]:
    """Write every table that has rows as `tables/NAME.tex`, with the rules of booktabs; returns
    its file by its name, "" for a table without rows."""
    (folder / "tables").mkdir(exist_ok=True)
    files = dict.fromkeys(tables, "")
    for name, table in tables.items():
        if table.rows:
            files[name] = f"tables/{name}.tex"
            (folder / files[name]).write_text(latex(table), encoding="utf-8")
    return files


def latex(table: TextTable) -> str:
    """A tabular; the detail of a cell stands in brackets."""
    header = [_escaped(cell) for cell in table.header]
    rows = [[_escaped(cell) for cell in row] for row in table.rows]
    frame = pd.DataFrame(rows, columns=pd.RangeIndex(len(header)))
    columns = "l" * len(header)
    styler = frame.style.hide(axis="index").format_index(
        lambda i: header[int(str(i))], axis="columns"
    )
    return styler.to_latex(hrules=True, column_format=columns)


def beside(folder: Path) -> list[tuple[str, str]]:
    """Files of a run and what they hold; the recording for rerun where there is one."""
    recorded = [(file.name, "recording in rerun") for file in sorted(folder.glob("*.rrd"))]
    return [*BESIDE, *recorded]


_LATEX = {
    "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_",
    "{": r"\{", "}": r"\}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}",
    "<": r"\textless{}", ">": r"\textgreater{}", "°": r"\textdegree{}", "²": r"\textsuperscript{2}",
}  # fmt: skip


def _escaped(cell: str) -> str:
    return "".join(_LATEX.get(letter, letter) for letter in in_brackets(cell))
