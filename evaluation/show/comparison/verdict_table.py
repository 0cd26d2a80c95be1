"""A comparison as text: the same cells for the screen, for Markdown and for JUnit."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
from rich.console import Console

from evaluation.judge.metrics import Metric
from evaluation.judge.verdict import ALPHA, MOVED, Comparison, Judged, Verdict
from evaluation.setup.text import MISSING, TextTable, markdown_text, print_table

HEADER = ("metric", "accepted", "now", "change", "95 % interval", "p", "compared", "verdict")
NARROW = ("metric", "accepted", "now", "change", "verdict")
"""What fits a terminal of 80 characters; with `WIDE` all of it does."""
WIDE = 125
STYLES = {
    Verdict.WORSE: "bold red",
    Verdict.SLIGHTLY_WORSE: "yellow",
    Verdict.BETTER: "bold green",
    Verdict.SINGLE: "dim",
    Verdict.UNMEASURED: "dim",
}
SKIPPED = (Verdict.SINGLE, Verdict.UNMEASURED)
"""Verdicts that JUnit shows as skipped."""


def cells(judged: Judged) -> tuple[str, ...]:
    """One row below `HEADER`."""
    metric, compared = judged.metric, judged.compared
    head = (metric.title, metric.fine_text(judged.before), metric.fine_text(judged.after))
    if compared is None:
        return (*head, MISSING, MISSING, MISSING, MISSING, str(judged.verdict))
    effect = compared.effect
    return (
        *head,
        _change(metric, effect.value),
        *_certainty(judged),
        _observations(judged),
        str(judged.verdict),
    )


def conclusion(comparison: Comparison) -> str:
    """The outcome in one sentence."""
    parts = []
    for verdict in MOVED:
        titles = [judged.metric.title for judged in comparison.of(verdict)]
        if titles:
            parts.append(f"{len(titles)} {verdict}: {'; '.join(titles)}")
    single = len(comparison.of(Verdict.SINGLE))
    if single and not parts and not comparison.of(Verdict.SAME):
        return "One observation of each metric: no verdict possible"
    parts = parts or ["No difference seen"]
    if single:
        parts.append(f"{single} with one observation: no verdict possible")
    return ". ".join(parts)


def conditions(comparison: Comparison) -> str:
    """What was compared, and how it was judged."""
    pairs = "the same flights, trial by trial" if comparison.paired else "other flights"
    text = (
        f"{comparison.suite}; {comparison.condition.label()}; {pairs}. p is adjusted for all "
        f"metrics (Holm). Better or worse: p is at most {ALPHA:g}. Slightly: less than matters."
    )
    if any(_taken_as_independent(judged) for judged in comparison.judged):
        text += (
            " * Too few flights: single values are the observations. They are not quite "
            "independent, so a narrow verdict is less certain."
        )
    return text


def print_comparison(comparison: Comparison, console: Console | None = None) -> None:
    console = console or Console()
    kept = [n for n, name in enumerate(HEADER) if console.width >= WIDE or name in NARROW]
    header, *rows = (
        tuple(row[n] for n in kept) for row in (HEADER, *map(cells, comparison.judged))
    )
    print_table(
        TextTable(header, tuple(rows)),
        conclusion(comparison),
        conditions(comparison),
        console=console,
        left=(0, len(kept) - 1),
        styles=[STYLES.get(judged.verdict, "") for judged in comparison.judged],
        compact=True,
    )


def markdown(comparison: Comparison) -> str:
    """The table for a pull request: changes first, the rest folded."""
    moved = [judged for verdict in MOVED for judged in comparison.of(verdict)]
    rest = [judged for judged in comparison.judged if judged not in moved]
    lines = [f"**airground check: {markdown_text(conclusion(comparison))}**", ""]
    if moved:
        lines += [*_markdown_table(moved), ""]
    if rest:
        summary = "No difference seen, no verdict possible, or not measured"
        lines += [f"<details><summary>{summary}</summary>", "", *_markdown_table(rest), ""]
        lines += ["</details>", ""]
    return "\n".join([*lines, markdown_text(conditions(comparison)), ""])


def junit(comparison: Comparison) -> str:
    """An XML document: a metric that got worse is a failure, one without a verdict is skipped."""
    suite = ElementTree.Element(
        "testsuite",
        name="airground check",
        tests=str(len(comparison.judged)),
        failures=str(len(comparison.of(Verdict.WORSE))),
        skipped=str(sum(one.verdict in SKIPPED for one in comparison.judged)),
        errors="0",
    )
    for judged in comparison.judged:
        suite.append(_case(judged))
    output = ElementTree.SubElement(suite, "system-out")
    output.text = f"{conclusion(comparison)}. {conditions(comparison)}"
    suites = ElementTree.Element("testsuites")
    suites.append(suite)
    ElementTree.indent(suites)
    return ElementTree.tostring(suites, encoding="unicode", xml_declaration=True) + "\n"


def _case(judged: Judged) -> ElementTree.Element:
    case = ElementTree.Element("testcase", classname="airground", name=judged.metric.name)
    text = "; ".join(f"{name}: {cell}" for name, cell in zip(HEADER, cells(judged), strict=True))
    if judged.verdict == Verdict.WORSE:
        failure = ElementTree.SubElement(case, "failure", message=text, type="worse")
        failure.text = f"{text}; what matters: {judged.metric.why}"
    elif judged.verdict in SKIPPED:
        ElementTree.SubElement(case, "skipped", message=text)
    else:
        ElementTree.SubElement(case, "system-out").text = text
    return case


def _markdown_table(rows: list[Judged]) -> list[str]:
    lines = [cells(judged) for judged in rows]
    rule = ("---", *("---:" for _ in HEADER[1:-1]), "---")
    table = [HEADER, rule, *(tuple(map(markdown_text, line)) for line in lines)]
    return [f"| {' | '.join(line)} |" for line in table]


def _taken_as_independent(judged: Judged) -> bool:
    compared = judged.compared
    if compared is None or judged.verdict == Verdict.SINGLE:
        return False
    return not compared.by_flight and judged.metric.each != "recording"


def _observations(judged: Judged) -> str:
    assert judged.compared is not None
    each = "flight" if judged.compared.by_flight else judged.metric.each
    count = judged.compared.count
    mark = "*" if _taken_as_independent(judged) else ""
    return f"{count} {each}{'s' if count != 1 else ''}{mark}"


def _certainty(judged: Judged) -> tuple[str, str]:
    """The interval of the change and its p; missing where there is one observation."""
    if judged.compared is None or judged.verdict == Verdict.SINGLE:
        return MISSING, MISSING
    metric, effect = judged.metric, judged.compared.effect
    interval = f"{_change(metric, effect.low)} to {_change(metric, effect.high)}"
    return interval, "< 0.001" if judged.p < 0.001 else f"{judged.p:.3f}"


def _change(metric: Metric, value: float) -> str:
    if np.isinf(value):
        return "fails" if value > 0 else "no longer fails"
    return metric.fine_text(value, "+")
