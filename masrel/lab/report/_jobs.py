"""What a job is told: estimates and gates as JUnit and Markdown, and what changed."""

import math
from collections.abc import Sequence
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from masrel.lab.analysis import Analysis, GateResult, PlannedEstimate
from masrel.lab.analysis._comparison import Change
from masrel.lab.report._pages import as_markdown
from masrel.tables._estimate_words import sentence
from masrel.tables._tables import Column, Table, Value


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


_COLUMNS = (
    Column(key="of", heading="Of", align="left"),
    Column(key="field", heading="What", align="left"),
    Column(key="old", heading="Before", digits=4),
    Column(key="new", heading="Now", digits=4),
    Column(key="difference", heading="Difference", digits=4),
)


_LONGEST = 40  # of a text in a cell


def changes_table(
    changes: Sequence[Change], inputs: Sequence[str], since: str, *, simulated: bool
) -> Table:
    """Return the table of changes, with the inputs that changed below it."""
    return Table(
        name="changes",
        caption=f"What has changed since {since}",
        columns=_COLUMNS,
        rows=tuple(
            (c.of, c.field, _short(c.old), _short(c.new), c.difference) for c in changes
        ),
        in_units=tuple(range(len(changes))),
        notes=tuple(inputs),
        data="simulated" if simulated else "",
    )


def _short(value: Value) -> Value:
    # a reason is a sentence; JSON has the whole of it
    if isinstance(value, str) and len(value) > _LONGEST:
        return f"{value[: _LONGEST - 1]}…"
    return value
