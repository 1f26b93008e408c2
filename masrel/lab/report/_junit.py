"""Estimates and gates as the tests of a JUnit file, and as a summary of a job."""

import math
from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from masrel.lab.analysis import Analysis, GateResult, PlannedEstimate
from masrel.lab.report._pages import as_markdown
from masrel.tables._estimate_words import sentence


def junit_text(analysis: Analysis, gates: Sequence[GateResult]) -> str:
    """Return a JUnit file: a test case an estimate and a gate, without times."""
    suite = Element("testsuite", name=f"masrel {analysis.study}")
    for planned in analysis.estimates:
        case = SubElement(
            suite, "testcase", classname="estimates", name=planned.line.id, time="0"
        )
        reason = _absence(planned)
        if reason is not None:
            SubElement(case, "skipped", message=reason)
        else:
            SubElement(case, "system-out").text = _words(planned)
    for result in gates:
        case = SubElement(
            suite, "testcase", classname="gates", name=str(result.gate), time="0"
        )
        if not result.holds:
            SubElement(case, "failure", message=str(result))
    counts = {
        "tests": len(suite),
        "errors": 0,
        "failures": len(suite.findall("*/failure")),
        "skipped": len(suite.findall("*/skipped")),
    }
    suite.set("time", "0")
    for name, count in counts.items():
        suite.set(name, str(count))
    indent(suite)
    return tostring(suite, encoding="unicode", xml_declaration=True) + "\n"


def job_summary(analysis: Analysis, gates: Sequence[GateResult]) -> str:
    """Return estimates and gates as Markdown, for the summary of a job."""
    lines = [f"## {analysis.study}", ""]
    if analysis.simulated:
        lines += ["**SIMULATED DATA**", ""]
    lines += [
        f"- {as_markdown(f'{planned.line.id}: {_words(planned)}')}"
        for planned in analysis.estimates
    ]
    if gates:
        lines += ["", "| gate | |", "|---|---|"]
        lines += [
            f"| {'holds' if result.holds else '**fails**'} | "
            f"{as_markdown(str(result))} |"
            for result in gates
        ]
    return "\n".join([*lines, ""]) + "\n"


def _words(planned: PlannedEstimate) -> str:
    if planned.estimate is None:
        return f"not in these data ({planned.reason})."
    return sentence(planned.estimate)


def _absence(planned: PlannedEstimate) -> str | None:
    # why there is no number, or None
    if planned.estimate is None:
        return planned.reason or "there is none of all raters together"
    if math.isnan(planned.estimate.value):
        return planned.estimate.reason
    return None
