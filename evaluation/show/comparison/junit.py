"""A comparison as JUnit XML, which continuous integration shows: one test case a metric."""

from __future__ import annotations

from xml.etree import ElementTree

from evaluation.judge.verdict import Comparison, Judged, Verdict
from evaluation.show.comparison.verdict_table import HEADER, cells, conclusion, conditions

SKIPPED = (Verdict.SINGLE, Verdict.UNMEASURED)


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
    told = "; ".join(f"{name}: {cell}" for name, cell in zip(HEADER, cells(judged), strict=True))
    if judged.verdict == Verdict.WORSE:
        failure = ElementTree.SubElement(case, "failure", message=told, type="worse")
        failure.text = f"{told}; what matters: {judged.metric.why}"
    elif judged.verdict in SKIPPED:
        ElementTree.SubElement(case, "skipped", message=told)
    else:
        ElementTree.SubElement(case, "system-out").text = told
    return case
