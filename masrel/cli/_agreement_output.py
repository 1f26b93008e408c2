"""How `masrel agree` shows what it estimated, and what it says of it."""

import shlex
import shutil
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.analysis._file_estimates import AgreementRow, EstimateOptions
from masrel.cli._options import OutputOptions, echo_notes, write_output
from masrel.cli._reading import ReadingOptions, what_was_read

if TYPE_CHECKING:
    from masrel.estimates import Target
    from masrel.ratings import RatingsFile
    from masrel.report._figure_data import Content
    from masrel.report._further_tables import FurtherTable


_WIDTHS = (88, 100)
"""Width of notes where there is no terminal, and the largest in one."""

ARGUMENTS = "masrel.arguments"
"""Where the context of a command keeps its arguments as they were typed."""


class WithArguments(click.Command):
    """A command that keeps its arguments as they were typed."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Keep the arguments before they are taken apart."""
        ctx.meta[ARGUMENTS] = tuple(args)
        return super().parse_args(ctx, args)


def write_agreement(
    rows: "Sequence[AgreementRow]",
    output: OutputOptions,
    *,
    ratings: "RatingsFile",
    reading: ReadingOptions,
    options: EstimateOptions,
    by: str | None,
    explain: bool,
    further: "Sequence[FurtherTable]",
) -> None:
    """Print and write estimates in the forms that were chosen."""
    # by: what tells groups apart; further: tables below that of the estimates, or in
    # its place if there are none
    from masrel.report import _agreement_table as shown
    from masrel.report._tables import SIMULATED

    target, bands = options.target, options.words
    is_sentence = output.sentence and bool(rows)
    data = "simulated" if ratings.simulated else "foreign"
    read_lines, notes = tuple(what_was_read(ratings)), _notes(ratings, options)
    table = shown.agreement_table(
        rows,
        caption=f"Agreement of the raters in {ratings.read['file']}",
        by=by,
        bands=bands,
        read=read_lines,
        notes=notes,
        explain=explain,
        in_sentences=output.sentence,
        data=data,
    )
    more = [other.table for other in further]
    if more and not rows:
        first, *more = more
        table = replace(first, read=read_lines, notes=(*notes, *first.notes))
    figure = _figure(rows, further, target)
    write_output(
        output,
        document=lambda: {
            **shown.agreement_record(
                rows,
                read={**ratings.read, "options": reading.record()},
                options={**options.record(), "by": ratings.read["by"]},
                scale=ratings.scale,
                notes=notes,
                by=by,
                bands=bands,
            ),
            **{other.key: other.documents for other in further},
        },
        text=lambda: (
            shown.agreement_sentences(rows, by=by, bands=bands, data=data)
            if is_sentence
            else table
        ),
        figure=figure,
        stamp=SIMULATED if ratings.simulated else "",
        notes=(*read_lines, *notes),
        more=more,
        width=_screen_width(),
    )
    if is_sentence:
        echo_notes((*read_lines, *table.notes))
    offer = _interval_offer(rows, options)
    # what came through a pipe is gone
    if offer is not None and Path(ratings.read["file"]).is_file():
        click.echo(offer, err=True)


def _figure(
    rows: "Sequence[AgreementRow]",
    further: "Sequence[FurtherTable]",
    target: "Target | None",
) -> "Callable[[], Content] | None":
    """Return what makes the figure: of the table that has one, else of estimates."""
    from masrel.report._agreement_table import agreement_forest

    for other in further:
        if other.figure is not None:
            pairs = other.figure
            return lambda: pairs
    if target is None:
        return None
    drawn = rows or [row for other in further for row in other.rows]
    return lambda: agreement_forest(drawn, target)


def _screen_width() -> int:
    """Return how wide notes are printed."""
    elsewhere, most = _WIDTHS
    if not sys.stdout.isatty():
        return elsewhere
    return min(shutil.get_terminal_size((elsewhere, 24)).columns, most)


def _notes(ratings: "RatingsFile", options: EstimateOptions) -> tuple[str, ...]:
    """Return what may have been read wrongly, and what is left out of it."""
    warnings = tuple(f"warning: {text}" for text in ratings.warnings)
    if ratings.is_ordered or not options.takes_all:
        return warnings
    return (
        *warnings,
        "Left out: the six forms of ICC, Kendall's W and Robinson's A, which need "
        "grades that are numbers or --categories with every grade in order.",
    )


def _interval_offer(
    rows: "Sequence[AgreementRow]", options: EstimateOptions
) -> str | None:
    """Return the command that gives an interval, where there is none."""
    from masrel.agreement import COEFFICIENTS

    entries = [COEFFICIENTS[row.estimate.coefficient] for row in rows]
    can = [
        entry.kernel is not None and row.estimate.reason is None
        for entry, row in zip(entries, rows, strict=True)
    ]
    if options.target is not None or not any(can):
        return None
    more, but = ["--target", "items"], ""
    without = [e for e in entries if e.kernel is None and e.interval_target != "items"]
    if without and not options.takes_all:  # named, they would be refused
        others = (entry.name for entry in entries if entry not in without)
        more = ["--coefficients", ",".join(dict.fromkeys(others)), *more]
        but = f" (without {', '.join(dict.fromkeys(e.title for e in without))})"
    arguments = click.get_current_context().meta[ARGUMENTS]
    # what follows a -- is no option
    parts = [*more, *arguments] if "--" in arguments else [*arguments, *more]
    command = shlex.join(["masrel", "agree", *parts])
    return f"no interval; for other items like these{but}: {command}"
