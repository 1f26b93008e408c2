"""Options by which a verb fails when the numbers do not keep their limits.

What a job is told of them: estimates and gates as JUnit and as Markdown.
"""

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from masrel._files import write_file
from masrel.analysis._gates import Gate, GateResult
from masrel.cli._options import Decorator, grouped
from masrel.cli._paths import OutputFile
from masrel.errors import ParameterError
from masrel.lab._study_files import no_follow, sha256_of
from masrel.lab.report._report_folder import file_hash

if TYPE_CHECKING:
    from masrel.lab.analysis import Analysis, PlannedEstimate
    from masrel.lab.protocol import Protocol

_LARGEST_SUMMARY = 1 << 20  # GitHub takes no more of a step


@dataclass(frozen=True, slots=True, kw_only=True)
class GateOptions:
    """Gates of a call, and where what came of them is written."""

    require: tuple[str, ...]
    junit: Path | None

    def gates(self, protocol: "Protocol") -> "tuple[Gate, ...]":
        """Return the gates of the protocol and of the call, each checked."""
        # Imported here, as below: a report that is current is told so without them.
        from masrel.lab.protocol.content import _gate_of, gates_of

        of_call = (_gate_of(text, protocol, where="--require") for text in self.require)
        return (*gates_of(protocol), *of_call)


def gate_options() -> Decorator:
    """Return the options of gates, as one argument `gating` of a command."""
    return grouped(
        "gating",
        GateOptions,
        click.option(
            "--require",
            multiple=True,
            metavar="GATE",
            help="Exit with 1 unless this condition is met, such as 'kappa.low >= "
            "0.4'. It names value, low, high, width, n, n_missing or p of a planned "
            "estimate, or winning_rate or advantage of a planned judge.",
        ),
        click.option(
            "--junit",
            type=OutputFile(path_type=Path, dir_okay=False),
            help="Write estimates and gates as a JUnit file.",
        ),
    )


def verdict_of(analysis: "Analysis", gates: "tuple[Gate, ...]") -> dict[str, Any]:
    """Compare an analysis with gates; return what is printed and written."""
    from masrel.lab.analysis import check_gates

    results = check_gates(analysis, gates)
    return {
        "holds": all(result.holds for result in results),
        "gates": [result.record() for result in results],
        "lines": [*map(str, results)],
        "junit": _junit_text(analysis, results),
        "summary": _job_summary(analysis, results),
    }


def conclude(verdict: Mapping[str, Any], options: GateOptions) -> None:
    """Write a verdict, say which gates fail, and end with 1 if one does."""
    junit, text = options.junit, verdict["junit"]
    digest = sha256_of(text.encode())
    if junit is not None and file_hash(str(junit)) != digest:
        write_file(junit, text)
    for line in verdict["lines"]:
        click.echo(line, err=True)
    summary = os.environ.get("GITHUB_STEP_SUMMARY")
    if summary:
        _append(Path(summary), verdict["summary"])
    if not verdict["holds"]:
        click.get_current_context().exit(1)


def _junit_text(analysis: "Analysis", gates: "Sequence[GateResult]") -> str:
    # a test case an estimate and a gate, without times
    from xml.etree.ElementTree import Element, SubElement, indent, tostring

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
    n_failures, n_skipped = (
        len(suite.findall(f"*/{of}")) for of in ("failure", "skipped")
    )
    suite.attrib |= {"time": "0", "tests": str(len(suite)), "errors": "0"}
    suite.attrib |= {"failures": str(n_failures), "skipped": str(n_skipped)}
    indent(suite)
    return tostring(suite, encoding="unicode", xml_declaration=True) + "\n"


def _job_summary(analysis: "Analysis", gates: "Sequence[GateResult]") -> str:
    # estimates and gates as Markdown
    from masrel.lab.report._pages import as_markdown

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


def _words(planned: "PlannedEstimate") -> str:
    if planned.estimate is None:
        return f"not in these data ({planned.reason})."
    from masrel.tables._estimate_words import sentence

    return sentence(planned.estimate)


def _absence(planned: "PlannedEstimate") -> str | None:
    # why there is no number, or None
    if planned.estimate is None:
        return planned.reason or "there is no estimate for all raters together"
    if math.isnan(planned.estimate.value):
        return planned.estimate.reason
    return None


def _append(file: Path, text: str) -> None:
    # whole letters: a cut may go through one
    data = text.encode()[:_LARGEST_SUMMARY].decode(errors="ignore").encode()
    try:
        with open(file, "ab", opener=no_follow) as out:
            out.write(data)
    except OSError as error:
        raise ParameterError(
            f"GITHUB_STEP_SUMMARY: {file}: {error.strerror or error}"
        ) from error
