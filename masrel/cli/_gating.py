"""Options by which a verb fails when the numbers do not keep their limits."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel._files import no_follow, write_file
from masrel.cli._options import Decorator, grouped
from masrel.cli._paths import OutputFile
from masrel.protocol import Gate, Protocol, gates_of, parse_gate

if TYPE_CHECKING:
    from masrel.analysis import Analysis

_LARGEST_SUMMARY = 1 << 20  # GitHub takes no more of a step


@dataclass(frozen=True, slots=True, kw_only=True)
class GateOptions:
    """Gates of a call, and where what came of them is written."""

    require: tuple[str, ...]
    junit: Path | None

    def gates(self, protocol: Protocol) -> tuple[Gate, ...]:
        """Return the gates of the protocol and of the call, each checked."""
        ids = [line.id for line in protocol.analysis.estimates]
        of_call = (parse_gate(text, ids, where="--require") for text in self.require)
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
            help="Exit with 1 unless a number keeps a limit, as 'kappa.low >= 0.4': "
            "value, low, high, width, n, n_missing or p of an estimate of the plan.",
        ),
        click.option(
            "--junit",
            type=OutputFile(path_type=Path, dir_okay=False),
            help="Write estimates and gates as a JUnit file.",
        ),
    )


def conclude(
    analysis: "Analysis", gates: tuple[Gate, ...], options: GateOptions
) -> None:
    """Write what came of the gates, say which fail, and end with 1 if one does."""
    from masrel.analysis import check_gates
    from masrel.report._junit import job_summary, junit_text

    results = check_gates(analysis, gates)
    if options.junit is not None:
        write_file(options.junit, junit_text(analysis, results))
    summary = os.environ.get("GITHUB_STEP_SUMMARY")
    if summary:
        _append(Path(summary), job_summary(analysis, results))
    for result in results:
        click.echo(result, err=True)
    if not all(result.holds for result in results):
        click.get_current_context().exit(1)


def _append(file: Path, text: str) -> None:
    with open(file, "ab", opener=no_follow) as out:
        out.write(text.encode()[:_LARGEST_SUMMARY])
